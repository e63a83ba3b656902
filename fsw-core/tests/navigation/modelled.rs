//! The papers' filters over the onboard model, on the packets of a truth that the model does not know.

use fsw_core::config::Config;
use fsw_core::link::parameters::{EstimatorParameters, NavigationMode};
use fsw_core::nav::estimators::divided::Order;
use fsw_core::nav::modelled::design::{Design, Family};

use crate::flight::{Case, Outcome, default_case, fly};
use crate::{campaign, campaign_of, rms};

/// Flights of each filter where all fly.
const FEW: u64 = 6;

/// The filters that move by a model of the air instead of by the accelerometer.
fn modes() -> impl Iterator<Item = NavigationMode> {
    NavigationMode::ALL.iter().copied().filter(|mode| Design::of(*mode, &Config::DEFAULT.estimators).is_some())
}

fn mean_nees(flights: &[Outcome]) -> f64 {
    let nees: Vec<f64> = flights.iter().flat_map(|o| o.nees.iter().copied()).collect();
    nees.iter().sum::<f64>() / nees.len() as f64
}

#[test]
fn where_the_model_is_the_truth_each_filter_stays_with_it() {
    for mode in modes() {
        let mut case = default_case(1);
        (case.mode, case.dispersed) = (mode, false);
        let o = fly(&case);
        println!("{}: {:.2} m, {:.4} m/s {:?}", mode.name(), o.position_error_m, o.velocity_error_mps, o.given_up);
        // With perfect sensors the strapdown that is fallen back upon does no worse.
        let is_close = o.position_error_m < 5.0 && o.velocity_error_mps < 0.02;
        // The mean of a curved path is not the path of the mean, and an expert that is wrong pulls: filters of second order
        // and banks differ from the truth by a part of what they are uncertain of.
        let family = Design::of(mode, &Config::DEFAULT.estimators).expect("a model-based mode").family;
        let leans = matches!(family, Family::Bank(_) | Family::AugmentedBank(_))
            || matches!(family, Family::Divided { order, .. } if order != Order::First);
        let nees = mean_nees(core::slice::from_ref(&o));
        assert!(is_close || leans && nees < 3.0, "{}: {nees}", mode.name());
        assert_eq!(o.invalid_frames, 0);
    }
}

#[test]
fn in_air_that_the_model_does_not_know_each_filter_keeps_its_word_or_is_given_up_in_time() {
    let base = default_case(0);
    let reckoned = campaign_of(FEW, &base, NavigationMode::DeadReckoning);
    let reckoned_m = rms(&reckoned, |o| o.position_error_m);
    for mode in modes() {
        let flights = campaign_of(FEW, &base, mode);
        let given_up = flights.iter().filter(|o| o.given_up.is_some()).count();
        let (r, v) = (rms(&flights, |o| o.position_error_m), rms(&flights, |o| o.velocity_error_mps));
        let nees = mean_nees(&flights);
        println!("{}: {r:.0} m, {v:.2} m/s, NEES {nees:.1}, given up {given_up} of {}", mode.name(), flights.len());
        // Whatever it does, what comes out is finite and valid, and no worse than what its own covariance may still say.
        assert!(flights.iter().all(|o| o.estimate.r_i.is_finite() && o.estimate.v_i.is_finite()), "{}", mode.name());
        assert!(flights.iter().all(|o| o.invalid_frames == 0), "{}", mode.name());
        assert!(nees.is_finite() && r < 20.0 * reckoned_m, "{}: {nees}, {r}", mode.name());
    }
}

#[test]
fn filters_that_know_of_density_and_lift_beat_dead_reckoning_and_know_how_well() {
    let base = default_case(0);
    let reckoned = campaign(&base, NavigationMode::DeadReckoning);
    let (r0, v0) = (rms(&reckoned, |o| o.position_error_m), rms(&reckoned, |o| o.velocity_error_mps));
    for mode in [NavigationMode::Augmented, NavigationMode::Schmidt] {
        let flights = campaign(&base, mode);
        let (r, v) = (rms(&flights, |o| o.position_error_m), rms(&flights, |o| o.velocity_error_mps));
        let nees = mean_nees(&flights);
        println!("{}: {r:.0} m, {v:.2} m/s, NEES {nees:.2}; dead reckoning {r0:.0} m, {v0:.2} m/s", mode.name());
        assert!(flights.iter().all(|o| o.given_up.is_none()));
        assert!(r < 0.7 * r0 && v < 0.7 * v0, "{}: {r} {v}", mode.name());
        assert!(nees < 7.0, "{}: {nees}", mode.name());
    }
}

#[test]
fn among_readings_that_are_nonsense_no_filter_says_a_number_that_is_none_nor_an_indefinite_covariance() {
    for mode in NavigationMode::ALL.iter().copied().filter(|mode| *mode != NavigationMode::Ideal) {
        for (seed, nonsense) in [(1, 0.3), (2, 1.0)] {
            let o = fly(&Case { seed, mode, nonsense, ..default_case(seed) });
            println!(
                "{}, {nonsense}: {:.0} m, {:.1} m/s {:?}",
                mode.name(),
                o.position_error_m,
                o.velocity_error_mps,
                o.given_up
            );
            assert_eq!(o.not_finite, 0, "{}", mode.name());
            // A square root of a negative pivot would be none.
            assert!(o.nees.iter().all(|nees| nees.is_finite()), "{}", mode.name());
        }
    }
}

#[test]
fn each_setting_is_felt_by_the_filter_that_it_belongs_to_and_by_no_other() {
    use NavigationMode as Mode;
    type Setting = fn(&mut EstimatorParameters);
    let cases: [(&str, Setting, Mode, Mode); 16] = [
        ("unmodelled_share", |e| e.unmodelled_share *= 2.0, Mode::ModelEkf, Mode::Schmidt),
        ("calibrated_share", |e| e.calibrated_share *= 2.0, Mode::SekfRho, Mode::ModelEkf),
        ("spacing_share", |e| e.spacing_share *= 2.0, Mode::Mmae, Mode::ModelEkf),
        ("modelled_share", |e| e.modelled_share *= 2.0, Mode::Augmented, Mode::Mmae),
        ("error_correlation_s", |e| e.error_correlation_s *= 2.0, Mode::Ddf2, Mode::Ekf),
        ("lift_sigma", |e| e.lift_sigma *= 2.0, Mode::Rddf1, Mode::Ddf1),
        ("input_growth_mps2", |e| e.input_growth_mps2 *= 2.0, Mode::AugmentedInput, Mode::Augmented),
        ("calibration_start_s", |e| e.calibration_start_s = 60.0, Mode::SekfRho, Mode::AugmentedInput),
        ("calibration_s", |e| e.calibration_s *= 2.0, Mode::SekfRho, Mode::AugmentedInput),
        ("calibration_share", |e| e.calibration_share *= 0.5, Mode::SekfRho, Mode::AugmentedInput),
        ("calibration_fade_s", |e| e.calibration_fade_s *= 2.0, Mode::SekfRho, Mode::AugmentedInput),
        ("gating_rate", |e| e.gating_rate *= 10.0, Mode::Mmae, Mode::MmaeBayes),
        ("switching_stay", |e| e.switching_stay = 0.9, Mode::Imm, Mode::MmaeBayes),
        ("weight_floor", |e| e.weight_floor *= 10.0, Mode::MmaeBayes, Mode::Imm),
        ("rank_threshold", |e| e.rank_threshold = 0.0, Mode::Arddf, Mode::ArddfFree),
        ("free_threshold", |e| e.free_threshold = 0.0, Mode::ArddfFree, Mode::Arddf),
    ];
    let end = |mode: Mode, set: Setting| {
        let mut case = default_case(1);
        case.mode = mode;
        set(&mut case.estimators);
        fly(&case).estimate.r_i.to_array().map(f64::to_bits)
    };
    for (name, set, owner, stranger) in cases {
        assert_ne!(end(owner, set), end(owner, |_| {}), "{name} does nothing to {}", owner.name());
        assert_eq!(end(stranger, set), end(stranger, |_| {}), "{name} is felt by {}", stranger.name());
    }
}
