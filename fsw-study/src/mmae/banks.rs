//! Banks of filters over one true entry, each bank under one or several rules.

use alloc::borrow::ToOwned;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use fsw_core::nav::estimators::bank::Bank;
use fsw_core::nav::estimators::joint::Joint;
use fsw_core::nav::estimators::linear::Linear;
use fsw_core::nav::estimators::models::Cartesian;
use fsw_core::nav::estimators::weights::{Channels, Rule, Weights};

use super::config::MOST_MODELS;
use super::filters::{self, Pressure, STATE, Single, WITH_DENSITY, channels, readings};
use super::run::{Outcome, Sight, Watch};

impl Sight<'_> {
    /// A bank under one or several rules: as long as the truth does not switch, experts do not depend on their weights, and one
    /// bank serves all rules that are compared.
    fn bank<const J: usize, const W: usize, const K: usize>(
        &self,
        experts: &Experts<'_, J, W>,
        rules: &[(String, Rule)],
    ) -> Vec<Outcome> {
        let mut flown: Vec<Believed<K>> =
            rules.iter().map(|(label, rule)| Believed::new(label, *rule, experts)).collect();
        let Some(mut bank) = experts.bank::<K>(rules) else {
            return flown.into_iter().map(|believed| believed.outcome).collect();
        };
        for (at, sensed) in self.truth.sensed.iter().enumerate() {
            let steps = at + 1;
            for (i, joint) in experts.joints.iter().enumerate() {
                // An expert that fails retires; the bank says so when nobody is left.
                let _ = bank.mix_expert(i);
                let _ = bank.predict_expert(i, joint, self.config.flight.step_s, &experts.noise);
                let Some(sensed) = sensed else { continue };
                for reading in
                    readings(self.config, self.model, sensed, experts.pressure).iter().take(self.scenario.count())
                {
                    let _ = bank.correct_expert(i, joint, reading, f64::INFINITY);
                }
            }
            if let Some(sensed) = sensed {
                let densities = *bank.log_densities();
                let scaled = channels(self.config, self.scenario, sensed, true);
                // The first rule's failure is told by its own copy below.
                let _ = bank.weigh(&scaled);
                let bare = channels(self.config, self.scenario, sensed, false);
                flown
                    .iter_mut()
                    .for_each(|believed| believed.weigh(&bank, &densities, &scaled, &bare, self.time_s(steps)));
                if experts.is_mixing || self.watch == Watch::Nothing {
                    let _ = bank.fuse();
                }
            }
            if self.is_noted(steps) {
                flown.iter_mut().for_each(|believed| believed.note(self, &mut bank, steps));
            }
            if flown.iter().all(|believed| believed.outcome.failure.is_some()) {
                break;
            }
        }
        flown.into_iter().map(|believed| believed.outcome).collect()
    }

    /// The bank of EKFs with these constants as densities.
    #[must_use]
    pub fn constants(&self, densities: &[f64], rules: &[(String, Rule)]) -> Vec<Outcome> {
        let single = |density: &f64| filters::ekf(self.config, self.reading, self.model, *density);
        let all: Vec<_> = densities.iter().map(single).collect();
        self.sized(&Experts::of(all, rules), rules)
    }

    /// The bank of augmented experts.
    #[must_use]
    pub fn cells(&self, rules: &[(String, Rule)]) -> Vec<Outcome> {
        let (centres, sigma) = filters::cells(self.config);
        let single = |centre: &f64| filters::augmented(self.config, self.reading, self.model, (*centre, sigma), false);
        let all: Vec<_> = centres.iter().map(single).collect();
        self.sized::<WITH_DENSITY, WITH_DENSITY>(&Experts::of(all, rules), rules)
    }

    /// The kernel's size is fixed: P3's seven, or as many as the settings may ask for.
    fn sized<const J: usize, const W: usize>(
        &self,
        experts: &Experts<'_, J, W>,
        rules: &[(String, Rule)],
    ) -> Vec<Outcome> {
        if experts.joints.len() == 7 {
            self.bank::<J, W, 7>(experts, rules)
        } else {
            self.bank::<J, W, MOST_MODELS>(experts, rules)
        }
    }
}

/// Experts before they fly.
struct Experts<'m, const J: usize, const W: usize> {
    joints: Vec<Joint<'m, Cartesian<1>, STATE, 1, W>>,
    starts: Vec<Linear<J>>,
    noise: [f64; J],
    pressure: Pressure,
    is_mixing: bool,
}

impl<'m, const J: usize, const W: usize> Experts<'m, J, W> {
    fn of(all: Vec<Single<'m, J, W>>, rules: &[(String, Rule)]) -> Self {
        Self {
            noise: all.first().map_or([0.0; J], |single| single.noise),
            pressure: all.first().map_or(Pressure::Plain, |single| single.pressure),
            starts: all.iter().map(|single| single.start.clone()).collect(),
            joints: all.into_iter().map(|single| single.joint).collect(),
            is_mixing: rules.iter().any(|(_, rule)| matches!(rule, Rule::Switching { .. })),
        }
    }

    fn bank<const K: usize>(&self, rules: &[(String, Rule)]) -> Option<Bank<J, K>> {
        let (first, (_, rule)) = (self.starts.first()?, rules.first()?);
        let experts = core::array::from_fn(|i| self.starts.get(i).unwrap_or(first).clone());
        Bank::new(experts, Weights::new(*rule, self.starts.len()).ok()?).ok()
    }
}

/// What a rule makes of a bank.
struct Believed<const K: usize> {
    weights: Option<Weights<K>>,
    is_bare: bool,
    outcome: Outcome,
}

impl<const K: usize> Believed<K> {
    fn new<const J: usize, const W: usize>(label: &str, rule: Rule, experts: &Experts<'_, J, W>) -> Self {
        let mut outcome = Outcome { label: label.to_owned(), ..Outcome::default() };
        let made = Weights::new(rule, experts.starts.len());
        if let Err(error) = made {
            outcome.failure = Some((0.0, error.to_string()));
        }
        Self { weights: made.ok(), is_bare: matches!(rule, Rule::BareGating { .. }), outcome }
    }

    fn weigh<const J: usize>(
        &mut self,
        bank: &Bank<J, K>,
        densities: &[f64; K],
        scaled: &Channels,
        bare: &Channels,
        time_s: f64,
    ) {
        let (Some(weights), None) = (&mut self.weights, &self.outcome.failure) else { return };
        for expert in 0..K {
            if weights.is_present(expert) && !bank.weights().is_present(expert) {
                weights.retire(expert);
            }
        }
        if let Err(error) = weights.update(densities, if self.is_bare { bare } else { scaled }) {
            self.outcome.failure = Some((time_s, error.to_string()));
        }
    }

    fn note<const J: usize>(&mut self, sight: &Sight<'_>, bank: &mut Bank<J, K>, steps: usize) {
        let (Some(weights), None) = (&self.weights, &self.outcome.failure) else { return };
        match bank.fuse_by(weights.values()) {
            Ok(fused) => sight.note(&mut self.outcome, steps, fused),
            Err(error) => self.outcome.failure = Some((sight.time_s(steps), error.to_string())),
        }
        self.outcome.weights.push(weights.values().to_vec());
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::{Config, FilterName, Reading as TableReading};
    use super::super::filters::Scenario;
    use super::super::truth::{Draw, fly};
    use super::*;

    fn short() -> Config {
        let mut config = Config::default();
        config.flight.longest_s = 80.0;
        config
    }

    const DRAW: Draw = Draw { reading: TableReading::A, every: 1, fixed_density: None, is_robust: false };

    fn rules() -> Vec<(String, Rule)> {
        vec![
            ("gating".to_owned(), Rule::Gating { rate: 0.1 }),
            ("bayes".to_owned(), Rule::Bayes { floor: 0.0 }),
            ("product".to_owned(), Rule::BareProduct),
        ]
    }

    #[test]
    fn a_bank_that_serves_several_rules_gives_each_what_a_bank_of_its_own_does() {
        let config = short();
        let (truth, model) = (fly(&config, &DRAW, 2, 0), filters::model(&config));
        for scenario in Scenario::BOTH {
            let sight = Sight {
                config: &config,
                model: &model,
                scenario,
                reading: DRAW.reading,
                truth: &truth,
                watch: Watch::Record,
            };
            let together = sight.constants(&config.bank.densities, &rules());
            for (rule, shared) in rules().into_iter().zip(&together) {
                let alone = sight.constants(&config.bank.densities, &[rule]);
                assert_eq!(alone, std::slice::from_ref(shared), "{}", shared.label);
            }
            assert!(together[2].failure.is_some() && together[1].failure.is_none());
        }
    }

    #[test]
    fn a_bank_of_another_size_is_as_good() {
        let config = short();
        let (truth, model) = (fly(&config, &DRAW, 2, 1), filters::model(&config));
        let sight = Sight {
            config: &config,
            model: &model,
            scenario: Scenario::One,
            reading: DRAW.reading,
            truth: &truth,
            watch: Watch::Record,
        };
        let [only] = &sight.constants(&[0.0], &rules()[1..2])[..] else { panic!("one rule, one outcome") };
        let single = sight.single(FilterName::Ekf, &filters::ekf(&config, DRAW.reading, &model, 0.0));
        assert_eq!(only.notes.len(), single.notes.len());
        for (a, b) in only.notes.iter().zip(&single.notes) {
            // A bank of one is its expert, but for the rounding of its covariance's root.
            assert_eq!(a.error, b.error);
            assert!(a.variance.iter().zip(&b.variance).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
        }
    }
}
