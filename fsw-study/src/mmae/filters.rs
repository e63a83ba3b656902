//! The study's filters as settings of the core's kernels: model, joint state, first estimate, sensors.

use alloc::vec::Vec;

use fsw_core::math::fun;
use fsw_core::nav::estimators::joint::{Block, Joint, Layout};
use fsw_core::nav::estimators::linear::{Gain, Linear};
use fsw_core::nav::estimators::models::{Cartesian, Noise, Quantity, Reading, Sensor};
use fsw_core::nav::estimators::weights::{CHANNELS, Channels, Rule};

use super::config::{Config, FilterName, Reading as TableReading};
use super::truth::{Sensed, from_ug, nominal};

/// Components of the vehicle's state.
pub const STATE: usize = 6;
/// With ln(1 + Δ) behind it.
pub const WITH_DENSITY: usize = STATE + 1;
/// With three biases behind that.
pub const WITH_BIAS: usize = WITH_DENSITY + 3;
/// Readings of an instant in scenario 2.
const SENSED: usize = 6;

/// What may be read: P3's two scenarios.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scenario {
    /// Pressure and force.
    One,
    /// Range and range rate besides.
    Two,
}

impl Scenario {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::One, Self::Two];

    /// 0 or 1.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::One => 0,
            Self::Two => 1,
        }
    }

    /// As P3 counts.
    #[must_use]
    pub const fn number(self) -> usize {
        self.index() + 1
    }

    /// How many of the readings there are.
    #[must_use]
    pub const fn count(self) -> usize {
        match self {
            Self::One => 4,
            Self::Two => SENSED,
        }
    }
}

/// How the pressure is taken in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pressure {
    /// As it is, its noise in proportion to what the filter expects.
    Plain,
    /// As its logarithm: noise in proportion is additive there, altitude linear.
    Log,
}

/// The filters' model.
#[must_use]
pub fn model<const P: usize>(config: &Config) -> Cartesian<P> {
    let world = &config.world;
    let mut model = Cartesian::MARS.banked(config.flight.bank_deg.to_radians());
    model.mu_m3ps2 = world.mu_m3ps2;
    model.spin_radps = world.spin_radps;
    model.density_kgpm3 = world.density_kgpm3;
    model.reference_radius_m = world.reference_radius_m;
    model.scale_height_m = world.scale_height_m;
    model.drag_area_m2pkg = 1.0 / world.ballistic_kgpm2;
    model.lift_to_drag = world.lift_to_drag;
    model
}

/// A model's sensor.
pub type OnBoard<'m> = Sensor<'m, Cartesian<1>>;

/// What an instant's readings are to a filter; the scenario says how many of them there are.
#[must_use]
pub fn readings<'m>(
    config: &Config,
    model: &'m Cartesian<1>,
    sensed: &Sensed,
    pressure: Pressure,
) -> [Reading<OnBoard<'m>>; SENSED] {
    let sensors = &config.sensors;
    let reading = |quantity, noise, value| Reading { sensor: Sensor { vehicle: model, quantity, noise }, value };
    let square = sensors.pressure_share * sensors.pressure_share;
    let pressed = match pressure {
        Pressure::Plain => reading(
            Quantity::DYNAMIC_PRESSURE,
            Noise { sigma: 0.0, relative: sensors.pressure_share },
            sensed.pressure_pa,
        ),
        // Mean and variance of ln(1 + s e) to fourth order in s.
        Pressure::Log => reading(
            Quantity::LOG_DYNAMIC_PRESSURE,
            Noise::of(fun::sqrt(square * (1.0 + 0.5 * square))),
            fun::ln(sensed.pressure_pa) + 0.5 * square,
        ),
    };
    let force = |axis: usize| {
        let noise = Noise::of(from_ug(sensors.accelerometer_ug));
        reading(Quantity::SpecificForce { axis }, noise, sensed.force_mps2.get(axis).copied().unwrap_or(f64::NAN))
    };
    let (source_m, source_mps) = (sensed.orbiter_m, sensed.orbiter_mps);
    [
        pressed,
        force(0),
        force(1),
        force(2),
        reading(Quantity::Range { source_m }, Noise::of(sensors.range_m), sensed.range_m),
        reading(Quantity::RangeRate { source_m, source_mps }, Noise::of(sensors.range_rate_mps), sensed.range_rate_mps),
    ]
}

/// What a gating network sees, divided by the scales or as it is.
#[must_use]
pub fn channels(config: &Config, scenario: Scenario, sensed: &Sensed, is_scaled: bool) -> Channels {
    let [pressure, force, range, rate] = if is_scaled { config.bank.scales } else { [1.0; 4] };
    let [x, y, z] = sensed.force_mps2;
    let all = [
        sensed.pressure_pa / pressure,
        x / force,
        y / force,
        z / force,
        sensed.range_m / range,
        sensed.range_rate_mps / rate,
    ];
    let mut seen = [0.0; CHANNELS];
    seen.iter_mut().zip(all).take(scenario.count()).for_each(|(channel, value)| *channel = value);
    seen
}

/// Prior deviations of the vehicle's state.
#[must_use]
pub fn entry_sigmas(config: &Config, reading: TableReading) -> [f64; STATE] {
    let (place, pace) = (config.entry.deviation_m, config.entry.deviation_mps);
    [place[0], place[1], place[2], pace[0], pace[1], pace[2]].map(|deviation| deviation / reading.divisor())
}

/// Standard deviation of ln(1 + Δ) by the law of Δ.
#[must_use]
pub fn density_sigma(config: &Config) -> f64 {
    match config.density.law {
        super::config::Law::Uniform => config.density.width / fun::sqrt(3.0),
        super::config::Law::Normal => config.density.width / 3.0,
    }
}

/// A joint state of `J`: the nominal entry, with these behind it.
#[must_use]
pub fn joined<const J: usize>(state: [f64; STATE], behind: &[f64]) -> [f64; J] {
    let mut joint = [0.0; J];
    joint.iter_mut().zip(state.iter().chain(behind)).for_each(|(to, from)| *to = *from);
    joint
}

/// A filter with the density's error known to be `density`.
#[must_use]
pub fn plain_joint<'m>(model: &'m Cartesian<1>, density: f64) -> Joint<'m, Cartesian<1>, STATE, 1, STATE> {
    Joint { model, parameters: [fun::log1p(density)], layout: Layout::default() }
}

/// A filter with the density's error in its joint state.
#[must_use]
pub fn density_joint<'m>(
    model: &'m Cartesian<1>,
    persistence: f64,
    bias: bool,
) -> Joint<'m, Cartesian<1>, STATE, 1, WITH_DENSITY> {
    let layout = Layout {
        parameters: Some(Block { first: STATE, persistence }),
        bias: bias.then_some(Block::constant(WITH_DENSITY)),
        ..Layout::default()
    };
    Joint { model, parameters: [0.0], layout }
}

/// A single filter over the joint state of `J`.
pub struct Single<'m, const J: usize, const W: usize> {
    /// Joint state and model.
    pub joint: Joint<'m, Cartesian<1>, STATE, 1, W>,
    /// The filter at entry.
    pub start: Linear<J>,
    /// Process noise of a step.
    pub noise: [f64; J],
    /// How it takes in the pressure.
    pub pressure: Pressure,
}

/// The first estimate; every component but considered ones is corrected by the optimal gain.
fn start<const J: usize>(state: [f64; J], sigmas: [f64; J], considered: Option<usize>) -> Linear<J> {
    let gains = core::array::from_fn(|i| if considered == Some(i) { Gain::Considered } else { Gain::Optimal });
    // Settings were checked: every number is finite.
    #[allow(clippy::expect_used, reason = "all settings are in ranges that are finite")]
    Linear::new(state, &sigmas, gains).expect("finite settings")
}

/// Process noise of the vehicle's state over a step: on the velocity, as its independent part.
fn state_noise(config: &Config) -> [f64; STATE] {
    let sigma = config.bank.noise_mpsps * fun::sqrt(config.flight.step_s);
    [0.0, 0.0, 0.0, sigma, sigma, sigma]
}

/// One EKF with a density.
#[must_use]
pub fn ekf<'m>(
    config: &Config,
    reading: TableReading,
    model: &'m Cartesian<1>,
    density: f64,
) -> Single<'m, STATE, STATE> {
    Single {
        joint: plain_joint(model, density),
        start: start(nominal(config), entry_sigmas(config, reading), None),
        noise: state_noise(config),
        pressure: Pressure::Plain,
    }
}

/// The EKF that estimates ln(1 + Δ), or, as Schmidt's, only counts with it; starting at `centre` with this deviation.
#[must_use]
pub fn augmented<'m>(
    config: &Config,
    reading: TableReading,
    model: &'m Cartesian<1>,
    (centre, sigma): (f64, f64),
    is_considered: bool,
) -> Single<'m, WITH_DENSITY, WITH_DENSITY> {
    let walk = config.augmented.walk_psqrts * fun::sqrt(config.flight.step_s);
    Single {
        joint: density_joint(model, 1.0, false),
        start: start(
            joined(nominal(config), &[centre]),
            joined(entry_sigmas(config, reading), &[sigma]),
            is_considered.then_some(STATE),
        ),
        noise: joined([0.0; STATE], &[walk]),
        pressure: Pressure::Log,
    }
}

/// The EKF with a Gauss–Markov density and accelerometer biases.
#[must_use]
pub fn gauss_markov<'m>(
    config: &Config,
    reading: TableReading,
    model: &'m Cartesian<1>,
) -> Single<'m, WITH_BIAS, WITH_DENSITY> {
    let settings = &config.augmented;
    let persistence = fun::exp(-config.flight.step_s / settings.markov_s);
    let bias = from_ug(settings.bias_ug);
    let sigma = settings.markov_sigma;
    Single {
        joint: density_joint(model, persistence, true),
        start: start(
            joined(nominal(config), &[]),
            joined(entry_sigmas(config, reading), &[sigma, bias, bias, bias]),
            None,
        ),
        // What keeps the variance where it is.
        noise: joined([0.0; STATE], &[sigma * fun::sqrt(1.0 - persistence * persistence)]),
        pressure: Pressure::Log,
    }
}

/// Centres and deviation of the augmented experts: the middles of equal cells of ±width, each of uniform density.
#[must_use]
pub fn cells(config: &Config) -> (Vec<f64>, f64) {
    let (count, width) = (config.augmented.experts, config.density.width);
    let cell = 2.0 * width / count as f64;
    let centre = |i: usize| fun::log1p(-width + cell * (i as f64 + 0.5));
    ((0..count).map(centre).collect(), cell / fun::sqrt(12.0))
}

/// The rule of a filter that is a bank of EKFs with these densities; the learning rate of a gating.
#[must_use]
pub fn rule(config: &Config, filter: FilterName, rate: f64) -> Option<Rule> {
    match filter {
        FilterName::Gating => Some(Rule::Gating { rate }),
        FilterName::BareGating => Some(Rule::BareGating { rate }),
        FilterName::BareProduct => Some(Rule::BareProduct),
        FilterName::Bayes | FilterName::BayesFine | FilterName::Experts => {
            Some(Rule::Bayes { floor: if filter == FilterName::Bayes { config.bank.floor } else { 0.0 } })
        }
        FilterName::Imm => Some(Rule::Switching { stay: config.bank.stay }),
        _ => None,
    }
}
