//! Banks against dense formulas and under absurd readings.
#![allow(clippy::needless_range_loop, reason = "indices of experts run through several arrays at once")]

use std::vec::Vec;

use super::super::joint::{Block, Layout};
use super::super::linear::Gain;
use super::super::models::{Cartesian, Noise, Quantity, Sensor};
use super::super::weights::{CHANNELS, Rule};
use super::*;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

const OPEN: f64 = f64::INFINITY;
const K: usize = 3;
const J: usize = 2;
const SILENT: Channels = [0.0; CHANNELS];

/// Where the experts begin, and where their readings are linearised: nothing moves.
const FIRST: [[f64; J]; K] = [[0.0, 1.0], [1.0, 0.0], [-1.0, 2.0]];

fn expert(state: [f64; J], sigmas: [f64; J]) -> Linear<J> {
    Linear::new(state, &sigmas, [Gain::Optimal; J]).unwrap()
}

fn bank(rule: Rule) -> Bank<J, K> {
    let sigmas = [[1.0, 2.0], [2.0, 1.0], [1.0, 1.0]];
    let experts = core::array::from_fn(|i| expert(FIRST[i], sigmas[i]));
    Bank::new(experts, Weights::new(rule, K).unwrap()).unwrap()
}

type Square = SMatrix<f64, J, J>;

fn covariance(of: &Linear<J>) -> Square {
    of.factor() * of.factor().transpose()
}

/// Mean and covariance of a mixture, written out.
fn mixture(parts: &[(f64, Linear<J>)]) -> (SVector<f64, J>, Square) {
    let mean = parts.iter().fold(SVector::zeros(), |m, (w, x)| m + *w * SVector::<f64, J>::from(*x.state()));
    let spread = |x: &Linear<J>| {
        let d = SVector::<f64, J>::from(*x.state()) - mean;
        covariance(x) + d * d.transpose()
    };
    (mean, parts.iter().fold(Square::zeros(), |p, (w, x)| p + *w * spread(x)))
}

fn same(found: &Linear<J>, expected: &(SVector<f64, J>, Square)) -> bool {
    let mean = SVector::<f64, J>::from(*found.state()) - expected.0;
    mean.norm() < 1e-12 && (covariance(found) - expected.1).norm() < 1e-12
}

/// All experts take in the same scalar reading; gives their densities by the plain formula.
fn read(bank: &mut Bank<J, K>, value: f64, row: [f64; J], noise: f64) -> [f64; K] {
    core::array::from_fn(|i| {
        let expert = bank.expert(i).unwrap();
        let h = SVector::<f64, J>::from(row);
        let expected = h.dot(&SVector::from(*expert.state()));
        let variance = (h.transpose() * covariance(expert) * h)[0] + noise;
        bank.absorb_expert(i, value - h.dot(&SVector::from(FIRST[i])), &row, noise, OPEN).unwrap();
        (-0.5 * (value - expected).powi(2) / variance).exp() / (core::f64::consts::TAU * variance).sqrt()
    })
}

proptest! {
    #[test]
    fn weights_are_the_posterior_and_the_estimate_the_mixture(
        readings in prop::collection::vec((-3.0..3.0f64, prop::array::uniform2(-1.0..1.0f64), 0.1..2.0f64), 1..8)
    ) {
        let mut bank = bank(Rule::Bayes { floor: 0.0 });
        let mut expected = [1.0 / 3.0; K];
        for (value, row, noise) in readings {
            let densities = read(&mut bank, value, row, noise);
            (0..K).for_each(|i| expected[i] *= densities[i]);
            bank.weigh(&SILENT).unwrap();
            let sum: f64 = expected.iter().sum();
            for i in 0..K {
                prop_assert!((bank.weights().values()[i] - expected[i] / sum).abs() < 1e-12);
            }
            let parts: Vec<_> = (0..K).map(|i| (expected[i] / sum, bank.expert(i).unwrap().clone())).collect();
            prop_assert!(same(bank.fuse().unwrap(), &mixture(&parts)));
        }
    }

    #[test]
    fn a_mixed_expert_is_the_mixture_by_the_chances_of_a_switch(
        value in -3.0..3.0f64, row in prop::array::uniform2(-1.0..1.0f64), stay in 0.4..1.0f64
    ) {
        let mut bank = bank(Rule::Switching { stay });
        read(&mut bank, value, row, 0.3);
        bank.weigh(&SILENT).unwrap();
        bank.fuse().unwrap();
        let w = *bank.weights().values();
        let old: [Linear<J>; K] = core::array::from_fn(|i| bank.expert(i).unwrap().clone());
        for j in 0..K {
            let chance = |i: usize| w[i] * if i == j { stay } else { (1.0 - stay) / 2.0 };
            let sum: f64 = (0..K).map(chance).sum();
            let parts: Vec<_> = (0..K).map(|i| (chance(i) / sum, old[i].clone())).collect();
            bank.mix_expert(j).unwrap();
            prop_assert!(same(bank.expert(j).unwrap(), &mixture(&parts)), "{}", j);
        }
    }
}

#[test]
fn a_bank_of_one_is_that_filter() {
    let only = expert([0.5, 1.0], [1.0, 2.0]);
    let mut bank = Bank::new([only.clone()], Weights::<1>::new(Rule::Gating { rate: 1.0 }, 1).unwrap()).unwrap();
    let mut alone = only;
    for (value, row) in [(1.0, [1.0, 0.0]), (-2.0, [0.5, 1.0]), (0.3, [0.0, 1.0])] {
        let told = bank.absorb_expert(0, value, &row, 0.2, OPEN).unwrap();
        assert_eq!(told, alone.absorb(value, &row, 0.2, OPEN).unwrap());
        bank.weigh(&[value; CHANNELS]).unwrap();
        let fused = bank.fuse().unwrap();
        assert_eq!(fused.state(), alone.state());
        assert!((covariance(fused) - covariance(&alone)).norm() < 1e-14);
    }
}

#[test]
fn a_reading_that_is_no_number_is_refused_by_all_and_retires_nobody() {
    let mut bank = bank(Rule::Bayes { floor: 0.0 });
    for i in 0..K {
        let refused = bank.absorb_expert(i, f64::NAN, &[1.0, 0.0], 1.0, OPEN);
        assert!(matches!(refused, Err(BankError::Expert { .. })));
        assert!(bank.absorb_expert(i, 1.0, &[1.0, 0.0], -1.0, OPEN).is_err());
    }
    bank.weigh(&SILENT).unwrap();
    assert!((0..K).all(|i| bank.weights().is_present(i)));
    assert_eq!(bank.weights().values(), &[1.0 / 3.0; K]);
}

#[test]
fn who_cannot_follow_retires_and_the_others_go_on() {
    let mut bank = bank(Rule::Gating { rate: 1.0 });
    for i in 1..K {
        bank.absorb_expert(i, 0.5, &[1.0, 0.0], 1.0, OPEN).unwrap();
    }
    bank.weigh(&[1.0; CHANNELS]).unwrap();
    assert!(bank.expert(0).is_none());
    assert_eq!(bank.absorb_expert(0, 0.5, &[1.0, 0.0], 1.0, OPEN), Err(BankError::Absent { expert: 0 }));
    // An expert whose estimate runs out of the range of numbers.
    let gone = bank.absorb_expert(1, 1e308, &[1e-10, 0.0], 1e-300, OPEN);
    assert!(matches!(gone, Err(BankError::Expert { expert: 1, .. })), "{gone:?}");
    assert!(!bank.weights().is_present(1) && bank.weights().is_present(2));
    let last = *bank.expert(2).unwrap().state();
    assert_eq!(bank.fuse().unwrap().state(), &last);
}

#[test]
fn a_reading_beyond_the_gate_counts_as_one_at_the_gate() {
    let mut bank = bank(Rule::Bayes { floor: 0.0 });
    for i in 0..K {
        bank.absorb_expert(i, 1e9, &[1.0, 0.0], 1.0, 3.0).unwrap();
    }
    bank.weigh(&SILENT).unwrap();
    // All at 3 σ: only the widths of the densities differ, √2, √5, √2.
    let widths = [1.0 / 2.0_f64.sqrt(), 1.0 / 5.0_f64.sqrt(), 1.0 / 2.0_f64.sqrt()];
    let sum: f64 = widths.iter().sum();
    for (weight, width) in bank.weights().values().iter().zip(widths) {
        assert!((weight - width / sum).abs() < 1e-12);
    }
}

#[test]
fn weights_that_have_failed_fail_the_bank_and_the_last_estimate_stays() {
    let mut bank = bank(Rule::BareProduct);
    let mut last = *bank.fused().state();
    for step in 0..10_000 {
        for i in 0..K {
            bank.absorb_expert(i, 30.0, &[1e-3, 0.0], 1.0, OPEN).unwrap();
        }
        let weighed = bank.weigh(&SILENT);
        let fused = bank.fuse().map(|f| *f.state());
        assert_eq!(weighed.is_ok(), fused.is_ok());
        match fused {
            Ok(state) => last = state,
            Err(error) => {
                assert_eq!(error, BankError::Weights(WeightError::Underflow));
                assert_eq!((bank.fused().state(), step > 0), (&last, true));
                return;
            }
        }
    }
    panic!("a product of ten thousand densities of e^-450 underflows");
}

/// P3 Table 1, and the seven densities of its Table 4.
const ENTRY: [f64; 6] = [-2_102_033.0, 2_816_074.0, -238_991.0, 994.910, -781.820, 5_950.410];
const SIGMAS: [f64; 6] = [338.0, 201.0, 571.0, 0.72, 0.22, 0.035];
const DENSITIES: [f64; 7] = [-0.10, -0.06, -0.02, 0.0, 0.02, 0.06, 0.10];

fn quantities() -> [Quantity; 6] {
    let source_m = [-2.2e6, 2.9e6, -3.2e5];
    [
        Quantity::LOG_DYNAMIC_PRESSURE,
        Quantity::SpecificForce { axis: 0 },
        Quantity::SpecificForce { axis: 1 },
        Quantity::SpecificForce { axis: 2 },
        Quantity::Range { source_m },
        Quantity::RangeRate { source_m, source_mps: [-180.0, 240.0, 3_388.0] },
    ]
}

fn absurd() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -10.0..10.0f64,
        3 => -1e7..1e7f64,
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e308), Just(1e200), Just(0.0)],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn nothing_that_is_read_makes_a_bank_of_augmented_experts_give_what_is_no_number(
        readings in prop::collection::vec(prop::array::uniform6(absurd()), 1..30),
        gate in prop_oneof![Just(OPEN), Just(5.0f64)],
        rule in prop_oneof![
            Just(Rule::Gating { rate: 1.0 }), Just(Rule::BareGating { rate: 1.0 }), Just(Rule::BareProduct),
            Just(Rule::Bayes { floor: 0.0 }), Just(Rule::Switching { stay: 0.999 })
        ]
    ) {
        let model = Cartesian::<1>::MARS;
        let layout = Layout { parameters: Some(Block::constant(6)), ..Layout::default() };
        let joint = Joint::<_, 6, 1, 7> { model: &model, parameters: [0.0], layout };
        joint.check::<7>().unwrap();
        let start = |density: f64| {
            let mut state = [0.0; 7];
            state[..6].copy_from_slice(&ENTRY);
            state[6] = f64::ln(1.0 + density);
            let mut sigmas = [0.03; 7];
            sigmas[..6].copy_from_slice(&SIGMAS);
            Linear::new(state, &sigmas, [Gain::Optimal; 7]).unwrap()
        };
        let mut bank = Bank::new(DENSITIES.map(start), Weights::<7>::new(rule, 7).unwrap()).unwrap();
        for read in &readings {
            for i in 0..7 {
                let _ = bank.mix_expert(i);
                let _ = bank.predict_expert(i, &joint, 1.0, &[0.01; 7]);
                for (quantity, &value) in quantities().into_iter().zip(read) {
                    let sensor = Sensor { vehicle: &model, quantity, noise: Noise::of(0.05) };
                    let _ = bank.correct_expert(i, &joint, &Reading { sensor, value }, gate);
                }
            }
            let weighed = bank.weigh(read);
            if let Ok(fused) = bank.fuse() {
                prop_assert!(weighed.is_ok());
                prop_assert!(fused.state().iter().chain(fused.factor().iter()).all(|x| x.is_finite()));
            }
            prop_assert!(bank.fused().state().iter().all(|x| x.is_finite()));
            let sum: f64 = bank.weights().values().iter().sum();
            let nobody = bank.weights().failure() == Some(WeightError::NoExpert);
            prop_assert!((sum - 1.0).abs() < 1e-14 || nobody, "{}", sum);
        }
    }
}
