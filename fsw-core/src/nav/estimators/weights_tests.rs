//! Rules of belief against their closed forms, and where the bare ones end.
#![allow(clippy::needless_range_loop, reason = "indices of experts run through several arrays at once")]

use super::*;
use proptest::prelude::*;

const K: usize = 4;
const NO_READING: Channels = [0.0; CHANNELS];
/// Pressure, forces, range and range-rate at P3's entry in SI units; the radio's are large.
const BARE_READINGS: Channels = [0.04, 1e-4, 1e-4, 1e-4, 4.7e6, -3e3];

fn weights(rule: Rule) -> Weights<K> {
    Weights::new(rule, K).unwrap()
}

fn close(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

fn normalised(of: [f64; K]) -> [f64; K] {
    let sum: f64 = of.iter().sum();
    of.map(|x| x / sum)
}

fn any_rule() -> impl Strategy<Value = Rule> {
    prop_oneof![
        (1e-3..10.0f64).prop_map(|rate| Rule::Gating { rate }),
        (1e-3..10.0f64).prop_map(|rate| Rule::BareGating { rate }),
        Just(Rule::BareProduct),
        (0.0..0.2f64).prop_map(|floor| Rule::Bayes { floor }),
        (0.3..1.0f64).prop_map(|stay| Rule::Switching { stay }),
    ]
}

/// Mostly densities as they occur; sometimes none at all, or what is no density.
fn log_density() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -50.0..20.0f64,
        4 => -1e6..700.0f64,
        1 => prop_oneof![Just(f64::NEG_INFINITY), Just(f64::NAN), Just(f64::INFINITY), Just(-1e308)],
    ]
}

fn reading() -> impl Strategy<Value = f64> {
    prop_oneof![8 => -50.0..50.0f64, 2 => -1e9..1e9f64, 1 => prop_oneof![Just(f64::NAN), Just(1e308)]]
}

proptest! {
    #[test]
    fn whatever_comes_in_weights_are_shares_of_one_or_there_is_an_error(
        rule in any_rule(),
        steps in prop::collection::vec((prop::array::uniform4(log_density()), prop::array::uniform6(reading())), 1..40),
        leaver in 0..K
    ) {
        let mut weights = weights(rule);
        for (at, (densities, channels)) in steps.iter().enumerate() {
            if at == 20 {
                weights.retire(leaver);
            }
            let before = *weights.values();
            let outcome = weights.update(densities, channels);
            let sum: f64 = weights.values().iter().sum();
            // Five roundings of numbers up to one.
            prop_assert!((sum - 1.0).abs() < 1e-14, "{:?} {}", weights, sum);
            prop_assert!(weights.values().iter().all(|w| (0.0..=1.0 + 1e-14).contains(w)));
            if outcome.is_err() {
                prop_assert_eq!(before, *weights.values());
                prop_assert_eq!(weights.update(&[0.0; K], &NO_READING), outcome, "an error stays one");
            }
        }
    }

    #[test]
    fn bayes_in_logarithms_is_the_product_while_that_has_digits(
        steps in prop::collection::vec(prop::array::uniform4(-5.0..2.0f64), 1..20)
    ) {
        let (mut logs, mut bare) = (weights(Rule::Bayes { floor: 0.0 }), weights(Rule::BareProduct));
        for densities in &steps {
            logs.update(densities, &NO_READING).unwrap();
            bare.update(densities, &NO_READING).unwrap();
            // Sums of twenty numbers up to 5 in the exponent: 1e-14 of relative error.
            prop_assert!(close(logs.values(), bare.values(), 1e-13));
        }
    }

    #[test]
    fn with_moderate_readings_the_bare_gating_is_the_careful_one(
        steps in prop::collection::vec((prop::array::uniform4(-5.0..2.0f64), prop::array::uniform6(-2.0..2.0f64)), 1..20)
    ) {
        let (mut careful, mut bare) = (weights(Rule::Gating { rate: 0.1 }), weights(Rule::BareGating { rate: 0.1 }));
        for (densities, channels) in &steps {
            careful.update(densities, channels).unwrap();
            bare.update(densities, channels).unwrap();
            prop_assert!(close(careful.values(), bare.values(), 1e-13));
        }
    }

    #[test]
    fn a_gating_step_climbs_the_likelihood(
        densities in prop::array::uniform4(-3.0..2.0f64), channels in prop::array::uniform6(-2.0..2.0f64)
    ) {
        // From equal weights: h = p/Σp, u = η (h − ¼) z², g = softmax(u), P3 eqs. 17 and 23 to 25.
        let mut gating = weights(Rule::Gating { rate: 0.3 });
        gating.update(&densities, &channels).unwrap();
        let h = normalised(densities.map(f64::exp));
        let square: f64 = channels.iter().map(|z| z * z).sum();
        let expected = normalised(h.map(|h| (0.3 * (h - 0.25) * square).exp()));
        prop_assert!(close(gating.values(), &expected, 1e-13));
        let gained: f64 = gating.values().iter().zip(densities).map(|(g, l)| g * l.exp()).sum();
        let before: f64 = densities.iter().map(|l| 0.25 * l.exp()).sum();
        prop_assert!(gained >= before - 1e-12);
    }

    #[test]
    fn mixing_weights_are_those_of_the_whole_matrix(
        steps in prop::collection::vec(prop::array::uniform4(-5.0..2.0f64), 1..10), stay in 0.3..1.0f64
    ) {
        let mut switching = weights(Rule::Switching { stay });
        let switch = (1.0 - stay) / 3.0;
        for densities in &steps {
            let w = *switching.values();
            let chance = |i: usize, j: usize| if i == j { stay } else { switch };
            let predicted: [f64; K] = core::array::from_fn(|j| (0..K).map(|i| chance(i, j) * w[i]).sum());
            for j in 0..K {
                // μᵢⱼ = λ (i = j) + (1 − λ) wᵢ.
                let keep = switching.kept(j);
                for i in 0..K {
                    let mixed = (if i == j { keep } else { 0.0 }) + (1.0 - keep) * w[i];
                    prop_assert!((mixed - chance(i, j) * w[i] / predicted[j]).abs() < 1e-13);
                }
            }
            switching.update(densities, &NO_READING).unwrap();
            let expected = normalised(core::array::from_fn(|j| predicted[j] * densities[j].exp()));
            prop_assert!(close(switching.values(), &expected, 1e-13));
        }
    }
}

#[test]
fn a_product_of_densities_leaves_the_range_of_numbers_and_says_so() {
    for (log_density, failure) in [(-40.0, WeightError::Underflow), (40.0, WeightError::Overflow)] {
        let mut bare = weights(Rule::BareProduct);
        let failed = (0..100).find(|_| bare.update(&[log_density; K], &NO_READING).is_err()).unwrap();
        // e^±40 a step; the range is e^-745 to e^709.
        assert!((16..20).contains(&failed), "{failed}");
        assert_eq!(bare.failure(), Some(failure));
        let mut logs = weights(Rule::Bayes { floor: 0.0 });
        (0..100).for_each(|_| logs.update(&[log_density; K], &NO_READING).unwrap());
    }
}

#[test]
fn bare_gating_of_a_range_in_metres_fails_at_the_first_reading() {
    let densities = [-1.0, -2.0, -3.0, -4.0];
    let mut bare = weights(Rule::BareGating { rate: 1.0 });
    assert_eq!(bare.update(&densities, &BARE_READINGS), Err(WeightError::Overflow));
    assert_eq!(bare.values(), &[0.25; K]);
    weights(Rule::Gating { rate: 1.0 }).update(&densities, &BARE_READINGS).unwrap();
}

#[test]
fn a_weight_below_the_smallest_number_is_not_lost() {
    let mut logs = weights(Rule::Bayes { floor: 0.0 });
    for _ in 0..100 {
        logs.update(&[0.0, -20.0, -20.0, -20.0], &NO_READING).unwrap();
    }
    assert!(logs.values()[1] < f64::MIN_POSITIVE);
    for _ in 0..101 {
        logs.update(&[-20.0, 0.0, -20.0, -20.0], &NO_READING).unwrap();
    }
    assert!((logs.values()[1] - 1.0).abs() < 1e-8); // e^-20
}

#[test]
fn with_a_floor_belief_turns_within_a_few_readings() {
    let mut floored = weights(Rule::Bayes { floor: 1e-3 });
    for _ in 0..1_000 {
        floored.update(&[0.0, -20.0, -20.0, -20.0], &NO_READING).unwrap();
    }
    assert!(floored.values()[1] > 0.99e-3);
    floored.update(&[-20.0, 0.0, -20.0, -20.0], &NO_READING).unwrap();
    assert!(floored.values()[1] > 0.99);
}

#[test]
fn a_truth_that_never_switches_is_bayes() {
    let (mut stays, mut bayes) = (weights(Rule::Switching { stay: 1.0 }), weights(Rule::Bayes { floor: 0.0 }));
    for _ in 0..10 {
        stays.update(&[0.0, -1.0, 0.5, -2.0], &NO_READING).unwrap();
        bayes.update(&[0.0, -1.0, 0.5, -2.0], &NO_READING).unwrap();
        assert!(close(stays.values(), bayes.values(), 1e-13));
        assert!((0..K).all(|i| (stays.kept(i) - 1.0).abs() < 1e-15));
    }
}

#[test]
fn who_retires_leaves_its_weight_to_the_others() {
    let mut bayes = weights(Rule::Bayes { floor: 0.0 });
    bayes.update(&[0.0, -1.0, 0.5, -2.0], &NO_READING).unwrap();
    let before = *bayes.values();
    bayes.retire(2);
    let left = 1.0 - before[2];
    assert!(close(bayes.values(), &[before[0] / left, before[1] / left, 0.0, before[3] / left], 1e-15));
    (0..K).for_each(|i| bayes.retire(i));
    assert_eq!(bayes.update(&[0.0; K], &NO_READING), Err(WeightError::NoExpert));
}

#[test]
fn rules_out_of_range_and_banks_of_nobody_are_refused() {
    let bad = [
        Rule::Gating { rate: 0.0 },
        Rule::Gating { rate: f64::NAN },
        Rule::BareGating { rate: f64::INFINITY },
        Rule::Bayes { floor: 0.25 },
        Rule::Bayes { floor: -1e-3 },
        Rule::Switching { stay: 1.1 },
        Rule::Switching { stay: 0.2 },
    ];
    for rule in bad {
        assert_eq!(Weights::<K>::new(rule, K), Err(WeightError::BadRule), "{rule:?}");
    }
    for count in [0, K + 1] {
        assert_eq!(Weights::<K>::new(Rule::BareProduct, count), Err(WeightError::NoExpert));
    }
}
