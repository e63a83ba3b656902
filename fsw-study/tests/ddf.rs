//! P2's experiment against its bars and its reference figures, on few runs; the whole of it is `aeroshell study ddf`.

use fsw_study::ddf::{Config, Filter, Kind, Outcome, Suite, fly, search};

const RUNS: u64 = 10;

fn config(fly: &[Kind]) -> Config {
    let mut config = Config::default();
    config.filters.fly = fly.to_vec();
    config.filters.rank_thresholds = vec![0.005];
    config.filters.free_thresholds = vec![0.07];
    config
}

fn flown(config: &Config, kind: Kind) -> Outcome {
    let filter = Filter::of(config).into_iter().find(|filter| filter.kind == kind).unwrap();
    fly(config, &Suite::new(config), filter, 1, RUNS)
}

fn is_within(share: f64, value: f64, of: f64) -> bool {
    (value / of - 1.0).abs() <= share
}

#[test]
fn the_filters_land_near_the_reference_and_clear_the_bars() {
    let config = config(&Kind::ALL);
    let all = Kind::ALL.map(|kind| flown(&config, kind));
    let of = |kind| all.iter().find(|outcome| outcome.filter.kind == kind).unwrap();
    for outcome in &all {
        assert_eq!((outcome.failed, outcome.indefinite_share.to_bits()), (0, 0.0f64.to_bits()), "{}", outcome.name);
        assert_eq!(outcome.history.len(), config.steps());
    }
    let ratio = |a: Kind, b: Kind| {
        let (a, b) = (of(a), of(b));
        (a.position_rmse_m / b.position_rmse_m, a.rmse[1] / b.rmse[1])
    };
    // The bars of the project.
    let (position, speed) = ratio(Kind::Ekf, Kind::Rddf1);
    assert!(position >= 5.0 && speed >= 7.0, "{position} {speed}");
    let (position, speed) = ratio(Kind::EkfTuned, Kind::Rddf1);
    assert!(position >= 1.5 && speed >= 2.7, "{position} {speed}");
    let (position, speed) = ratio(Kind::ArddfFree, Kind::Rddf2);
    assert!(position <= 1.05 && speed <= 1.05, "{position} {speed}");
    // An independent implementation's figures (200 runs); the mean of ten runs scatters by a tenth.
    for (kind, reference_m) in [
        (Kind::Ekf, 18_439.0),
        (Kind::Ddf1, 18_439.0),
        (Kind::Ddf2, 18_439.0),
        (Kind::Rddf1, 3_387.0),
        (Kind::Rddf2, 3_371.0),
        (Kind::Rddf2Lite, 3_370.0),
        (Kind::ArddfRank, 3_427.0),
        (Kind::ArddfFree, 3_429.0),
    ] {
        assert!(is_within(0.15, of(kind).position_rmse_m, reference_m), "{kind:?} {}", of(kind).position_rmse_m);
    }
    // First-order sensitivities do as well as full ones.
    assert!(is_within(0.02, of(Kind::Rddf2Lite).position_rmse_m, of(Kind::Rddf2).position_rmse_m));
    assert!((0.1..0.6).contains(&of(Kind::ArddfRank).second_share));
    assert!((0.1..0.9).contains(&of(Kind::ArddfFree).second_share));
    assert!((of(Kind::Rddf2).second_share - 1.0).abs() < 1e-12 && of(Kind::Rddf1).second_share == 0.0);
}

#[test]
fn with_true_parameters_the_desensitized_filter_pays_little_and_the_plain_one_is_consistent() {
    let mut config = config(&[Kind::Ddf2, Kind::Rddf1]);
    (config.truth.density_error, config.truth.lift_error) = (0.0, 0.0);
    config.sensors.accelerometer_bias_mps2 = 0.0;
    let plain = flown(&config, Kind::Ddf2);
    // Six components; ten runs are correlated in time.
    assert!((3.0..10.0).contains(&plain.nees), "{}", plain.nees);
    let robust = flown(&config, Kind::Rddf1);
    assert!(robust.position_rmse_m < 20.0 * plain.position_rmse_m && robust.nees < 9.0, "{}", robust.nees);
}

#[test]
fn a_tighter_threshold_is_more_often_of_second_order() {
    let mut config = config(&[Kind::ArddfFree]);
    config.experiment.duration_s = 150.0;
    config.filters.free_thresholds = vec![0.0, 0.05, 1.0];
    let suite = Suite::new(&config);
    let shares: Vec<f64> =
        Filter::of(&config).into_iter().map(|f| fly(&config, &suite, f, 1, 2).second_share).collect();
    assert!((shares[0] - 1.0).abs() < 1e-12 && (0.0..1.0).contains(&shares[1]) && shares[2] == 0.0, "{shares:?}");
}

#[test]
fn the_search_finds_the_shipped_tuning_first_among_its_neighbours() {
    let mut config = Config::default();
    config.tuning.runs = 4;
    config.tuning.process = vec![100.0, 1_000.0, 10_000.0];
    config.tuning.sensors = vec![1.0, 100.0];
    let found = search(&config, Kind::EkfTuned);
    assert_eq!(found.len(), 6);
    let tuned = config.filters.tuned;
    assert!((found[0].process, found[0].sensors) == (tuned.process, tuned.sensors), "{found:?}");
}
