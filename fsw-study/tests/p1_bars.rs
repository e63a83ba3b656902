//! P1's experiment at the number of runs that the claims are made for, on a seed that no setting was searched on.

use fsw_study::sekf::cases::{CASES, Outcome, fly};
use fsw_study::sekf::config::Config;
use fsw_study::sekf::kind::Kind;
use fsw_study::sekf::reference;
use fsw_study::sekf::tuned::TunedFile;

/// Runs of a case, as in P1.
const RUNS: u64 = 500;
/// Seed of the runs; the tuned settings were searched on another.
const SEED: u64 = 1;

/// Flies the named filters and the EKF in a case.
fn flown(case: &str, filters: &[Kind]) -> Vec<Outcome> {
    let tuned = TunedFile::shipped().expect("the shipped settings");
    let mut config = Config::default();
    assert_ne!(config.tuning.seed, SEED);
    config.filters.fly = [&[Kind::Ekf], filters].concat();
    let case = CASES.iter().find(|c| c.name == case).expect("a case that is flown");
    fly(case, (&config, &tuned.tuned), (SEED, RUNS)).filters
}

#[test]
fn the_filters_of_p1_reach_their_ratios_to_the_ekf_and_against_a_tuned_one_the_sekf_loses() {
    for case in CASES {
        let bars: Vec<_> = reference::bars().filter(|bar| bar.case == case.name).collect();
        assert!(!bars.is_empty(), "{}", case.name);
        let mut filters: Vec<Kind> = bars.iter().map(|bar| bar.filter).collect();
        if case.is_tuned {
            filters.push(Kind::Sekf);
        }
        let outcomes = flown(case.name, &filters);
        for outcome in &outcomes {
            let (name, ratio) = (outcome.filter.name(), outcome.ratio_to_ekf);
            println!("{} {name}: {ratio:.3}", case.name);
            assert_eq!((outcome.indefinite_share.to_bits(), outcome.diverged), (0, 0), "{} {name}", case.name);
            if let Some(least) = bars.iter().find(|bar| bar.filter == outcome.filter).and_then(|bar| bar.at_least) {
                assert!(ratio >= least, "{} {name}: {ratio} is below {least}", case.name);
            }
            if case.is_tuned && outcome.filter == Kind::Sekf {
                let known = reference::of(case.name, Kind::Sekf).expect("a reference").ratio;
                // What is claimed is that it loses, and about by how much: the reference searched a grid of its own.
                assert!((ratio / known - 1.0).abs() < 0.15 && ratio < 1.0, "{}: {ratio}, reference {known}", case.name);
            }
        }
    }
}
