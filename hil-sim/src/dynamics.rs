//! Motion of the vehicle: Cartesian inertial equations about a rotating, oblate planet, in moving air.
//!
//! r̈ = g(r) − (D/m) v̂ + (L/m)(up cos σ + right sin σ), v the velocity relative to the air. The planet's rotation acts
//! through the air alone; inertial z is the spin axis.

use fsw_core::frames::{Inertial, PlanetFixed, PlanetRelative, Rot, Vec3};
use fsw_core::planet::{Planet, STANDARD_GRAVITY_MPS2, SUTTON_GRAVES_MARS};

use crate::aero::Vehicle;
use crate::atmosphere::Atmosphere;
use crate::attitude::{FlowAxes, Turn};
use crate::wind::Wind;

/// Everything that acts on the vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Planet.
    pub planet: Planet,
    /// Air.
    pub atmosphere: Atmosphere,
    /// Winds.
    pub wind: Wind,
    /// Vehicle.
    pub vehicle: Vehicle,
}

/// Position, velocity and what an ideal accelerometer has summed up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Inertial position, m.
    pub r_i: Vec3<Inertial>,
    /// Inertial velocity, m/s.
    pub v_i: Vec3<Inertial>,
    /// ∫ D/m dt, m/s.
    pub drag_sum_mps: f64,
    /// ∫ L/m dt, m/s.
    pub lift_sum_mps: f64,
}

/// The flow at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Altitude over the reference sphere, m.
    pub altitude_m: f64,
    /// Velocity relative to the air, inertial axes, m/s.
    pub v_air_i: Vec3<Inertial>,
    /// Density, kg/m³.
    pub density_kgpm3: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
    /// Drag acceleration, m/s².
    pub drag_mps2: f64,
    /// Lift acceleration, m/s².
    pub lift_mps2: f64,
}

#[derive(Clone, Copy)]
struct Rates {
    v: Vec3<Inertial>,
    a: Vec3<Inertial>,
    drag: f64,
    lift: f64,
}

impl Motion {
    /// Motion at a planet-relative state at t = 0.
    #[must_use]
    pub fn at_epoch(state: &PlanetRelative, planet: &Planet) -> Self {
        let (r_p, v_p) = state.to_cartesian();
        let spin = Vec3::<PlanetFixed>::new(0.0, 0.0, planet.rotation_radps);
        let v_i = v_p + spin.cross(&r_p);
        Self::new(Vec3::from_components(*r_p.components()), Vec3::from_components(*v_i.components()))
    }

    /// Motion from inertial position and velocity.
    #[must_use]
    pub fn new(r_i: Vec3<Inertial>, v_i: Vec3<Inertial>) -> Self {
        Self { r_i, v_i, drag_sum_mps: 0.0, lift_sum_mps: 0.0 }
    }

    /// Planet-relative spherical state at a time after the epoch.
    #[must_use]
    pub fn planet_relative(&self, t_s: f64, planet: &Planet) -> PlanetRelative {
        let to_fixed = Rot::<Inertial, PlanetFixed>::about_z(planet.rotation_radps * t_s);
        let v_i = self.v_i - surface_velocity(&self.r_i, planet);
        PlanetRelative::from_cartesian(&to_fixed.apply(&self.r_i), &to_fixed.apply(&v_i))
    }

    fn moved(&self, rates: &Rates, h: f64) -> Self {
        Self {
            r_i: self.r_i + rates.v * h,
            v_i: self.v_i + rates.a * h,
            drag_sum_mps: self.drag_sum_mps + rates.drag * h,
            lift_sum_mps: self.lift_sum_mps + rates.lift * h,
        }
    }
}

/// Velocity of the ground turning with the planet, inertial axes.
#[must_use]
pub fn surface_velocity(r_i: &Vec3<Inertial>, planet: &Planet) -> Vec3<Inertial> {
    Vec3::new(-planet.rotation_radps * r_i.y(), planet.rotation_radps * r_i.x(), 0.0)
}

/// Gravitational acceleration: central term and second zonal harmonic, inertial axes.
/// Source: Vallado, Fundamentals of Astrodynamics and Applications, Cartesian form of the J2 acceleration.
#[must_use]
pub fn gravity(r_i: &Vec3<Inertial>, planet: &Planet) -> Vec3<Inertial> {
    let r2 = r_i.dot(r_i);
    let mu_over_r3 = planet.mu_m3ps2 / (r2 * r2.sqrt());
    let k = 1.5 * planet.j2 * planet.radius_m * planet.radius_m / r2;
    let polar = 5.0 * r_i.z() * r_i.z() / r2;
    let (equatorial, axial) = (1.0 + k * (1.0 - polar), 1.0 + k * (3.0 - polar));
    Vec3::new(r_i.x() * equatorial, r_i.y() * equatorial, r_i.z() * axial) * -mu_over_r3
}

impl World {
    /// The flow about the vehicle.
    #[must_use]
    pub fn flow(&self, r_i: &Vec3<Inertial>, v_i: &Vec3<Inertial>) -> Flow {
        let altitude_m = r_i.norm() - self.planet.radius_m;
        let v_air_i = *v_i - self.air_velocity(r_i, altitude_m);
        let density_kgpm3 = self.atmosphere.density_kgpm3(altitude_m);
        let speed2 = v_air_i.dot(&v_air_i);
        let dynamic_pressure_pa = 0.5 * density_kgpm3 * speed2;
        let mach = || speed2.sqrt() / self.atmosphere.speed_of_sound_mps(altitude_m);
        let (drag, lift) = self.vehicle.acceleration_per_pressure(mach);
        Flow {
            altitude_m,
            v_air_i,
            density_kgpm3,
            dynamic_pressure_pa,
            drag_mps2: drag * dynamic_pressure_pa,
            lift_mps2: lift * dynamic_pressure_pa,
        }
    }

    /// Velocity of the air: it turns with the planet, and the wind blows on top of that.
    fn air_velocity(&self, r_i: &Vec3<Inertial>, altitude_m: f64) -> Vec3<Inertial> {
        let turning = surface_velocity(r_i, &self.planet);
        if self.wind.is_still() {
            return turning;
        }
        let (east_mps, north_mps) = self.wind.at(altitude_m);
        let east_raw = Vec3::<Inertial>::new(-r_i.y(), r_i.x(), 0.0);
        match (east_raw.unit(), r_i.unit()) {
            (Some(east), Some(up)) => turning + east * east_mps + up.cross(&east) * north_mps,
            _ => turning,
        }
    }

    fn rates(&self, motion: &Motion, turn: &Turn) -> Rates {
        let flow = self.flow(&motion.r_i, &motion.v_i);
        let axes = FlowAxes::new(&motion.r_i, &flow.v_air_i);
        self.rates_in(motion, &flow, &axes, turn)
    }

    fn rates_in(&self, motion: &Motion, flow: &Flow, axes: &FlowAxes, turn: &Turn) -> Rates {
        let force = axes.lift_at(turn) * flow.lift_mps2 - axes.forward * flow.drag_mps2;
        Rates {
            v: motion.v_i,
            a: gravity(&motion.r_i, &self.planet) + force,
            drag: flow.drag_mps2,
            lift: flow.lift_mps2,
        }
    }

    /// One step of the classical fourth-order Runge–Kutta rule. `bank_rad` gives the bank at a time after the step's start.
    #[must_use]
    pub fn step(&self, motion: &Motion, h_s: f64, bank_rad: impl Fn(f64) -> f64) -> Motion {
        let flow = self.flow(&motion.r_i, &motion.v_i);
        let axes = FlowAxes::new(&motion.r_i, &flow.v_air_i);
        let turns = [0.0, 0.5 * h_s, h_s].map(|t| Turn::new(bank_rad(t)));
        self.step_from(motion, (&flow, &axes), h_s, &turns)
    }

    /// The same where the flow at the start is known, and the bank at the start, the middle and the end of the step.
    #[must_use]
    pub fn step_from(&self, motion: &Motion, here: (&Flow, &FlowAxes), h_s: f64, turns: &[Turn; 3]) -> Motion {
        let [start, middle, end] = turns;
        let k1 = self.rates_in(motion, here.0, here.1, start);
        let k2 = self.rates(&motion.moved(&k1, 0.5 * h_s), middle);
        let k3 = self.rates(&motion.moved(&k2, 0.5 * h_s), middle);
        let k4 = self.rates(&motion.moved(&k3, h_s), end);
        let mean = Rates {
            v: (k1.v + (k2.v + k3.v) * 2.0 + k4.v) * (1.0 / 6.0),
            a: (k1.a + (k2.a + k3.a) * 2.0 + k4.a) * (1.0 / 6.0),
            drag: (k1.drag + 2.0 * (k2.drag + k3.drag) + k4.drag) / 6.0,
            lift: (k1.lift + 2.0 * (k2.lift + k3.lift) + k4.lift) / 6.0,
        };
        motion.moved(&mean, h_s)
    }

    /// Sensed load, in standard gravities.
    #[must_use]
    pub fn load_g(&self, flow: &Flow) -> f64 {
        (flow.drag_mps2 * flow.drag_mps2 + flow.lift_mps2 * flow.lift_mps2).sqrt() / STANDARD_GRAVITY_MPS2
    }

    /// Convective heat flux at the stagnation point, W/m²: Sutton–Graves with the air-relative speed.
    #[must_use]
    pub fn heat_flux_wpm2(&self, flow: &Flow) -> f64 {
        let speed = flow.v_air_i.norm();
        SUTTON_GRAVES_MARS * (flow.density_kgpm3 / self.vehicle.nose_radius_m).sqrt() * speed * speed * speed
    }

    /// Air-relative Mach number.
    #[must_use]
    pub fn mach(&self, flow: &Flow) -> f64 {
        flow.v_air_i.norm() / self.atmosphere.speed_of_sound_mps(flow.altitude_m)
    }
}

#[cfg(test)]
mod tests;
