//! Filters over one true entry.

use fsw_core::nav::estimators::bank::Bank;
use fsw_core::nav::estimators::joint::Joint;
use fsw_core::nav::estimators::linear::Linear;
use fsw_core::nav::estimators::models::Cartesian;
use fsw_core::nav::estimators::weights::{Channels, Rule, Weights};
use nalgebra::{SMatrix, Vector3};

use super::config::{Config, FilterName, MOST_MODELS, Reading as TableReading};
use super::filters::{self, Pressure, STATE, Scenario, Single, WITH_DENSITY, channels, readings};
use super::truth::{Truth, nominal};
use crate::consistency::{is_indefinite_factor, nees};

/// What is judged, and how much of it is written down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watch {
    /// Instants of the record, and the end.
    Record,
    /// Nothing, but every instant is fused, as in flight: the filter is timed.
    Nothing,
}

/// An instant of the record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Note {
    /// Time since entry.
    pub time_s: f64,
    /// Estimate less truth.
    pub error: [f64; STATE],
    /// Variances as the filter believes.
    pub variance: [f64; STATE],
}

/// What a filter did in a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Which filter, and by which rate.
    pub label: String,
    /// The record; its last element is the end, if the filter came there.
    pub notes: Vec<Note>,
    /// Normalised error at the end.
    pub nees: Option<f64>,
    /// Instants with an indefinite covariance.
    pub indefinite: u64,
    /// Instants that were looked at.
    pub watched: u64,
    /// When and why it stopped.
    pub failure: Option<(f64, String)>,
    /// Weights of the experts at the instants of the record.
    pub weights: Vec<Vec<f64>>,
}

/// One true entry as filters see it.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// Settings.
    pub config: &'a Config,
    /// The filters' model.
    pub model: &'a Cartesian<1>,
    /// What is read.
    pub scenario: Scenario,
    /// What Table 1 means to the filter.
    pub reading: TableReading,
    /// The entry.
    pub truth: &'a Truth,
    /// What is written down.
    pub watch: Watch,
}

impl Sight<'_> {
    fn steps(&self) -> usize {
        self.truth.sensed.len()
    }

    /// Whether the instant after this many steps is written down.
    fn is_noted(&self, steps: usize) -> bool {
        let every = (self.config.flight.record_s / self.config.flight.step_s).round().max(1.0) as usize;
        self.watch == Watch::Record && (steps.is_multiple_of(every) || steps == self.steps())
    }

    fn note<const J: usize>(&self, outcome: &mut Outcome, steps: usize, filter: &Linear<J>) {
        let variance = std::array::from_fn(|i| filter.covariance(i, i));
        self.note_error(outcome, steps, filter.state(), variance);
        outcome.watched += 1;
        outcome.indefinite += u64::from(is_indefinite_factor(filter.factor()));
        if let (true, Some(note)) = (steps == self.steps(), outcome.notes.last()) {
            outcome.nees = Some(nees::<STATE, J>(&note.error, filter.factor()));
        }
    }

    fn note_error(&self, outcome: &mut Outcome, steps: usize, estimate: &[f64], variance: [f64; STATE]) {
        let mut error = [0.0; STATE];
        let truth = self.truth.states.get(steps).unwrap_or(&[f64::NAN; STATE]);
        error.iter_mut().zip(estimate.iter().zip(truth)).for_each(|(e, (x, t))| *e = x - t);
        outcome.notes.push(Note { time_s: self.time_s(steps), error, variance });
    }

    fn time_s(&self, steps: usize) -> f64 {
        steps as f64 * self.config.flight.step_s
    }

    /// A single filter.
    #[must_use]
    pub fn single<const J: usize, const W: usize>(&self, name: FilterName, with: &Single<'_, J, W>) -> Outcome {
        let mut outcome = Outcome { label: name.name().to_owned(), ..Outcome::default() };
        let mut filter = with.start.clone();
        for (at, sensed) in self.truth.sensed.iter().enumerate() {
            let mut step = || {
                filter.predict(&with.joint, self.config.flight.step_s, &with.noise)?;
                let Some(sensed) = sensed else { return Ok(()) };
                let all = readings(self.config, with.joint.model, sensed, with.pressure);
                let mut present = all.iter().take(self.scenario.count());
                present.try_for_each(|reading| filter.correct(&with.joint, reading, f64::INFINITY).map(|_| ()))
            };
            if let Err(error) = step() {
                let error: fsw_core::nav::estimators::EstimatorError = error;
                outcome.failure = Some((self.time_s(at + 1), error.to_string()));
                return outcome;
            }
            if self.is_noted(at + 1) {
                self.note(&mut outcome, at + 1, &filter);
            }
        }
        outcome
    }

    /// Specific force by the trapezoidal rule and gravity at the estimated position, nothing else.
    #[must_use]
    pub fn dead_reckoning(&self) -> Outcome {
        let mut outcome = Outcome { label: FilterName::DeadReckoning.name().to_owned(), ..Outcome::default() };
        let [x, y, z, vx, vy, vz] = nominal(self.config);
        let (mut r, mut v) = (Vector3::new(x, y, z), Vector3::new(vx, vy, vz));
        let gravity = |r: &Vector3<f64>| -self.config.world.mu_m3ps2 * r / r.norm().powi(3);
        let mut before = (0, Vector3::from(self.truth.first_force_mps2));
        for (at, sensed) in self.truth.sensed.iter().enumerate() {
            let Some(sensed) = sensed else { continue };
            let force = Vector3::from(sensed.force_mps2);
            let step_s = self.time_s(at + 1 - before.0);
            let mean = 0.5 * (force + before.1);
            // Midpoint rule in gravity: it changes by 1e-3 of itself in a step.
            let middle = r + 0.5 * step_s * v;
            let acceleration = mean + gravity(&middle);
            r += step_s * v + 0.5 * step_s * step_s * acceleration;
            v += step_s * acceleration;
            before = (at + 1, force);
            if self.is_noted(at + 1) {
                let estimate = [r.x, r.y, r.z, v.x, v.y, v.z];
                self.note_error(&mut outcome, at + 1, &estimate, [f64::NAN; STATE]);
            }
        }
        outcome
    }

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
        let experts = std::array::from_fn(|i| self.starts.get(i).unwrap_or(first).clone());
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

/// Least covariance at the parachute's opening for this entry: with the density unknown, and known.
///
/// # Errors
/// The model has no value at the truth.
pub fn bounds(sight: &Sight<'_>) -> Result<[SMatrix<f64, STATE, STATE>; 2], fsw_core::nav::estimators::EstimatorError> {
    let density = sight.truth.disturbance.density;
    let unknown = bound_of::<WITH_DENSITY, WITH_DENSITY>(
        sight,
        &filters::density_joint(sight.model, 1.0, false),
        &filters::joined(filters::entry_sigmas(sight.config, sight.reading), &[filters::density_sigma(sight.config)]),
        &[density.ln_1p()],
    )?;
    let known = bound_of::<STATE, STATE>(
        sight,
        &filters::plain_joint(sight.model, density),
        &filters::entry_sigmas(sight.config, sight.reading),
        &[],
    )?;
    Ok([unknown, known])
}

fn bound_of<const J: usize, const W: usize>(
    sight: &Sight<'_>,
    joint: &Joint<'_, Cartesian<1>, STATE, 1, W>,
    sigmas: &[f64; J],
    behind: &[f64],
) -> Result<SMatrix<f64, STATE, STATE>, fsw_core::nav::estimators::EstimatorError> {
    let mut bound = crate::bound::Bound::new(sigmas)?;
    for (states, sensed) in sight.truth.states.windows(2).zip(&sight.truth.sensed) {
        let &[before, now] = states else { continue };
        bound.step(joint, &filters::joined(before, behind), sight.config.flight.step_s, &[0.0; J])?;
        let Some(sensed) = sensed else { continue };
        for reading in readings(sight.config, sight.model, sensed, Pressure::Plain).iter().take(sight.scenario.count())
        {
            bound.inform(joint, &reading.sensor, &filters::joined(now, behind))?;
        }
    }
    Ok(bound.covariance().fixed_view::<STATE, STATE>(0, 0).into_owned())
}

#[cfg(test)]
mod tests {
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
