//! One true entry and what its sensors read. The equations are written here a second time, in vectors, on purpose: an error
//! of the filters' model would otherwise be true.

use alloc::vec;
use alloc::vec::Vec;

use fsw_core::math::fun;
use hil_noise::Stream;
use nalgebra::{Vector3, Vector6};

use super::config::{Config, Law, Reading};

/// Standard gravity by which accelerometers are told, m/s².
pub const STANDARD_G_MPS2: f64 = 9.80665;

/// m/s² of micro-g.
#[must_use]
pub fn from_ug(ug: f64) -> f64 {
    ug * 1e-6 * STANDARD_G_MPS2
}

/// x³.
pub(super) fn cube(x: f64) -> f64 {
    x * x * x
}

/// How an entry differs from the filters' idea of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbance {
    /// Initial state less the nominal one.
    pub entry: [f64; 6],
    /// Δ.
    pub density: f64,
    /// Amplitude of the density's wave.
    pub wave: f64,
    /// Its length, m.
    pub wavelength_m: f64,
    /// Its phase, rad.
    pub phase_rad: f64,
    /// Bias of the accelerometer, m/s².
    pub bias_mps2: [f64; 3],
}

/// Which entries are flown, and how often sensors read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// What Table 1 means.
    pub reading: Reading,
    /// Filter steps between readings.
    pub every: usize,
    /// P3's special case: this density, no other error.
    pub fixed_density: Option<f64>,
    /// With the density's wave and the accelerometer's bias.
    pub is_robust: bool,
}

impl Draw {
    /// Entries in the filters' world with so many readings a second.
    #[must_use]
    pub fn at_rate(config: &Config, reading: Reading, rate_hz: f64) -> Self {
        let every = fun::round(1.0 / (rate_hz * config.flight.step_s)) as usize;
        Self { reading, every, fixed_density: None, is_robust: false }
    }
}

/// What the sensors read at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Dynamic pressure, Pa.
    pub pressure_pa: f64,
    /// Specific force, m/s².
    pub force_mps2: [f64; 3],
    /// Distance from the orbiter, m.
    pub range_m: f64,
    /// Its rate, m/s.
    pub range_rate_mps: f64,
    /// The orbiter, known to filters.
    pub orbiter_m: [f64; 3],
    /// Its velocity.
    pub orbiter_mps: [f64; 3],
}

/// One true entry.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// State at entry and after each filter step up to the parachute's opening.
    pub states: Vec<[f64; 6]>,
    /// Readings after the steps that have them; one element fewer than `states`.
    pub sensed: Vec<Option<Sensed>>,
    /// Force felt at entry by the accelerometer with its errors: where dead reckoning starts.
    pub first_force_mps2: [f64; 3],
    /// What was wrong.
    pub disturbance: Disturbance,
}

impl Truth {
    /// The state when the parachute opens.
    #[must_use]
    pub fn last(&self) -> &[f64; 6] {
        self.states.last().unwrap_or(&[0.0; 6])
    }
}

/// The world of the truth.
struct Air<'a> {
    config: &'a Config,
    disturbance: Disturbance,
    bank_rad: f64,
}

impl Air<'_> {
    fn velocity(&self, r: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
        v - Vector3::new(0.0, 0.0, self.config.world.spin_radps).cross(r)
    }

    fn dynamic_pressure(&self, r: &Vector3<f64>, v: &Vector3<f64>) -> f64 {
        let (world, off) = (&self.config.world, &self.disturbance);
        let height = r.norm() - world.reference_radius_m;
        let mut density = (1.0 + off.density) * world.density_kgpm3 * fun::exp(-height / world.scale_height_m);
        if off.wave != 0.0 {
            let angle = core::f64::consts::TAU * height / off.wavelength_m + off.phase_rad;
            density *= 1.0 + off.wave * fun::sin(angle);
        }
        0.5 * density * self.velocity(r, v).norm_squared()
    }

    /// P3 eqs. 3–6.
    fn force(&self, r: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
        let drag = self.dynamic_pressure(r, v) / self.config.world.ballistic_kgpm2;
        let lift = self.config.world.lift_to_drag * drag;
        let forward = self.velocity(r, v).normalize();
        let left = -forward.cross(r).normalize();
        let up = forward.cross(&left);
        -drag * forward - lift * fun::sin(self.bank_rad) * left + lift * fun::cos(self.bank_rad) * up
    }

    fn rates(&self, x: &Vector6<f64>) -> Vector6<f64> {
        let (r, v) = split(x);
        let a = self.force(&r, &v) - self.config.world.mu_m3ps2 * r / cube(r.norm());
        Vector6::new(v.x, v.y, v.z, a.x, a.y, a.z)
    }

    fn stepped(&self, x: &Vector6<f64>, step_s: f64) -> Vector6<f64> {
        let k1 = self.rates(x);
        let k2 = self.rates(&(x + k1 * (0.5 * step_s)));
        let k3 = self.rates(&(x + k2 * (0.5 * step_s)));
        let k4 = self.rates(&(x + k3 * step_s));
        x + (k1 + (k2 + k3) * 2.0 + k4) * (step_s / 6.0)
    }
}

fn split(x: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (x.fixed_rows::<3>(0).into_owned(), x.fixed_rows::<3>(3).into_owned())
}

/// Position and velocity on the orbiter's circle, P3 eq. 8 in closed form.
fn orbiter(config: &Config, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
    let orbit = &config.orbiter;
    let (node, inclination) = (orbit.node_deg.to_radians(), orbit.inclination_deg.to_radians());
    let mean_motion = fun::sqrt(config.world.mu_m3ps2 / cube(orbit.radius_m));
    let u = orbit.argument_deg.to_radians() + mean_motion * time_s;
    let ascending = Vector3::new(fun::cos(node), fun::sin(node), 0.0);
    let ahead = Vector3::new(
        -fun::cos(inclination) * fun::sin(node),
        fun::cos(inclination) * fun::cos(node),
        fun::sin(inclination),
    );
    (
        orbit.radius_m * (ascending * fun::cos(u) + ahead * fun::sin(u)),
        orbit.radius_m * mean_motion * (ahead * fun::cos(u) - ascending * fun::sin(u)),
    )
}

fn disturb(config: &Config, draw: &Draw, seed: u64, run: u64) -> Disturbance {
    if let Some(density) = draw.fixed_density {
        return Disturbance { density, ..Disturbance::default() };
    }
    let mut entry = Stream::new(seed, run, "entry");
    let (place, pace) = (config.entry.deviation_m, config.entry.deviation_mps);
    let table = [place[0], place[1], place[2], pace[0], pace[1], pace[2]];
    let mut density = Stream::new(seed, run, "density");
    let width = config.density.width;
    let plain = Disturbance {
        entry: table.map(|deviation| entry.normal() * deviation / draw.reading.divisor()),
        density: match config.density.law {
            Law::Uniform => width * (2.0 * density.uniform() - 1.0),
            Law::Normal => width / 3.0 * density.normal(),
        },
        ..Disturbance::default()
    };
    if !draw.is_robust {
        return plain;
    }
    let mut wave = Stream::new(seed, run, "wave");
    Disturbance {
        wave: config.robust.wave,
        wavelength_m: config.robust.wavelength_m,
        phase_rad: core::f64::consts::TAU * wave.uniform(),
        bias_mps2: Stream::new(seed, run, "bias").normal3().map(|e| e * from_ug(config.robust.bias_ug)),
        ..plain
    }
}

/// Noise of each sensor has a stream of its own: a scenario without the radio reads the same pressures.
struct Noises {
    pressure: Stream,
    accelerometer: Stream,
    range: Stream,
    rate: Stream,
}

impl Noises {
    fn sense(&mut self, air: &Air<'_>, x: &Vector6<f64>, time_s: f64) -> Sensed {
        let (r, v) = split(x);
        let sensors = &air.config.sensors;
        let (r_b, v_b) = orbiter(air.config, time_s);
        let from = r - r_b;
        let force = self.force(air, &r, &v);
        Sensed {
            pressure_pa: air.dynamic_pressure(&r, &v) * (1.0 + sensors.pressure_share * self.pressure.normal()),
            force_mps2: force,
            range_m: from.norm() + sensors.range_m * self.range.normal(),
            range_rate_mps: from.dot(&(v - v_b)) / from.norm() + sensors.range_rate_mps * self.rate.normal(),
            orbiter_m: r_b.into(),
            orbiter_mps: v_b.into(),
        }
    }

    fn force(&mut self, air: &Air<'_>, r: &Vector3<f64>, v: &Vector3<f64>) -> [f64; 3] {
        let noise = self.accelerometer.normal3().map(|e| e * from_ug(air.config.sensors.accelerometer_ug));
        (air.force(r, v) + Vector3::from(noise) + Vector3::from(air.disturbance.bias_mps2)).into()
    }
}

/// The nominal entry state of Table 1.
#[must_use]
pub fn nominal(config: &Config) -> [f64; 6] {
    let ([x, y, z], [vx, vy, vz]) = (config.entry.position_m, config.entry.velocity_mps);
    [x, y, z, vx, vy, vz]
}

/// Flies one true entry.
#[must_use]
pub fn fly(config: &Config, draw: &Draw, seed: u64, run: u64) -> Truth {
    let disturbance = disturb(config, draw, seed, run);
    let air = Air { config, disturbance, bank_rad: config.flight.bank_deg.to_radians() };
    let stream = |purpose| Stream::new(seed, run, purpose);
    let mut noises = Noises {
        pressure: stream("pressure"),
        accelerometer: stream("accelerometer"),
        range: stream("range"),
        rate: stream("range rate"),
    };
    let mut x = Vector6::from(nominal(config)) + Vector6::from(disturbance.entry);
    let (r, v) = split(&x);
    let first_force_mps2 = noises.force(&air, &r, &v);
    let mut truth = Truth { states: vec![x.into()], sensed: Vec::new(), first_force_mps2, disturbance };
    let step_s = config.flight.step_s / f64::from(config.flight.truth_substeps);
    let most = (config.flight.longest_s / config.flight.step_s) as usize;
    for step in 1..=most {
        for _ in 0..config.flight.truth_substeps {
            x = air.stepped(&x, step_s);
        }
        let is_read = step % draw.every == 0;
        truth.states.push(x.into());
        truth.sensed.push(is_read.then(|| noises.sense(&air, &x, step as f64 * config.flight.step_s)));
        let (r, v) = split(&x);
        if air.velocity(&r, &v).norm() <= config.flight.deploy_mps {
            break;
        }
    }
    truth
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAW: Draw = Draw { reading: Reading::A, every: 1, fixed_density: None, is_robust: false };

    #[test]
    fn parachutes_open_when_and_where_the_specification_says() {
        let config = Config::default();
        let mut times_s = Vec::new();
        for density in [-0.1, 0.1] {
            let truth = fly(&config, &Draw { fixed_density: Some(density), ..DRAW }, 5, 0);
            let [x, y, z, ..] = *truth.last();
            let altitude_m = Vector3::new(x, y, z).norm() - 3_396_200.0;
            assert!((9_050.0..10_650.0).contains(&altitude_m), "{altitude_m}");
            times_s.push((truth.states.len() - 1) as f64 * 0.1);
        }
        // 358.7 to 362.3 s and 9.1 to 10.6 km (section 9), to a step and to the digits given.
        assert!((times_s[0] - 362.3).abs() < 0.15 && (times_s[1] - 358.7).abs() < 0.15, "{times_s:?}");
    }

    #[test]
    fn the_filters_model_and_the_truth_agree_though_written_apart() {
        let config = Config {
            flight: super::super::config::Flight { bank_deg: 40.0, ..Default::default() },
            ..Config::default()
        };
        let draw = Draw { fixed_density: Some(0.05), ..DRAW };
        let truth = fly(&config, &draw, 1, 0);
        let model = super::super::filters::model::<1>(&config);
        let mut x = truth.states[0];
        for expected in &truth.states[1..] {
            x = fsw_core::nav::estimators::models::Process::step(&model, &x, &[f64::ln_1p(0.05)], 0.1);
            // Steps of 0.1 s against 0.02 s: 4e-7 m after the whole flight (specification, section 2), and rounding.
            assert!(x.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5));
        }
    }

    #[test]
    fn the_orbiter_moves_as_its_velocity_says_and_is_in_sight() {
        let config = Config::default();
        let ((r0, _), (r1, _)) = (orbiter(&config, 99.9), orbiter(&config, 100.1));
        let (r, v) = orbiter(&config, 100.0);
        // Third derivative of the circle: n³ a h²/6 = 5e-6 m/s.
        assert!(((r1 - r0) / 0.2 - v).norm() < 1e-5 && (r.norm() - 3.7e6).abs() < 1e-6);
        for state in fly(&config, &DRAW, 1, 0).states.iter().step_by(100) {
            let place = Vector3::new(state[0], state[1], state[2]);
            let ahead = r - place;
            assert!(ahead.dot(&place) > 0.0);
        }
    }

    #[test]
    fn a_scenario_draws_the_same_entry_at_any_rate_and_another_in_another_run() {
        let config = Config::default();
        let (often, seldom) = (fly(&config, &DRAW, 3, 4), fly(&config, &Draw { every: 10, ..DRAW }, 3, 4));
        assert_eq!((often.states, often.disturbance), (seldom.states, seldom.disturbance));
        assert_eq!(seldom.sensed.iter().flatten().count(), seldom.sensed.len() / 10);
        assert_ne!(seldom.disturbance, fly(&config, &DRAW, 3, 5).disturbance);
    }
}
