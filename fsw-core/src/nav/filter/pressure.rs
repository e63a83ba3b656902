//! Stagnation pressure: a measure of density, through it weakly of altitude.

use super::Learned;
use super::measurement::{Observation, Sensitivity};
use crate::frames::{Inertial, Vec3};
use crate::link::packet::MeasurementKind;
use crate::link::parameters::NavigationParameters;
use crate::math::fun::{exp, floor};
use crate::math::num::{clamp, max};
use crate::model::OnboardModel;
use crate::nav::strapdown::Nominal;
use crate::planet::{PITOT_COEFFICIENT, PITOT_MACH_STEP};
use crate::time::MissionTime;

/// Smallest white noise of a reading, Pa: no transducer is exact in a vacuum, and no variance may vanish.
const RESOLUTION_PA: f64 = 0.01;

/// Forms the observation of a stagnation pressure (Pa) against the nominal state and what was learned of air and sensor.
///
/// p_t = ρ (R T + ½ C_p(M) V²) with ρ = ρ_model(h)·exp(x), read as (1 + s) p_t + o. Derivatives: p_t with respect to x; p_t·d(ln ρ_model)/dh along the
/// vertical (temperature taken as constant over an altitude error); ρ(C_p + ½ M dC_p/dM)·v_rel with respect to velocity.
/// Air at rest relative to the planet. Valid above the smallest estimated dynamic pressure of the parameters.
#[must_use]
pub fn observe(
    time: MissionTime,
    measured_pa: f64,
    nominal: &Nominal,
    learned: &Learned,
    model: &OnboardModel,
    parameters: &NavigationParameters,
) -> Observation {
    let planet = &model.planet;
    let radius = nominal.r_i.norm();
    let altitude = radius - planet.radius_m;
    let v_rel = nominal.v_i - Vec3::<Inertial>::new(0.0, 0.0, planet.rotation_radps).cross(&nominal.r_i);
    let speed = v_rel.norm();
    let density = model.atmosphere.density(altitude) * exp(learned.log_density);
    let Pitot { gas_constant_jpkgk, temperature_k, coefficient, mach, slope } = Pitot::at(model, altitude, speed);
    let dynamic = 0.5 * density * speed * speed;
    let read = 1.0 + learned.pressure_scale;
    let stagnation = density * gas_constant_jpkgk * temperature_k + coefficient * dynamic;
    let predicted = read * stagnation + learned.pressure_offset_pa;

    let vertical = read * stagnation * model.atmosphere.log_density_slope_pm(altitude) / radius;
    let along = read * density * (coefficient + 0.5 * mach * slope);
    let noise = max(parameters.pressure_noise * stagnation, RESOLUTION_PA);
    Observation {
        time,
        kind: MeasurementKind::Pressure,
        source: 0,
        innovation: measured_pa - predicted,
        noise_variance: noise * noise,
        sensitivity: Sensitivity {
            position: (nominal.r_i * vertical).to_array(),
            velocity: (v_rel * along).to_array(),
            log_density: read * stagnation,
            pressure_scale: stagnation,
            pressure_offset: 1.0,
        },
        valid: dynamic >= parameters.pressure_min_dynamic_pa,
    }
}

/// What turns density and speed into stagnation pressure: p_t = ρ (R T + ½ C_p V²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pitot {
    gas_constant_jpkgk: f64,
    temperature_k: f64,
    /// C_p,max at this Mach number.
    pub coefficient: f64,
    mach: f64,
    slope: f64,
}

impl Pitot {
    /// At an altitude (m) and air-relative speed (m/s) in the onboard model.
    #[must_use]
    pub fn at(model: &OnboardModel, altitude_m: f64, speed_mps: f64) -> Self {
        let mach = speed_mps / model.atmosphere.speed_of_sound_mps(altitude_m);
        let (coefficient, slope) = pitot_coefficient(mach);
        Self {
            gas_constant_jpkgk: model.atmosphere.gas_constant_jpkgk(),
            temperature_k: model.atmosphere.temperature_k(altitude_m),
            coefficient,
            mach,
            slope,
        }
    }

    /// R T, m²/s².
    #[must_use]
    pub fn static_square(&self) -> f64 {
        self.gas_constant_jpkgk * self.temperature_k
    }
}

/// C_p,max beyond the table.
const PITOT_HYPERSONIC: f64 = match PITOT_COEFFICIENT {
    [.., last] => last,
};

/// C_p,max and its derivative at a Mach number: linear in [`PITOT_COEFFICIENT`], constant above its end.
fn pitot_coefficient(mach: f64) -> (f64, f64) {
    let last = PITOT_COEFFICIENT.len() - 1;
    let x = clamp(mach / PITOT_MACH_STEP, 0.0, last as f64);
    let whole = floor(x);
    let (low, high) = match PITOT_COEFFICIENT.get(whole as u8 as usize..) {
        Some([low, high, ..]) => (*low, *high),
        _ => (PITOT_HYPERSONIC, PITOT_HYPERSONIC),
    };
    (low + (x - whole) * (high - low), (high - low) / PITOT_MACH_STEP)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    const MEASURED_PA: f64 = 20_000.0;

    fn flying(speed_mps: f64, altitude_m: f64) -> Nominal {
        let up = Vec3::<Inertial>::new(0.6, 0.0, 0.8);
        let along = Vec3::new(-0.48, 0.8, 0.36);
        let r_i = up * (crate::planet::MARS.radius_m + altitude_m);
        let spin = Vec3::new(0.0, 0.0, crate::planet::MARS.rotation_radps);
        Nominal { r_i, v_i: along * speed_mps + spin.cross(&r_i), ..Nominal::default() }
    }

    fn observed(nominal: &Nominal, log_density: f64) -> Observation {
        observed_by(
            nominal,
            &Learned { log_density, pressure_scale: -0.03, pressure_offset_pa: 20.0, ..Learned::NOTHING },
        )
    }

    fn observed_by(nominal: &Nominal, learned: &Learned) -> Observation {
        let c = Config::DEFAULT;
        let model = OnboardModel::new(c.planet, &c.vehicle, &[], &c.atmosphere, &[]).unwrap();
        observe(MissionTime::ZERO, MEASURED_PA, nominal, learned, &model, &c.navigation)
    }

    #[test]
    fn sensitivities_are_the_derivatives_of_the_prediction() {
        for (speed, altitude) in [(4000.0, 40e3), (700.0, 12e3), (300.0, 8e3)] {
            let nominal = flying(speed, altitude);
            let h = observed(&nominal, 0.05).sensitivity;
            let predicted = |n: &Nominal, x: f64| MEASURED_PA - observed(n, x).innovation;
            let p = predicted(&nominal, 0.05);
            for k in 0..3 {
                let mut step = [0.0; 3];
                step[k] = 1.0;
                let step = Vec3::from_array(step);
                let moved = |s: f64| Nominal { r_i: nominal.r_i + step * s, ..nominal };
                let faster = |s: f64| Nominal { v_i: nominal.v_i + step * (0.1 * s), ..nominal };
                let by_position = (predicted(&moved(1.0), 0.05) - predicted(&moved(-1.0), 0.05)) / 2.0;
                let by_velocity = (predicted(&faster(1.0), 0.05) - predicted(&faster(-1.0), 0.05)) / 0.2;
                // Left out of the position part: the planet's rotation in the velocity, some 1e-7 of p per metre at 500 m/s.
                assert!((h.position[k] - by_position).abs() < 1e-6 * p, "{speed}: {} {by_position}", h.position[k]);
                assert!((h.velocity[k] - by_velocity).abs() < 1e-6 * p, "{speed}: {} {by_velocity}", h.velocity[k]);
            }
            let by_density = (predicted(&nominal, 0.051) - predicted(&nominal, 0.049)) / 0.002;
            assert!((h.log_density - by_density).abs() < 1e-6 * p);
            let read = |pressure_scale: f64, pressure_offset_pa: f64| {
                let learned = Learned { log_density: 0.05, pressure_scale, pressure_offset_pa, ..Learned::NOTHING };
                MEASURED_PA - observed_by(&nominal, &learned).innovation
            };
            let by_scale = (read(-0.02, 20.0) - read(-0.04, 20.0)) / 0.02;
            assert!((h.pressure_scale - by_scale).abs() < 1e-6 * p);
            assert!((h.pressure_offset - (read(-0.03, 21.0) - read(-0.03, 20.0))).abs() < 1e-6);
        }
    }

    #[test]
    fn the_coefficient_is_the_table_and_constant_above_it() {
        assert_eq!(pitot_coefficient(0.0).0, 1.0049);
        assert!((pitot_coefficient(2.125).0 - 0.5 * (1.6890 + 1.7276)).abs() < 1e-12);
        for mach in [5.0, 30.0, f64::INFINITY] {
            assert_eq!(pitot_coefficient(mach), (1.85, 0.0), "{mach}");
        }
        assert_eq!(pitot_coefficient(f64::NAN).0, 1.0049);
    }

    #[test]
    fn thin_air_is_out_of_validity() {
        assert!(observed(&flying(4000.0, 40e3), 0.0).valid);
        assert!(!observed(&flying(4000.0, 90e3), 0.0).valid);
    }
}
