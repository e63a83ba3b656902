//! The filters of the study: each a setting of the divided-difference kernel or of the linearised one.

use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;
use alloc::{format, vec};

use fsw_core::math::fun;
use fsw_core::nav::estimators::EstimatorError;
use fsw_core::nav::estimators::divided::{Chained, Degree, Divided, Order, Sensed, Sensitivities, Settings, Stepped};
use fsw_core::nav::estimators::joint::{Block, Joint, Layout};
use fsw_core::nav::estimators::linear::{Gain, Linear};
use fsw_core::nav::estimators::models::{Measurement, Reading, Sensor, Spherical, Vehicle};
use serde::{Deserialize, Serialize};

use super::config::{Config, PARAMETERS, STATES, Units};
use super::draw::{Draw, SENSED, Suite};
use crate::track::{Track, Watch};

/// State and parameters.
const AUGMENTED: usize = STATES + PARAMETERS;
/// P2's eq. 13: state and what is measured.
const CHAINED: usize = STATES + SENSED;

/// A kind of filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Extended Kalman filter.
    Ekf,
    /// The same; a search found the factors on its process noise and on what it believes of accelerations and pressure.
    EkfTuned,
    /// The same; the factor is on the process noise of speed, path angle and heading alone, which unknown forces drive.
    EkfForces,
    /// First-order divided-difference filter.
    Ddf1,
    /// Second-order.
    Ddf2,
    /// P2's robust first-order filter.
    Rddf1,
    /// P2's robust second-order filter.
    Rddf2,
    /// The same with the sensitivities of the first order.
    Rddf2Lite,
    /// P2's adaptive filter: order by its rank-sampled degree of nonlinearity.
    ArddfRank,
    /// Order by the degree of nonlinearity that the difference points show.
    ArddfFree,
    /// EKF that estimates the parameters.
    Ekf8,
}

impl Kind {
    /// All, in the order of the table.
    pub const ALL: [Self; 11] = [
        Self::Ekf,
        Self::EkfTuned,
        Self::EkfForces,
        Self::Ddf1,
        Self::Ddf2,
        Self::Rddf1,
        Self::Rddf2,
        Self::Rddf2Lite,
        Self::ArddfRank,
        Self::ArddfFree,
        Self::Ekf8,
    ];

    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ekf => "EKF",
            Self::EkfTuned => "EKF, tuned",
            Self::EkfForces => "EKF, tuned for forces",
            Self::Ddf1 => "DDF1",
            Self::Ddf2 => "DDF2",
            Self::Rddf1 => "RDDF1",
            Self::Rddf2 => "RDDF2",
            Self::Rddf2Lite => "RDDF2, sensitivities of RDDF1",
            Self::ArddfRank => "ARDDF, rank-sampled",
            Self::ArddfFree => "ARDDF, free",
            Self::Ekf8 => "EKF-8",
        }
    }
}

/// Process noise of an EKF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Noise {
    /// That of the truth times a factor.
    All(f64),
    /// That of the speed times a factor, of path angle and heading as much at the speed of the entry; the rest as in the
    /// truth.
    Forces(f64),
}

impl Noise {
    /// Standard deviations of a step.
    fn of(self, config: &Config) -> [f64; STATES] {
        let base = config.step_noise();
        match self {
            Self::All(factor) => base.map(|sigma| sigma * factor),
            Self::Forces(factor) => {
                let [r, v, _, theta, lambda, _] = base;
                let angle = v * factor / config.entry.speed_mps;
                [r, v * factor, angle, theta, lambda, angle]
            }
        }
    }
}

/// A filter: a kind, and its threshold if it has one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Filter {
    /// Kind.
    pub kind: Kind,
    /// Threshold of the degree of nonlinearity.
    pub threshold: Option<f64>,
}

impl Filter {
    /// Everything that a configuration flies.
    #[must_use]
    pub fn of(config: &Config) -> Vec<Self> {
        let filters = &config.filters;
        let each = |kind: Kind| {
            let thresholds = match kind {
                Kind::ArddfRank => filters.rank_thresholds.iter().copied().map(Some).collect(),
                Kind::ArddfFree => filters.free_thresholds.iter().copied().map(Some).collect(),
                _ => vec![None],
            };
            thresholds.into_iter().map(move |threshold| Self { kind, threshold })
        };
        filters.fly.iter().copied().flat_map(each).collect()
    }

    /// Name with the threshold.
    #[must_use]
    pub fn name(&self) -> String {
        let name = self.kind.name();
        self.threshold.map_or_else(|| name.to_owned(), |threshold| format!("{name} {threshold}"))
    }
}

/// What a filter did in one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flight {
    /// Errors.
    pub track: Track<STATES>,
    /// Degree of nonlinearity that each step went by, and whether its measurements counted to second order; nothing for
    /// linearised filters.
    pub degrees: Vec<Degree>,
}

/// The experiment as the filters see it.
pub struct Setup<'a> {
    config: &'a Config,
    suite: &'a Suite,
    model: Spherical,
}

impl<'a> Setup<'a> {
    /// Of a configuration and its sensors.
    #[must_use]
    pub fn new(config: &'a Config, suite: &'a Suite) -> Self {
        Self { config, suite, model: config.model() }
    }

    /// Flies a filter over the first `steps` steps of a draw.
    #[must_use]
    pub fn fly(&self, filter: Filter, draw: &Draw, watch: Watch, steps: usize) -> Flight {
        let mut flight = Flight::default();
        let threshold = filter.threshold.unwrap_or(0.0);
        let robust = |order, sensitivities| Settings::desensitized(order, sensitivities, self.config.filters.weights);
        let (first, full) = (Sensitivities::First, Sensitivities::Full);
        let settings = match filter.kind {
            Kind::Ekf | Kind::EkfTuned | Kind::EkfForces | Kind::Ekf8 => {
                let result = match filter.kind {
                    Kind::Ekf8 => self.fly_augmented(draw, watch, steps, &mut flight),
                    Kind::EkfTuned => {
                        let tuned = self.config.filters.tuned;
                        self.fly_linear((Noise::All(tuned.process), tuned.sensors), draw, watch, steps, &mut flight)
                    }
                    Kind::EkfForces => {
                        let tuned = self.config.filters.forces;
                        self.fly_linear((Noise::Forces(tuned.process), tuned.sensors), draw, watch, steps, &mut flight)
                    }
                    _ => self.fly_linear((Noise::All(1.0), 1.0), draw, watch, steps, &mut flight),
                };
                flight.track.failure = result.err();
                return flight;
            }
            Kind::Ddf1 => Settings::plain(Order::First),
            Kind::Ddf2 => Settings::plain(Order::Second),
            Kind::Rddf1 => robust(Order::First, first),
            Kind::Rddf2 => robust(Order::Second, full),
            Kind::Rddf2Lite => robust(Order::Second, first),
            Kind::ArddfRank => robust(Order::First, full),
            Kind::ArddfFree => robust(Order::Measured { threshold }, first),
        };
        let settings = Settings { units: self.units(), ..settings };
        let ranks = (filter.kind == Kind::ArddfRank).then_some(threshold);
        flight.track.failure = self.fly_divided(settings, ranks, draw, watch, steps, &mut flight).err();
        flight
    }

    /// Deviations of the start; 1 for what is known exactly.
    fn units(&self) -> [f64; STATES] {
        self.config.initial_sigmas().map(|sigma| if sigma > 0.0 { sigma } else { 1.0 })
    }

    fn fly_divided(
        &self,
        settings: Settings<STATES, PARAMETERS>,
        ranks: Option<f64>,
        draw: &Draw,
        watch: Watch,
        steps: usize,
        flight: &mut Flight,
    ) -> Result<(), EstimatorError> {
        let mut filter = Divided::new(draw.initial, &self.config.initial_sigmas(), settings)?;
        let (step_s, noise) = (self.config.experiment.step_s, self.config.step_noise());
        let gate = self.config.filters.gate_sigma;
        let all = self.suite.read(&self.model, draw, 1.0).zip(&draw.truth).take(steps);
        for (step, (readings, truth)) in all.enumerate() {
            let by_ranks = ranks.map(|threshold| self.choose(&mut filter, &readings, threshold)).transpose()?;
            filter.predict(&self.model, step_s, &noise)?;
            let mut degree =
                filter.correct::<_, SENSED>(readings.get(..self.suite.count(step)).unwrap_or(&[]), gate)?.degree;
            if let Some(nonlinearity) = by_ranks {
                degree.nonlinearity = nonlinearity;
            }
            self.note(&mut flight.track, watch, filter.state(), truth, || filter.factor());
            if watch == Watch::All {
                flight.degrees.push(degree);
            }
        }
        Ok(())
    }

    /// P2's adaptation: the order of a step by the rank-sampled degree of nonlinearity of φ(x) = [F(x); h(F(x))].
    fn choose(
        &self,
        filter: &mut Divided<STATES, PARAMETERS>,
        readings: &[Reading<Sensor<'_, Spherical>>; SENSED],
        threshold: f64,
    ) -> Result<f64, EstimatorError> {
        let mut units = [1.0; CHAINED];
        if self.config.filters.rank_units == Units::Deviations {
            let noises = readings.iter().map(|reading| {
                let expected = reading.sensor.expected(filter.state(), &[0.0; PARAMETERS]);
                fun::sqrt(Measurement::<STATES, PARAMETERS>::variance(&reading.sensor, expected))
            });
            units.iter_mut().zip(self.units().into_iter().chain(noises)).for_each(|(to, from)| *to = from);
        }
        let step = Stepped { process: &self.model, step_s: self.config.experiment.step_s };
        let nonlinearity =
            filter.nonlinearity_by_ranks::<_, CHAINED>(&Chained { step, sensed: Sensed(readings), units })?;
        filter.set_order(if nonlinearity > threshold { Order::Second } else { Order::First });
        Ok(nonlinearity)
    }

    fn fly_linear(
        &self,
        (noise, sensors): (Noise, f64),
        draw: &Draw,
        watch: Watch,
        steps: usize,
        flight: &mut Flight,
    ) -> Result<(), EstimatorError> {
        let joint = Joint::<'_, _, STATES, PARAMETERS, STATES> {
            model: &self.model,
            parameters: [0.0; PARAMETERS],
            layout: Layout::default(),
        };
        let filter = Linear::new(draw.initial, &self.config.initial_sigmas(), [Gain::Optimal; STATES])?;
        let noise = noise.of(self.config);
        self.run_linear(filter, &joint, &noise, sensors, (draw, watch, steps), flight)
    }

    fn fly_augmented(
        &self,
        draw: &Draw,
        watch: Watch,
        steps: usize,
        flight: &mut Flight,
    ) -> Result<(), EstimatorError> {
        let layout = Layout { parameters: Some(Block::constant(STATES)), ..Layout::default() };
        let joint =
            Joint::<'_, _, STATES, PARAMETERS, AUGMENTED> { model: &self.model, parameters: [0.0; PARAMETERS], layout };
        let with = |state: [f64; STATES], more: [f64; PARAMETERS]| {
            let mut all = [0.0; AUGMENTED];
            all.iter_mut().zip(state.into_iter().chain(more)).for_each(|(to, from)| *to = from);
            all
        };
        let sigmas = with(self.config.initial_sigmas(), self.config.filters.weights.map(fun::sqrt));
        let filter = Linear::new(with(draw.initial, [0.0; PARAMETERS]), &sigmas, [Gain::Optimal; AUGMENTED])?;
        let noise = with(self.config.step_noise(), [0.0; PARAMETERS]);
        self.run_linear(filter, &joint, &noise, 1.0, (draw, watch, steps), flight)
    }

    fn run_linear<const J: usize, const W: usize>(
        &self,
        mut filter: Linear<J>,
        joint: &Joint<'_, Spherical, STATES, PARAMETERS, W>,
        noise: &[f64; J],
        sensors: f64,
        (draw, watch, steps): (&Draw, Watch, usize),
        flight: &mut Flight,
    ) -> Result<(), EstimatorError> {
        let gate = self.config.filters.gate_sigma;
        let all = self.suite.read(&self.model, draw, sensors).zip(&draw.truth).take(steps);
        for (step, (readings, truth)) in all.enumerate() {
            filter.predict(joint, self.config.experiment.step_s, noise)?;
            for reading in readings.iter().take(self.suite.count(step)) {
                filter.correct(joint, reading, gate)?;
            }
            let mut state = [0.0; STATES];
            state.iter_mut().zip(filter.state()).for_each(|(to, from)| *to = *from);
            self.note(&mut flight.track, watch, &state, truth, || *filter.factor());
        }
        Ok(())
    }

    fn note<const J: usize>(
        &self,
        track: &mut Track<STATES>,
        watch: Watch,
        state: &[f64; STATES],
        truth: &[f64; STATES],
        factor: impl FnOnce() -> nalgebra::SMatrix<f64, J, J>,
    ) {
        let distance = || {
            let (a, b) = (self.model.position(state), self.model.position(truth));
            fun::sqrt(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
        };
        track.note(watch, (state, truth), distance, factor);
    }
}
