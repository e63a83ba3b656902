//! Guidance, bank control and trigger flown in closed loop with perfect navigation, in a world of their own equations.
//!
//! The table of a larger campaign: `RUNS=200 cargo test --release -p fsw-core --test closed_loop -- --ignored --nocapture`.

mod aeroshell;
mod flight;
mod world;

use flight::{Outcome, fly};
use fsw_core::config::Config;
use fsw_core::guidance::corrector::MAX_PREDICTIONS;
use fsw_core::guidance::cycle::MAX_EVALUATIONS;
use fsw_core::link::packet::{CycleOutcome, DeployCause, Mode};
use fsw_core::link::parameters::{ConstraintParameters, GuidanceMode, GuidanceParameters, Modes};
use fsw_core::planet::Planet;
use fsw_core::units::rad;
use world::Dispersion;

/// The default scenario on a planet that neither turns nor is oblate, as the paper and the reference campaign have it.
fn still(config: Config) -> Config {
    Config { planet: Planet { rotation_radps: 0.0, j2: 0.0, ..config.planet }, ..config }
}

/// In mode `paper`.
fn paper(config: Config) -> Config {
    Config { modes: Modes { guidance: GuidanceMode::Paper, ..config.modes }, ..config }
}

fn campaign(config: &Config, runs: u64, navigated_density: bool) -> Vec<Outcome> {
    let half = runs / 2;
    let batch = |seeds: core::ops::Range<u64>| -> Vec<Outcome> {
        seeds.map(|seed| fly(config, &Dispersion::draw(seed), navigated_density, |_, _, _| {})).collect()
    };
    std::thread::scope(|scope| {
        let first = scope.spawn(|| batch(0..half));
        let second = batch(half..runs);
        let mut all = first.join().unwrap();
        all.extend(second);
        all
    })
}

fn sorted(all: &[Outcome], of: impl Fn(&Outcome) -> f64) -> Vec<f64> {
    let mut values: Vec<f64> = all.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

#[test]
fn the_nominal_flight_ends_at_the_target() {
    for config in [still(Config::DEFAULT), Config::DEFAULT] {
        let o = fly(&config, &Dispersion::default(), false, |_, _, _| {});
        // The lateral threshold leaves up to a kilometre that heading alignment cannot take out from 600 m/s.
        assert!(o.miss_m < 1.5e3 && o.downrange_m.abs() < 600.0, "{o:?}");
        assert_eq!(o.cause, Some(DeployCause::Trigger));
        assert!(o.altitude_m > 6e3 && o.altitude_m < 9e3, "altitude {}", o.altitude_m);
        // guidance.md §2: 8.6 g.
        assert!((o.peak_load_mps2 / 9.806_65 - 8.5).abs() < 0.6);
        assert!(o.reversals >= 1 && o.reversals <= 5, "{} reversals", o.reversals);
    }
}

#[test]
fn dispersed_flights_meet_the_figures_of_the_paper() {
    // The bars of the issue are 1.8 km and 12 km over 50 flights; a smaller set here, the same bars.
    for (config, name) in [(paper(still(Config::DEFAULT)), "still"), (paper(Config::DEFAULT), "turning")] {
        let all = campaign(&config, 24, false);
        let miss = sorted(&all, |o| o.miss_m);
        assert!(quantile(&miss, 0.5) < 1.8e3 && quantile(&miss, 1.0) < 12e3, "{name}: {miss:?}");
        for o in &all {
            assert!(o.max_evaluations <= MAX_EVALUATIONS && usize::from(o.max_predictions) <= MAX_PREDICTIONS);
            assert!(o.reversals <= 6, "{name}: {} reversals", o.reversals);
        }
    }
}

#[test]
fn a_navigated_density_halves_the_miss() {
    let median = |known| quantile(&sorted(&campaign(&paper(Config::DEFAULT), 16, known), |o| o.miss_m), 0.5);
    let (nominal_air, navigated_air) = (median(false), median(true));
    assert!(navigated_air < 0.5 * nominal_air, "{navigated_air} against {nominal_air}");
}

#[test]
fn the_bank_flown_never_passes_lift_down_nor_exceeds_its_limits() {
    let config = Config::DEFAULT;
    let (mut last, mut reversals) = (config.control.initial_bank_rad, 0);
    fly(&config, &Dispersion::draw(3), false, |vehicle, mode, command| {
        assert!(vehicle.bank.abs() < core::f64::consts::PI);
        assert!(vehicle.rate.abs() < config.control.max_rate_radps * 1.005);
        assert!(vehicle.accel.abs() <= config.control.max_accel_radps2 * (1.0 + 1e-12));
        if mode == Mode::RangeControl {
            reversals += u32::from(command * last < 0.0);
            last = command;
        }
    });
    assert!((1..=5).contains(&reversals), "{reversals} reversals");
}

#[test]
fn a_target_out_of_reach_is_said_so_and_flown_towards() {
    let mut far = Config::DEFAULT;
    far.target.longitude_rad = rad(-50.0);
    let o = fly(&far, &Dispersion::default(), false, |_, _, _| {});
    assert!(o.outcomes.contains(&CycleOutcome::Short) && o.downrange_m < -50e3, "{o:?}");
    let mut near = Config::DEFAULT;
    near.target.longitude_rad = rad(-79.0);
    let o = fly(&near, &Dispersion::default(), false, |_, _, _| {});
    assert!(o.outcomes.contains(&CycleOutcome::Long), "{o:?}");
}

#[test]
fn a_load_limit_is_kept_at_the_cost_of_range() {
    let free = fly(&Config::DEFAULT, &Dispersion::default(), false, |_, _, _| {});
    let limit = 0.95 * free.peak_load_mps2;
    let limited = Config {
        constraints: ConstraintParameters { load_mps2: limit, ..Config::DEFAULT.constraints },
        ..Config::DEFAULT
    };
    let o = fly(&limited, &Dispersion::default(), false, |_, _, _| {});
    assert!(o.outcomes.contains(&CycleOutcome::Constrained));
    // Constant-bank predictions cannot see the reversals, whose lift-up passes come on top: a per cent or two.
    assert!(o.peak_load_mps2 < 1.02 * limit, "{} of {limit}", o.peak_load_mps2);
}

#[test]
#[ignore = "a campaign that prints its table; run in release"]
fn table_of_campaigns() {
    let runs: u64 = std::env::var("RUNS").map_or(50, |s| s.parse().unwrap());
    let with = |change: fn(&mut GuidanceParameters)| {
        let mut config = Config::DEFAULT;
        change(&mut config.guidance);
        config
    };
    let rows: [(&str, Config, bool); 10] = [
        ("still, default", still(Config::DEFAULT), false),
        ("turning, default", Config::DEFAULT, false),
        ("turning, air known", Config::DEFAULT, true),
        ("still, linear c1 = 2", still(with(linear_threshold)), false),
        ("turning, linear c1 = 2", with(linear_threshold), false),
        ("turning, step 2 s", with(|g| g.predictor_step_s = 2.0), false),
        ("turning, max bank 110", with(|g| g.max_bank_rad = rad(110.0)), false),
        ("turning, max bank 150", with(|g| g.max_bank_rad = rad(150.0)), false),
        ("turning, align 650", with(|g| g.alignment_speed_mps = 650.0), false),
        ("turning, min bank 0", with(|g| g.min_bank_rad = 0.0), false),
    ];
    for (name, config, navigated_density) in &rows {
        print(name, &campaign(config, runs, *navigated_density));
    }
}

/// The threshold of the reference campaign of guidance.md §5.
fn linear_threshold(g: &mut GuidanceParameters) {
    (g.threshold_constant_m, g.threshold_linear_s, g.threshold_quadratic_s2pm) = (0.0, 2.0, 0.0);
}

fn print(name: &str, all: &[Outcome]) {
    let (miss, altitude) = (sorted(all, |o| o.miss_m), sorted(all, |o| o.altitude_m));
    let n = all.len() as f64;
    let mean = |of: &dyn Fn(&Outcome) -> f64| all.iter().map(of).sum::<f64>() / n;
    let share = |of: &dyn Fn(&Outcome) -> bool| 100.0 * all.iter().filter(|o| of(o)).count() as f64 / n;
    println!(
        "{name:24} miss p50 {:5.0} p90 {:5.0} p99 {:5.0} max {:5.0} m | <1 km {:3.0} <5 km {:5.1} % | altitude p50 {:5.0} \
         low {:5.0} m, <5 km {:3.0} % | reversals {:4.2} | evaluations {:4.0} max {:4} predictions {:4.2} | load {:4.1} g",
        quantile(&miss, 0.5),
        quantile(&miss, 0.9),
        quantile(&miss, 0.99),
        quantile(&miss, 1.0),
        share(&|o| o.miss_m < 1e3),
        share(&|o| o.miss_m < 5e3),
        quantile(&altitude, 0.5),
        quantile(&altitude, 0.0),
        share(&|o| o.altitude_m < 5e3),
        mean(&|o| f64::from(o.reversals)),
        mean(&|o| o.mean_evaluations),
        all.iter().map(|o| o.max_evaluations).max().unwrap_or(0),
        mean(&|o| o.mean_predictions),
        quantile(&sorted(all, |o| o.peak_load_mps2), 1.0) / 9.806_65,
    );
}
