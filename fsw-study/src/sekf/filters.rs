//! The filters of the study, each a layout and a rule of gains over the one linearised kernel.

use fsw_core::math::fun;
use fsw_core::nav::estimators::EstimatorError;
use fsw_core::nav::estimators::joint::{Block, Joint, Layout};
use fsw_core::nav::estimators::linear::{Gain, Linear};
use fsw_core::nav::estimators::models::{Noise, Quantity, Reading, Sensor, Spherical, Vehicle};
use nalgebra::SVector;

use super::STATES;
use super::config::{Config, Settings};
use super::draw::{Draw, Suite};
use super::kind::Kind;
use super::printed;
use crate::track::{Track, Watch};

/// Parameters of the spherical model.
pub(super) const PARAMETERS: usize = 2;
/// State and unknown input.
pub(super) const WITH_INPUT: usize = 2 * STATES;
/// Parameters after them.
pub(super) const WITH_PARAMETERS: usize = WITH_INPUT + PARAMETERS;
/// And the accelerometer's bias.
pub(super) const WITH_BIAS: usize = WITH_PARAMETERS + 3;

/// A case as the filters see it.
pub struct Setup<'a> {
    /// The experiment.
    pub config: &'a Config,
    /// Its sensors.
    pub suite: &'a Suite,
    /// What the filters believe of the vehicle.
    pub model: Spherical,
}

/// A filter ready to start: everything that tells one from another.
struct Design<const J: usize> {
    layout: Layout,
    sigmas: [f64; J],
    gains: [Gain; J],
    /// Process noise of a step.
    noise: [f64; J],
    /// First step (from 1) in which the tied input is at work.
    start: usize,
}

impl Setup<'_> {
    /// Flies a filter over a draw.
    #[must_use]
    pub fn fly(&self, kind: Kind, settings: &Settings, draw: &Draw, watch: Watch) -> Track<STATES> {
        match kind {
            Kind::Ekf => {
                let design = self.design::<STATES>(settings, Layout::default());
                self.run::<STATES, STATES>(&design, settings, draw, watch)
            }
            Kind::Sekf | Kind::SekfLate | Kind::SekfRho => {
                self.run::<WITH_INPUT, STATES>(&self.tied(kind, settings), settings, draw, watch)
            }
            Kind::SekfPrinted => printed::fly(self, printed::Start::Printed, settings, draw, watch),
            Kind::SekfUnfactored => printed::fly(self, printed::Start::Exact, settings, draw, watch),
            Kind::Schmidt => self.run::<WITH_INPUT, STATES>(&self.considered(settings), settings, draw, watch),
            Kind::Aekf12 => self.run::<WITH_INPUT, STATES>(&self.augmented(settings), settings, draw, watch),
            Kind::Aekf17 => {
                const WIDTH: usize = STATES + PARAMETERS;
                self.run::<WITH_BIAS, WIDTH>(&self.augmented(settings), settings, draw, watch)
            }
        }
    }

    /// What a filter believes to read in a step (from 0); `allowed_bias` is that of the accelerometer.
    pub(super) fn sensors(
        &self,
        index: usize,
        settings: &Settings,
        allowed_bias: f64,
    ) -> impl Iterator<Item = Sensor<'_, Spherical>> {
        let factor = settings.accelerometer;
        self.suite.at(index).iter().map(move |(quantity, sigma)| {
            let assumed = match quantity {
                Quantity::SpecificForce { .. } => fun::hypot(*sigma, allowed_bias) * factor,
                _ => *sigma,
            };
            Sensor { vehicle: &self.model, quantity: *quantity, noise: Noise::of(assumed) }
        })
    }

    /// Deviations of the initial state, (initial − true).
    pub(super) fn start_sigmas(&self) -> [f64; STATES] {
        let mut sigmas = self.config.initial.state();
        sigmas.iter_mut().zip(self.config.truth.state()).for_each(|(sigma, truth)| *sigma = (*sigma - truth).abs());
        sigmas
    }

    /// Deviations of the process noise of a step: that of the truth and that of the settings.
    pub(super) fn process_sigmas(&self, settings: &Settings) -> [f64; STATES] {
        let experiment = &self.config.experiment;
        let mut sigmas = experiment.process_noise;
        for (sigma, amplitude) in sigmas.iter_mut().zip(&self.config.input.amplitude) {
            *sigma = fun::hypot(*sigma, settings.process * amplitude) * fun::sqrt(experiment.step_s);
        }
        sigmas
    }

    /// The state's part, which all share.
    fn design<const J: usize>(&self, settings: &Settings, layout: Layout) -> Design<J> {
        let mut design =
            Design { layout, sigmas: [0.0; J], gains: [Gain::Optimal; J], noise: [0.0; J], start: usize::MAX };
        design.sigmas.iter_mut().zip(self.start_sigmas()).for_each(|(to, sigma)| *to = sigma);
        design.noise.iter_mut().zip(self.process_sigmas(settings)).for_each(|(to, sigma)| *to = sigma);
        design
    }

    /// Deviations of the input's components: `amplitudes` times the amplitude of each.
    fn set_input<const J: usize>(&self, of: &mut [f64; J], amplitudes: f64) {
        let input = of.iter_mut().skip(STATES).zip(&self.config.input.amplitude);
        input.for_each(|(sigma, amplitude)| *sigma = amplitudes * amplitude);
    }

    /// d is an increment of a step, tied to its state.
    fn tied(&self, kind: Kind, settings: &Settings) -> Design<WITH_INPUT> {
        let layout = Layout { input: Some((Block::constant(STATES), 1.0)), ..Layout::default() };
        let mut design = self.design(settings, layout);
        let factor = if kind == Kind::SekfRho { settings.input } else { 1.0 };
        design.gains.iter_mut().skip(STATES).enumerate().for_each(|(to, gain)| *gain = Gain::Tied { to, factor });
        design.start = match kind {
            Kind::SekfLate => fun::round(self.config.filters.late_start_s / self.config.experiment.step_s) as usize,
            _ => self.config.filters.sekf_start_step,
        };
        design
    }

    /// b is a rate that fades and is renewed, known only by its deviation.
    fn considered(&self, settings: &Settings) -> Design<WITH_INPUT> {
        let step_s = self.config.experiment.step_s;
        let persistence = fun::exp(-step_s / self.config.filters.considered_correlation_s);
        let layout = Layout { input: Some((Block { first: STATES, persistence }, step_s)), ..Layout::default() };
        let mut design = self.design(settings, layout);
        self.set_input(&mut design.sigmas, settings.input);
        self.set_input(&mut design.noise, settings.input * fun::sqrt(1.0 - persistence * persistence));
        design.gains.iter_mut().skip(STATES).for_each(|gain| *gain = Gain::Considered);
        design
    }

    /// b is a rate that walks; behind it, where there is room, parameters and bias.
    fn augmented<const J: usize>(&self, settings: &Settings) -> Design<J> {
        let (filters, step_s) = (&self.config.filters, self.config.experiment.step_s);
        let behind = |first: usize| (first < J).then(|| Block::constant(first));
        let layout = Layout {
            input: Some((Block::constant(STATES), step_s)),
            parameters: behind(WITH_INPUT),
            bias: behind(WITH_PARAMETERS),
        };
        let mut design = self.design(settings, layout);
        self.set_input(&mut design.sigmas, filters.input_sigma);
        self.set_input(&mut design.noise, settings.input * fun::sqrt(step_s));
        let bias = filters.bias_sigma_mps2;
        let more = [filters.density_sigma, filters.lift_sigma, bias, bias, bias];
        design.sigmas.iter_mut().skip(WITH_INPUT).zip(more).for_each(|(sigma, value)| *sigma = value);
        design
    }

    fn run<const J: usize, const W: usize>(
        &self,
        design: &Design<J>,
        settings: &Settings,
        draw: &Draw,
        watch: Watch,
    ) -> Track<STATES> {
        let mut track = Track::default();
        let note = |filter: &Linear<J>, truth: &[f64; STATES]| {
            let mut estimate = [0.0; STATES];
            estimate.iter_mut().zip(filter.state()).for_each(|(x, value)| *x = *value);
            track.note(watch, (&estimate, truth), || distance_m(&estimate, truth), || *filter.factor());
        };
        track.failure = self.steps::<J, W>(design, settings, draw, note).err();
        track
    }

    fn steps<const J: usize, const W: usize>(
        &self,
        design: &Design<J>,
        settings: &Settings,
        draw: &Draw,
        mut note: impl FnMut(&Linear<J>, &[f64; STATES]),
    ) -> Result<(), EstimatorError> {
        let joint =
            Joint::<'_, _, STATES, PARAMETERS, W> { model: &self.model, parameters: [0.0; 2], layout: design.layout };
        joint.check::<J>()?;
        let allowed_bias = if design.layout.bias.is_some() { 0.0 } else { self.config.filters.bias_sigma_mps2 };
        let mut start = [0.0; J];
        start.iter_mut().zip(self.config.initial.state()).for_each(|(x, initial)| *x = initial);
        let mut filter = Linear::new(start, &design.sigmas, design.gains)?;
        for (index, (truth, readings)) in draw.truth.iter().zip(&draw.readings).enumerate() {
            // Step k = index + 1 (P1 counts from 1).
            let is_tied = design.gains.iter().any(|gain| matches!(gain, Gain::Tied { .. }));
            if is_tied && index + 1 < design.start {
                filter.forget(STATES, STATES);
            }
            filter.predict(&joint, self.config.experiment.step_s, &design.noise)?;
            for (sensor, value) in self.sensors(index, settings, allowed_bias).zip(readings) {
                filter.correct(&joint, &Reading { sensor, value: *value }, f64::INFINITY)?;
            }
            note(&filter, truth);
        }
        Ok(())
    }
}

/// Distance between two places, m.
pub(super) fn distance_m(a: &[f64; STATES], b: &[f64; STATES]) -> f64 {
    let place = |state: &[f64; STATES]| SVector::from(Vehicle::<6, 2>::position(&Spherical::MARS, state));
    (place(a) - place(b)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_filter_stays_near_the_truth_with_a_covariance_that_is_one() {
        let config = Config::default();
        let suite = Suite::new(&config, 1.0);
        let draw = Draw::new(&config, &suite, 5, 0);
        let setup = Setup { config: &config, suite: &suite, model: config.truth.model(50.0) };
        for kind in Kind::ALL.into_iter().filter(|kind| kind.is_shipped()) {
            let settings = Settings { process: 0.4, accelerometer: 1.5, input: 0.25 };
            let track = setup.fly(kind, &settings, &draw, Watch::All);
            assert_eq!((track.failure, track.errors.len(), track.indefinite), (None, 400, 0), "{kind:?}");
            // The initial error is 1.7 km; a filter that lost its way is tens of kilometres off.
            assert!(track.position_m.iter().skip(20).all(|m| *m < 3e3), "{kind:?}");
        }
    }

    #[test]
    fn the_late_filter_is_a_kalman_filter_until_it_starts() {
        let config = Config::default();
        let suite = Suite::new(&config, 1.0);
        let draw = Draw::new(&config, &suite, 5, 1);
        let setup = Setup { config: &config, suite: &suite, model: config.truth.model(50.0) };
        let [plain, late] =
            [Kind::Ekf, Kind::SekfLate].map(|kind| setup.fly(kind, &Settings::default(), &draw, Watch::All));
        for (step, (a, b)) in plain.position_m.iter().zip(&late.position_m).enumerate() {
            let same = (a - b).abs() < 1e-6;
            // Step 20 is the first with an input in its prediction.
            if step < 19 {
                assert!(same, "step {step}");
            } else if step > 30 {
                assert!(!same, "step {step}");
            }
        }
    }
}
