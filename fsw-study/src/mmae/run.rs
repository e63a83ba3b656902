//! Single filters over one true entry; banks are in [`super::banks`].

use alloc::borrow::ToOwned;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use fsw_core::math::fun;
use fsw_core::nav::estimators::linear::Linear;
use fsw_core::nav::estimators::models::Cartesian;
use nalgebra::Vector3;

use super::config::{Config, FilterName, Reading as TableReading};
use super::filters::{STATE, Scenario, Single, readings};
use super::truth::{Truth, cube, nominal};
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
    pub(super) fn is_noted(&self, steps: usize) -> bool {
        let every = fun::round(self.config.flight.record_s / self.config.flight.step_s).max(1.0) as usize;
        self.watch == Watch::Record && (steps.is_multiple_of(every) || steps == self.steps())
    }

    pub(super) fn note<const J: usize>(&self, outcome: &mut Outcome, steps: usize, filter: &Linear<J>) {
        let variance = core::array::from_fn(|i| filter.covariance(i, i));
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

    pub(super) fn time_s(&self, steps: usize) -> f64 {
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
        let gravity = |r: &Vector3<f64>| -self.config.world.mu_m3ps2 * r / cube(r.norm());
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
}
