//! A simple truth for guidance alone: the flight equations in perturbed air, an actuator with lag, perfect navigation.
//! The independent truth of the whole system is `hil-sim`; this one only has to be quick.

use fsw_core::control::BankDemand;
use fsw_core::frames::{Body, PlanetRelative, Vec3, great_circle_rad, surface_point};
use fsw_core::math::rk4;
use fsw_core::model::OnboardModel;
use fsw_core::model::entry::{Constants, Environment, cartesian_rates};
use fsw_core::nav::Estimate;
use fsw_core::planet::Planet;
use fsw_core::time::MissionTime;
use fsw_core::units::rad;

/// Minor frame, s.
pub const FRAME_S: f64 = 0.02;

/// What differs between the true world and the onboard model. Density after guidance.md §5:
/// ρ = ρ_nom (1 + b) exp(s z + a sin(2π h/l + p)), z = clamp((h − 20 km)/40 km, −0.5, 1.5).
#[derive(Clone, Copy, Debug, Default)]
pub struct Dispersion {
    pub density_bias: f64,
    pub density_slope: f64,
    pub wave_amplitude: f64,
    pub wave_length_m: f64,
    pub wave_phase: f64,
    pub drag: f64,
    pub lift: f64,
    pub mass: f64,
    pub flight_path_angle: f64,
    pub speed: f64,
    pub heading: f64,
    pub along: f64,
    pub cross: f64,
    pub altitude: f64,
}

/// SplitMix64 with a Box–Muller transform: a test needs no more.
pub struct Draw(pub u64);

impl Draw {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Normal deviate of the given three-sigma value.
    pub fn normal(&mut self, three_sigma: f64) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        three_sigma / 3.0 * (-2.0 * u.ln()).sqrt() * (2.0 * core::f64::consts::PI * v).cos()
    }
}

impl Dispersion {
    /// The base set of guidance.md §5.
    pub fn draw(seed: u64) -> Self {
        let d = &mut Draw(seed.wrapping_mul(0x1234_5678_9abc_def1));
        Self {
            density_bias: d.normal(0.20),
            density_slope: d.normal(0.10),
            wave_amplitude: d.normal(0.06),
            wave_length_m: 10e3 + 20e3 * d.uniform(),
            wave_phase: 2.0 * core::f64::consts::PI * d.uniform(),
            drag: d.normal(0.05),
            lift: d.normal(0.08),
            mass: d.normal(0.005),
            flight_path_angle: rad(d.normal(0.15)),
            speed: d.normal(10.0),
            heading: rad(d.normal(0.1)),
            along: d.normal(6e3),
            cross: d.normal(3e3),
            altitude: d.normal(2e3),
        }
    }
}

/// The true environment: the onboard model, perturbed.
pub struct Air<'a> {
    pub model: &'a OnboardModel,
    pub with: Dispersion,
}

impl Air<'_> {
    /// Natural logarithm of the true density over that of the onboard model.
    pub fn log_ratio(&self, altitude_m: f64) -> f64 {
        let w = &self.with;
        let z = ((altitude_m - 20e3) / 40e3).clamp(-0.5, 1.5);
        let wave = if w.wave_length_m > 0.0 {
            w.wave_amplitude * (2.0 * core::f64::consts::PI * altitude_m / w.wave_length_m + w.wave_phase).sin()
        } else {
            0.0
        };
        (1.0 + w.density_bias).ln() + w.density_slope * z + wave
    }
}

impl Environment<f64> for Air<'_> {
    fn planet(&self) -> &Planet {
        &self.model.planet
    }
    fn density_kgpm3(&self, altitude_m: f64) -> f64 {
        self.model.atmosphere.density(altitude_m) * self.log_ratio(altitude_m).exp()
    }
    fn drag_and_lift_coefficients(&self, altitude_m: f64, speed_mps: f64) -> (f64, f64) {
        let (drag, lift) = self.model.drag_and_lift_coefficients(altitude_m, speed_mps);
        // A heavier vehicle is one with smaller coefficients.
        let per_mass = 1.0 / (1.0 + self.with.mass);
        (drag * (1.0 + self.with.drag) * per_mass, lift * (1.0 + self.with.lift) * per_mass)
    }
    fn constants(&self) -> &Constants {
        self.model.constants()
    }
}

/// P4's entry, dispersed.
pub fn entry(planet: &Planet, with: &Dispersion) -> PlanetRelative {
    let nominal = PlanetRelative {
        radius_m: planet.radius_m + 125.3e3 + with.altitude,
        longitude_rad: rad(-90.072),
        latitude_rad: rad(-43.898),
        speed_mps: 5505.0 + with.speed,
        flight_path_angle_rad: rad(-14.15) + with.flight_path_angle,
        heading_rad: rad(85.01) + with.heading,
    };
    // Moves along and across the heading, small against the radius.
    let (sin, cos) = nominal.heading_rad.sin_cos();
    let (north, east) = (with.along * cos - with.cross * sin, with.along * sin + with.cross * cos);
    PlanetRelative {
        latitude_rad: nominal.latitude_rad + north / planet.radius_m,
        longitude_rad: nominal.longitude_rad + east / (planet.radius_m * nominal.latitude_rad.cos()),
        ..nominal
    }
}

/// The true vehicle.
pub struct Vehicle {
    pub state: [f64; 6],
    pub bank: f64,
    pub rate: f64,
    pub accel: f64,
    pub lag_s: f64,
    pub frame: u32,
}

impl Vehicle {
    pub fn new(entry: &PlanetRelative, bank: f64, lag_s: f64) -> Self {
        let (r, v) = entry.to_cartesian();
        let ([x, y, z], [vx, vy, vz]) = (r.to_array(), v.to_array());
        Self { state: [x, y, z, vx, vy, vz], bank, rate: 0.0, accel: 0.0, lag_s, frame: 0 }
    }

    /// One minor frame: the actuator answers the demanded acceleration with its lag.
    pub fn advance(&mut self, air: &Air<'_>, demand: &BankDemand) {
        let share = if self.lag_s > 0.0 { 1.0 - (-FRAME_S / self.lag_s).exp() } else { 1.0 };
        self.accel += (demand.accel_radps2 - self.accel) * share;
        let (bank, rate, accel) = (self.bank, self.rate, self.accel);
        self.state = rk4(&self.state, FRAME_S, |t, s| {
            let b = bank + (rate + 0.5 * accel * t) * t;
            cartesian_rates(air, s, b.cos(), b.sin())
        });
        self.bank += (rate + 0.5 * accel * FRAME_S) * FRAME_S;
        self.rate += accel * FRAME_S;
        self.frame += 1;
    }

    pub fn speed(&self) -> f64 {
        self.state[3..].iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    pub fn altitude(&self, planet: &Planet) -> f64 {
        self.state[..3].iter().map(|x| x * x).sum::<f64>().sqrt() - planet.radius_m
    }

    /// Sensed load, m/s².
    pub fn load(&self, air: &Air<'_>) -> f64 {
        let (h, v) = (self.altitude(&air.model.planet), self.speed());
        let (drag, lift) = air.drag_and_lift_coefficients(h, v);
        air.density_kgpm3(h) * v * v * air.constants().half_area_per_mass_m2pkg * (drag * drag + lift * lift).sqrt()
    }

    /// The force that the inertial unit feels, at the trim angle of attack, m/s².
    pub fn force_b(&self, air: &Air<'_>) -> Vec3<Body> {
        let (h, v) = (self.altitude(&air.model.planet), self.speed());
        let (drag, lift) = air.drag_and_lift_coefficients(h, v);
        let per_coefficient = air.density_kgpm3(h) * v * v * air.constants().half_area_per_mass_m2pkg;
        let (sine, cosine) = air.model.vehicle.trim_angle_of_attack_rad.sin_cos();
        let (forward, up) = (Vec3::<Body>::new(cosine, 0.0, sine), Vec3::<Body>::new(sine, 0.0, -cosine));
        up * (per_coefficient * lift) - forward * (per_coefficient * drag)
    }

    /// Great-circle distance to a point at the reference radius, m.
    pub fn miss_m(&self, planet: &Planet, longitude_rad: f64, latitude_rad: f64) -> f64 {
        let here = Vec3::new(self.state[0], self.state[1], self.state[2]);
        great_circle_rad(&here, &surface_point(longitude_rad, latitude_rad)) * planet.radius_m
    }

    /// The state as a perfect navigator knows it.
    pub fn estimate(&self, planet: &Planet) -> Estimate {
        let [x, y, z, vx, vy, vz] = self.state;
        Estimate {
            time: MissionTime::of_frame(self.frame),
            r_p: Vec3::new(x, y, z),
            v_p: Vec3::new(vx, vy, vz),
            altitude_m: self.altitude(planet),
            speed_mps: self.speed(),
            bank_rad: self.bank,
            bank_rate_radps: self.rate,
            valid: true,
            ..Estimate::default()
        }
    }
}
