//! A truth of its own for the navigation tests: inertial RK4 flight of a trimmed capsule along a bank profile, and an inertial
//! unit, a pressure port and a radio that look at it. Written here from the physics, not from the flight software's equations.

use fsw_core::frames::{Body, Inertial, Rot, Vec3, inertial_from_planet_relative};
use fsw_core::link::parameters::RadioSource;
use fsw_core::planet::{MARS, MARS_GAS_CONSTANT_JPKGK, MARS_HEAT_RATIO, PITOT_COEFFICIENT, PITOT_MACH_STEP};
use fsw_core::units::rad;

pub const DT_S: f64 = 0.02;
const SUBSTEPS: usize = 4;
pub const TRIM_RAD: f64 = -16.0 * core::f64::consts::PI / 180.0;
const AREA_PER_MASS: f64 = 15.9 / 2804.0;
const SCALE_HEIGHT_M: f64 = 9354.0;
const TEMPERATURE_K: f64 = 3.71 * SCALE_HEIGHT_M / MARS_GAS_CONSTANT_JPKGK;

/// Seeded normal deviates: SplitMix64 and Box–Muller.
pub struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D)
    }
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * core::f64::consts::PI * self.uniform()).cos()
    }
    pub fn vector(&mut self, sigma: f64) -> [f64; 3] {
        [sigma * self.normal(), sigma * self.normal(), sigma * self.normal()]
    }
}

/// Density error of one flight: bias, slope over 40 km, one sine wave.
#[derive(Clone, Copy, Default)]
pub struct Air {
    pub bias: f64,
    pub slope: f64,
    pub wave: f64,
    pub wave_length_m: f64,
    pub wave_phase: f64,
}

impl Air {
    pub fn density(&self, altitude_m: f64) -> f64 {
        let z = ((altitude_m - 20e3) / 40e3).clamp(-0.5, 1.5);
        let angle = if self.wave_length_m > 0.0 {
            2.0 * core::f64::consts::PI * altitude_m / self.wave_length_m + self.wave_phase
        } else {
            0.0
        };
        0.0158
            * (-altitude_m / SCALE_HEIGHT_M).exp()
            * (1.0 + self.bias)
            * (self.slope * z + self.wave * angle.sin()).exp()
    }
}

/// The vehicle on its way: position, velocity (inertial) and the integral of dynamic pressure times area over mass.
#[derive(Clone, Copy)]
pub struct Flight {
    pub time_s: f64,
    state: [f64; 7],
    pub attitude_bi: Rot<Body, Inertial>,
    air: Air,
    drag_factor: f64,
    first_bank: f64,
}

impl Flight {
    /// A flight from planet-relative entry conditions.
    pub fn new(entry: &fsw_core::frames::PlanetRelative, air: Air, drag_factor: f64, first_bank: f64) -> Self {
        let (r_p, v_p) = entry.to_cartesian();
        let (r, v) = inertial_from_planet_relative(&r_p, &v_p, fsw_core::time::MissionTime::ZERO, MARS.rotation_radps);
        let state = [r.x(), r.y(), r.z(), v.x(), v.y(), v.z(), 0.0];
        let attitude_bi = attitude(&state, bank_profile(0.0, first_bank));
        Self { time_s: 0.0, state, attitude_bi, air, drag_factor, first_bank }
    }

    pub fn r_i(&self) -> Vec3<Inertial> {
        Vec3::new(self.state[0], self.state[1], self.state[2])
    }
    pub fn v_i(&self) -> Vec3<Inertial> {
        Vec3::new(self.state[3], self.state[4], self.state[5])
    }
    pub fn altitude_m(&self) -> f64 {
        self.r_i().norm() - MARS.radius_m
    }
    pub fn speed_mps(&self) -> f64 {
        air_velocity(&self.state).norm()
    }
    pub fn density(&self) -> f64 {
        self.air.density(self.altitude_m())
    }

    /// One frame; returns exact Δv (integral in turning body axes) and Δθ (rotation vector of the frame).
    pub fn advance(&mut self) -> (Vec3<Body>, Vec3<Body>) {
        let impulse_before = self.state[6];
        let h = DT_S / SUBSTEPS as f64;
        for k in 0..SUBSTEPS {
            let t = self.time_s + k as f64 * h;
            let k1 = self.rates(t, &self.state);
            let k2 = self.rates(t + 0.5 * h, &moved(&self.state, &k1, 0.5 * h));
            let k3 = self.rates(t + 0.5 * h, &moved(&self.state, &k2, 0.5 * h));
            let k4 = self.rates(t + h, &moved(&self.state, &k3, h));
            for i in 0..7 {
                self.state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        self.time_s += DT_S;
        let before = self.attitude_bi;
        self.attitude_bi = attitude(&self.state, bank_profile(self.time_s, self.first_bank));
        let turn = self.attitude_bi.then(&before.inverse()).rotation_vector();
        (force_direction() * (self.state[6] - impulse_before), Vec3::from_components(turn))
    }

    fn rates(&self, t: f64, s: &[f64; 7]) -> [f64; 7] {
        let r = (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]).sqrt();
        let v_air = air_velocity(s);
        let pressure = 0.5 * self.air.density(r - MARS.radius_m) * v_air.dot(&v_air) * AREA_PER_MASS * self.drag_factor;
        let force = attitude(s, bank_profile(t, self.first_bank)).apply(&(force_direction() * pressure));
        let g = gravity(&[s[0], s[1], s[2]]);
        [s[3], s[4], s[5], g[0] + force.x(), g[1] + force.y(), g[2] + force.z(), pressure]
    }

    /// What the port at the stagnation point feels, Pa.
    pub fn stagnation_pa(&self) -> f64 {
        let (density, speed) = (self.density(), self.speed_mps());
        let mach = speed / (MARS_HEAT_RATIO * MARS_GAS_CONSTANT_JPKGK * TEMPERATURE_K).sqrt();
        let position = (mach / PITOT_MACH_STEP).min(20.0);
        let node = (position as usize).min(19);
        let coefficient = PITOT_COEFFICIENT[node]
            + (position - node as f64) * (PITOT_COEFFICIENT[node + 1] - PITOT_COEFFICIENT[node]);
        density * (MARS_GAS_CONSTANT_JPKGK * TEMPERATURE_K + 0.5 * coefficient * speed * speed)
    }

    pub fn dynamic_pressure_pa(&self) -> f64 {
        0.5 * self.density() * self.speed_mps() * self.speed_mps()
    }
}

fn moved(s: &[f64; 7], k: &[f64; 7], h: f64) -> [f64; 7] {
    core::array::from_fn(|i| s[i] + h * k[i])
}

fn air_velocity(s: &[f64; 7]) -> Vec3<Inertial> {
    let w = MARS.rotation_radps;
    Vec3::new(s[3] + w * s[1], s[4] - w * s[0], s[5])
}

/// Force per unit of q·S/m in body axes at the trim angle: drag 1.45 against, lift 0.24 of it.
fn force_direction() -> Vec3<Body> {
    let (s, c) = TRIM_RAD.sin_cos();
    let (drag, lift) = (1.45, 0.24 * 1.45);
    Vec3::new(-drag * c + lift * s, 0.0, -drag * s - lift * c)
}

fn attitude(s: &[f64; 7], bank: f64) -> Rot<Body, Inertial> {
    let forward = air_velocity(s).unit().unwrap();
    let r = Vec3::<Inertial>::new(s[0], s[1], s[2]);
    let up = (r - forward * forward.dot(&r)).unit().unwrap();
    let right = forward.cross(&up);
    let lift = up * bank.cos() + right * bank.sin();
    let (sin, cos) = TRIM_RAD.sin_cos();
    let x = forward * cos + lift * sin;
    let z = forward * sin - lift * cos;
    Rot::from_columns(&x, &z.cross(&x), &z).unwrap()
}

/// Potential differentiated by hand: −μ/r³·r and the J2 terms.
pub fn gravity(r: &[f64; 3]) -> [f64; 3] {
    let r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    let mu_r3 = MARS.mu_m3ps2 / (r2 * r2.sqrt());
    let k = 1.5 * MARS.j2 * MARS.radius_m * MARS.radius_m / r2;
    let zz = 5.0 * r[2] * r[2] / r2;
    [
        -mu_r3 * r[0] * (1.0 + k * (1.0 - zz)),
        -mu_r3 * r[1] * (1.0 + k * (1.0 - zz)),
        -mu_r3 * r[2] * (1.0 + k * (3.0 - zz)),
    ]
}

/// Bank: reversals through lift-up, each rest to rest at 5°/s² and at most 20°/s.
fn bank_profile(t: f64, first: f64) -> f64 {
    const TURNS: [(f64, f64); 4] = [(70.0, -1.0), (115.0, 1.0), (165.0, -1.0), (215.0, 1.0)];
    let mut bank = first;
    for (start, side) in TURNS {
        let target = side * first;
        bank += (target - bank) * share(t - start, (target - bank).abs());
    }
    bank
}

/// Share of a rest-to-rest turn by `angle` done after a time.
fn share(t: f64, angle: f64) -> f64 {
    let (rate, accel) = (rad(20.0), rad(5.0));
    if t <= 0.0 || angle <= 0.0 {
        return 0.0;
    }
    let ramp = (rate / accel).min((angle / accel).sqrt());
    let top = accel * ramp;
    let length = angle / top + ramp;
    let left = length - t;
    let done = if left <= 0.0 {
        angle
    } else if t < ramp {
        0.5 * accel * t * t
    } else if left < ramp {
        angle - 0.5 * accel * left * left
    } else {
        0.5 * top * ramp + top * (t - ramp)
    };
    done / angle
}

/// The default orbiter: a 3700 km, circular, i 80.4°, node 96.8°, argument of latitude −145.9°.
pub fn orbiter() -> RadioSource {
    let (a, i, node, u) = (3.7e6, rad(80.4), rad(96.8), rad(-145.9));
    let speed = (MARS.mu_m3ps2 / a).sqrt();
    let along = |u: f64| {
        let (x, y) = (u.cos(), u.sin());
        [node.cos() * x - node.sin() * y * i.cos(), node.sin() * x + node.cos() * y * i.cos(), y * i.sin()]
    };
    RadioSource::Orbiter {
        position_m: along(u).map(|c| a * c),
        velocity_mps: along(u + 0.5 * core::f64::consts::PI).map(|c| speed * c),
    }
}

/// A beacon 25 km north of P4's target.
pub fn beacon() -> RadioSource {
    RadioSource::Beacon { longitude_rad: rad(-73.26), latitude_rad: rad(-41.028), altitude_m: 0.0 }
}

/// Elevation of the higher of two points over the horizon of the lower, rad.
pub fn elevation(a: &Vec3<Inertial>, b: &Vec3<Inertial>) -> f64 {
    let (low, high) = if a.norm() < b.norm() { (a, b) } else { (b, a) };
    let sight = *high - *low;
    (sight.dot(low) / (sight.norm() * low.norm())).asin()
}
