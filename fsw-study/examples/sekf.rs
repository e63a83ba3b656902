//! P1's experiment without the program around it: `cargo run --release -p fsw-study --example sekf -- RUNS SEED CONFIG`,
//! or `-- tune` for the search, which prints its settings.

use fsw_study::sekf::cases::{CASES, fly};
use fsw_study::sekf::config::Config;
use fsw_study::sekf::tune;
use fsw_study::sekf::tuned::TunedFile;

fn main() -> Result<(), String> {
    let mut words = std::env::args().skip(1);
    let mut config = Config::default();
    let first = words.next();
    if first.as_deref() == Some("tune") {
        let tuned = tune::search(&config, |tuned| eprintln!("{tuned:?}"));
        let command = "aeroshell study sekf --tune".to_owned();
        println!("{}", fsw_study::settings::write(&TunedFile { command, step_s: config.experiment.step_s, tuned })?);
        return Ok(());
    }
    let number = |word: Option<String>, default| word.map_or(Ok(default), |w| w.parse().map_err(|_| format!("{w}?")));
    let (runs, seed) = (number(first, 50)?, number(words.next(), 1)?);
    if let Some(path) = words.next() {
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{path}: {e}"))?;
        config = fsw_study::settings::parse_over_defaults(&text)?;
        config.check()?;
    }
    let tuned = TunedFile::shipped()?;
    for case in &CASES {
        println!("{}", case.title);
        let flown = fly(case, (&config, &tuned.tuned), (seed, runs));
        for l in &flown.limits {
            println!(
                "  {:20} position {:8.1} m  EKF/bound {:6.3}",
                l.knowledge.name(),
                l.position_rmse_m,
                l.ratio_to_ekf
            );
        }
        for o in flown.filters {
            println!(
                "  {:16} position {:8.1} m  EKF/filter {:6.3}  NEES {:9.3}  indefinite {:8.1e}  diverged {:3} failed {:3}  {:6.0} ns",
                o.filter.name(),
                o.position_rmse_m,
                o.ratio_to_ekf,
                o.nees,
                o.indefinite_share,
                o.diverged,
                o.failed,
                o.host_ns_per_step
            );
        }
    }
    Ok(())
}
