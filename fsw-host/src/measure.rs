//! Figures derived from true states and telemetry: the planet-relative truth, loads, consistency of the navigation.

use fsw_core::frames::{
    Inertial, PlanetFixed, PlanetRelative, Vec3, along_and_across_rad, great_circle_rad, planet_relative_from_inertial,
    surface_point,
};
use fsw_core::link::packet::{COVARIANCE_ELEMENTS, NavTlm, Truth};
use fsw_core::planet::{Planet, STANDARD_GRAVITY_MPS2, SUTTON_GRAVES_MARS};
use fsw_core::time::MissionTime;

use crate::record::{NeesSample, ScenarioFacts, TruthSample};

/// Error components judged together: inertial position and velocity.
pub const STATES: usize = 6;
/// Two-sided 95 % band of the chi-square distribution with 6 degrees of freedom: its 2.5 % and 97.5 % quantiles.
pub const NEES_BAND_95: [f64; 2] = [1.237_344, 14.449_375];

/// The true state at `time` with everything that follows from it; `before` is the sample of the frame before.
#[must_use]
pub fn truth_sample(
    facts: &ScenarioFacts,
    time: MissionTime,
    packet: &Truth,
    before: Option<&TruthSample>,
) -> TruthSample {
    let r_i = Vec3::<Inertial>::from_array(packet.position_m);
    let v_i = Vec3::<Inertial>::from_array(packet.velocity_mps);
    let (r_p, v_p) = planet_relative_from_inertial(&r_i, &v_i, time, facts.planet.rotation_radps);
    let state = PlanetRelative::from_cartesian(&r_p, &v_p);
    // Divided, not multiplied: 140000 µs then prints as 0.14.
    let time_s = f64::from(time.0) / 1e6;
    TruthSample {
        time_s,
        packet: *packet,
        longitude_rad: state.longitude_rad,
        latitude_rad: state.latitude_rad,
        altitude_m: state.radius_m - facts.planet.radius_m,
        speed_mps: state.speed_mps,
        flight_path_angle_rad: state.flight_path_angle_rad,
        heading_rad: state.heading_rad,
        load_g: before.map_or(0.0, |before| mean_load_g(&facts.planet, before, time_s, packet)),
        heat_flux_wpm2: heat_flux_wpm2(facts.nose_radius_m, packet),
        range_to_go_m: facts.planet.radius_m * great_circle_rad(&r_p, &facts.target_p()),
    }
}

/// Mean sensed load between two true states, g: change of inertial velocity less gravity (trapezoid), over the time.
/// The trapezoid errs by 1e-9 g over a frame of 20 ms.
fn mean_load_g(planet: &Planet, before: &TruthSample, time_s: f64, packet: &Truth) -> f64 {
    let dt_s = time_s - before.time_s;
    if dt_s <= 0.0 {
        return before.load_g;
    }
    let (g0, g1) = (gravity_mps2(planet, &before.packet.position_m), gravity_mps2(planet, &packet.position_m));
    let mut squared = 0.0;
    for axis in 0..3 {
        let acceleration = (packet.velocity_mps[axis] - before.packet.velocity_mps[axis]) / dt_s;
        let force = acceleration - 0.5 * (g0[axis] + g1[axis]);
        squared += force * force;
    }
    libm::sqrt(squared) / STANDARD_GRAVITY_MPS2
}

/// Central gravity with J2, inertial axes (z the spin axis), m/s².
fn gravity_mps2(planet: &Planet, r: &[f64; 3]) -> [f64; 3] {
    let r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    let central = -planet.mu_m3ps2 / (r2 * libm::sqrt(r2));
    let k = 1.5 * planet.j2 * planet.radius_m * planet.radius_m / r2;
    let z2 = 5.0 * r[2] * r[2] / r2;
    [
        central * r[0] * (1.0 + k * (1.0 - z2)),
        central * r[1] * (1.0 + k * (1.0 - z2)),
        central * r[2] * (1.0 + k * (3.0 - z2)),
    ]
}

/// Sutton–Graves heat flux, W/m², with the air-relative speed that density and dynamic pressure imply.
fn heat_flux_wpm2(nose_radius_m: f64, packet: &Truth) -> f64 {
    let density = packet.density_kgpm3;
    if density <= 0.0 || nose_radius_m <= 0.0 {
        return 0.0;
    }
    let speed_mps = libm::sqrt(2.0 * packet.dynamic_pressure_pa / density);
    SUTTON_GRAVES_MARS * libm::sqrt(density / nose_radius_m) * speed_mps * speed_mps * speed_mps
}

/// Great-circle distance, downrange and crossrange of a point against the target, m; see [`ScenarioFacts`] for the arc.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Miss {
    /// Distance at the reference radius.
    pub miss_m: f64,
    /// Along the arc, positive beyond the target.
    pub downrange_m: f64,
    /// Across the arc, positive to its right.
    pub crossrange_m: f64,
}

/// How far a sample lies from the target.
#[must_use]
pub fn miss(facts: &ScenarioFacts, sample: &TruthSample) -> Miss {
    let point = surface_point(sample.longitude_rad, sample.latitude_rad);
    let start = surface_point(facts.entry_longitude_rad, facts.entry_latitude_rad);
    let (along, across) = along_and_across_rad(&start, &facts.target_p(), &point).unwrap_or_default();
    let radius_m = facts.planet.radius_m;
    Miss {
        miss_m: radius_m * great_circle_rad(&point, &facts.target_p()),
        downrange_m: radius_m * along,
        crossrange_m: radius_m * across,
    }
}

impl ScenarioFacts {
    /// Direction of the target, planet-fixed axes.
    #[must_use]
    pub fn target_p(&self) -> Vec3<PlanetFixed> {
        surface_point(self.target.longitude_rad, self.target.latitude_rad)
    }
}

/// Errors of one navigation epoch against the truth of the same time. The `nees` is none when the covariance is not
/// positive definite, as in the modes that have none.
#[must_use]
pub fn consistency(time_s: f64, nav: &NavTlm, truth: &Truth) -> NeesSample {
    let mut error = [0.0; STATES];
    for axis in 0..3 {
        error[axis] = nav.position_m[axis] - truth.position_m[axis];
        error[axis + 3] = nav.velocity_mps[axis] - truth.velocity_mps[axis];
    }
    let sigma = |state: usize| f64::from(nav.covariance[lower(state, state)]).max(0.0).sqrt();
    NeesSample {
        time_s,
        nees: squared_mahalanobis(&error, &nav.covariance),
        position_error_m: [error[0], error[1], error[2]],
        velocity_error_mps: [error[3], error[4], error[5]],
        position_sigma_m: [sigma(0), sigma(1), sigma(2)],
        velocity_sigma_mps: [sigma(3), sigma(4), sigma(5)],
    }
}

/// Index of an element of a lower triangle stored row by row.
const fn lower(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

/// `eᵀ P⁻¹ e` by Cholesky; none when P is not positive definite.
fn squared_mahalanobis(error: &[f64; STATES], covariance: &[f32; COVARIANCE_ELEMENTS]) -> Option<f64> {
    let mut l = [[0.0f64; STATES]; STATES];
    let mut whitened = [0.0f64; STATES];
    for row in 0..STATES {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| l[row][k] * l[column][k]).sum();
            let rest = f64::from(covariance[lower(row, column)]) - known;
            l[row][column] = match (row == column, rest > 0.0) {
                (true, true) => rest.sqrt(),
                (true, false) => return None,
                (false, _) => rest / l[column][column],
            };
        }
        let known: f64 = (0..row).map(|k| l[row][k] * whitened[k]).sum();
        whitened[row] = (error[row] - known) / l[row][row];
    }
    Some(whitened.iter().map(|w| w * w).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::tests::facts;
    use fsw_core::planet::MARS;
    use fsw_core::units::rad;

    #[test]
    fn a_body_in_free_fall_feels_nothing_and_one_pushed_feels_the_push() {
        let r = [3_400_000.0, 300_000.0, -900_000.0];
        let g = gravity_mps2(&MARS, &r);
        let push = 3.0 * STANDARD_GRAVITY_MPS2;
        let before = TruthSample { packet: Truth { position_m: r, ..Truth::default() }, ..TruthSample::default() };
        let velocity_mps = [0.02 * g[0], 0.02 * g[1] + 0.02 * push, 0.02 * g[2]];
        let now = Truth { position_m: r, velocity_mps, ..Truth::default() };
        assert!((mean_load_g(&MARS, &before, 0.02, &now) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn gravity_is_the_gradient_of_the_oblate_potential() {
        let potential = |r: [f64; 3]| {
            let r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
            let sin2 = r[2] * r[2] / r2;
            MARS.mu_m3ps2 / r2.sqrt() * (1.0 - MARS.j2 * MARS.radius_m * MARS.radius_m / r2 * (1.5 * sin2 - 0.5))
        };
        let r = [2_600_000.0, -1_100_000.0, 2_000_000.0];
        for axis in 0..3 {
            let (mut up, mut down) = (r, r);
            up[axis] += 10.0;
            down[axis] -= 10.0;
            let difference = (potential(up) - potential(down)) / 20.0;
            // Rounding of a potential of 1e7 J/kg over 20 m is 1e-10 m/s².
            assert!((difference - gravity_mps2(&MARS, &r)[axis]).abs() < 1e-8);
        }
    }

    #[test]
    fn a_point_beyond_and_right_of_the_target_has_both_errors_positive() {
        let mut facts = facts();
        (facts.entry_longitude_rad, facts.entry_latitude_rad) = (0.0, 0.0);
        facts.target.longitude_rad = rad(12.0);
        facts.target.latitude_rad = 0.0;
        let sample = TruthSample { longitude_rad: rad(12.1), latitude_rad: rad(-0.05), ..TruthSample::default() };
        let miss = miss(&facts, &sample);
        let m_per_deg = rad(1.0) * facts.planet.radius_m;
        // The small-angle figures differ by the curvature of 0.1° on the sphere.
        assert!((miss.downrange_m - 0.1 * m_per_deg).abs() < 0.01);
        assert!((miss.crossrange_m - 0.05 * m_per_deg).abs() < 0.01);
        assert!((miss.miss_m - (miss.downrange_m.powi(2) + miss.crossrange_m.powi(2)).sqrt()).abs() < 0.01);
    }

    #[test]
    fn the_squared_error_is_weighed_by_the_inverse_covariance() {
        let mut covariance = [0.0f32; COVARIANCE_ELEMENTS];
        for state in 0..STATES {
            covariance[lower(state, state)] = 4.0;
        }
        covariance[lower(1, 0)] = 2.0;
        // [1 1] on [[4 2] [2 4]] gives 1/3, the other four 1/4 each.
        let nees = squared_mahalanobis(&[1.0; STATES], &covariance).unwrap();
        assert!((nees - (1.0 / 3.0 + 1.0)).abs() < 1e-12);
        covariance[lower(1, 0)] = 4.1;
        assert_eq!(squared_mahalanobis(&[1.0; STATES], &covariance), None);
    }
}
