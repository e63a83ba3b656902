//! [`Spherical`]: the model of P1 and P2, a point mass in exponential air over a planet that neither turns nor bulges.

use super::{AXES, Air, Process, Vehicle};
use crate::math::{Scalar, fun, rk4};

/// Distance from the planet's centre, m.
pub const RADIUS: usize = 0;
/// Speed, m/s.
pub const SPEED: usize = 1;
/// Flight-path angle, rad, positive up.
pub const PATH_ANGLE: usize = 2;
/// Longitude, rad.
pub const LONGITUDE: usize = 3;
/// Latitude, rad.
pub const LATITUDE: usize = 4;
/// Heading, rad, clockwise from north.
pub const HEADING: usize = 5;

/// The vehicle and its world in the spherical states of P1 and P2: x = [r, v, γ, θ, λ, ψ] (m, m/s, rad).
///
/// Parameters α = [δτ, δl]: relative errors of τ = ρB, attributed to the density, and of the lift-to-drag ratio. Singular
/// over the poles, at rest and in vertical flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spherical {
    /// Gravitational parameter μ, m³/s².
    pub mu_m3ps2: f64,
    /// Density ρ₀ at the reference radius, kg/m³.
    pub density_kgpm3: f64,
    /// Reference radius r₀, m.
    pub reference_radius_m: f64,
    /// Scale height hₛ, m.
    pub scale_height_m: f64,
    /// B = C_D S/m, m²/kg.
    pub drag_area_m2pkg: f64,
    /// Lift over drag.
    pub lift_to_drag: f64,
    cos_bank: f64,
    sin_bank: f64,
}

impl Spherical {
    /// P1's and P2's Mars and vehicle (P1 Table 1, eq. 21), lift up.
    pub const MARS: Self = Self {
        mu_m3ps2: 4.282_829e13,
        density_kgpm3: 2e-4,
        reference_radius_m: 3_437_200.0,
        scale_height_m: 7_500.0,
        drag_area_m2pkg: 0.016,
        lift_to_drag: 0.156,
        cos_bank: 1.0,
        sin_bank: 0.0,
    };

    /// The same, banked: 0 lift up, positive to the right, rad.
    #[must_use]
    pub fn banked(self, bank_rad: f64) -> Self {
        let (sin_bank, cos_bank) = fun::sin_cos(bank_rad);
        Self { cos_bank, sin_bank, ..self }
    }

    /// ρ = ρ₀ (1 + δτ) exp((r₀ − r)/hₛ), P1 eq. 21.
    #[inline(always)]
    fn density<S: Scalar>(&self, radius: S, parameters: &[S; 2]) -> S {
        let [density_error, _] = *parameters;
        let nominal = ((radius - self.reference_radius_m) * (-1.0 / self.scale_height_m)).exp() * self.density_kgpm3;
        nominal * (density_error + 1.0)
    }

    /// D = ½ ρ v² B and L = (L/D)(1 + δl) D, m/s².
    #[inline(always)]
    fn drag_and_lift<S: Scalar>(&self, radius: S, speed: S, parameters: &[S; 2]) -> (S, S) {
        let [_, lift_error] = *parameters;
        let drag = self.density(radius, parameters) * speed * speed * (0.5 * self.drag_area_m2pkg);
        (drag, drag * (lift_error + 1.0) * self.lift_to_drag)
    }

    /// P1 eq. 20. (Eq. 23 prints +D in the speed; −D as in eq. 20 is right. The lift terms, which P1 calls a control, are
    /// part of the equations here: eq. 11 does not change by that.)
    #[inline(always)]
    fn rates<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2]) -> [S; 6] {
        let [r, v, gamma, _, lambda, psi] = *state;
        let (sin_gamma, cos_gamma) = gamma.sin_cos();
        let (sin_lambda, cos_lambda) = lambda.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();
        let (inverse_r, inverse_v, inverse_cos) = (r.recip(), v.recip(), cos_lambda.recip());
        let gravity = inverse_r * inverse_r * self.mu_m3ps2;
        let (drag, lift) = self.drag_and_lift(r, v, parameters);
        let turn = lift * inverse_v;
        let over_ground = v * cos_gamma * inverse_r;
        let eastward = over_ground * sin_psi * inverse_cos;
        [
            v * sin_gamma,
            -drag - gravity * sin_gamma,
            over_ground - gravity * inverse_v * cos_gamma + turn * self.cos_bank,
            eastward,
            over_ground * cos_psi,
            eastward * sin_lambda + turn * self.sin_bank / cos_gamma,
        ]
    }
}

impl Process<6, 2> for Spherical {
    /// One Runge–Kutta step.
    fn step<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2], step_s: f64) -> [S; 6] {
        rk4(state, step_s, |_, state| self.rates(state, parameters))
    }
}

impl Vehicle<6, 2> for Spherical {
    fn air<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2]) -> Air<S> {
        let [r, v, ..] = *state;
        Air { density_kgpm3: self.density(r, parameters), speed_square: v * v }
    }

    /// Velocity axes, x forward, y **left**, z up (P1 eq. 26): [−D, −L sinσ, L cosσ].
    fn specific_force<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2], axis: usize) -> S {
        let [r, v, ..] = *state;
        let (drag, lift) = self.drag_and_lift(r, v, parameters);
        match axis {
            0 => -drag,
            1 => lift * -self.sin_bank,
            _ => lift * self.cos_bank,
        }
    }

    /// Planet-fixed axes, which are inertial here.
    fn position<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        let [r, _, _, theta, lambda, _] = *state;
        let (sin_theta, cos_theta) = theta.sin_cos();
        let (sin_lambda, cos_lambda) = lambda.sin_cos();
        let across = r * cos_lambda;
        [across * cos_theta, across * sin_theta, r * sin_lambda]
    }

    fn velocity<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        let [_, v, gamma, theta, lambda, psi] = *state;
        let (sin_gamma, cos_gamma) = gamma.sin_cos();
        let (sin_theta, cos_theta) = theta.sin_cos();
        let (sin_lambda, cos_lambda) = lambda.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();
        let (up, level) = (v * sin_gamma, v * cos_gamma);
        let (north, east) = (level * cos_psi, level * sin_psi);
        let outward = up * cos_lambda - north * sin_lambda;
        [
            outward * cos_theta - east * sin_theta,
            outward * sin_theta + east * cos_theta,
            up * sin_lambda + north * cos_lambda,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::PlanetRelative;
    use crate::math::Dual;
    use crate::model::entry::{Constants, Environment, spherical_rates};
    use crate::planet::Planet;
    use proptest::prelude::*;

    fn flight() -> impl Strategy<Value = [f64; 6]> {
        (3.41e6..3.53e6f64, 400.0..7000.0f64, -0.4..0.1f64, -3.0..3.0f64, -1.2..1.2f64, -3.0..3.0f64)
            .prop_map(|(r, v, gamma, theta, lambda, psi)| [r, v, gamma, theta, lambda, psi])
    }

    /// The onboard model's environment with the same numbers: an independent form of the same equations.
    struct SameWorld {
        planet: Planet,
        constants: Constants,
        density_error: f64,
        lift: f64,
    }

    impl Environment<f64> for SameWorld {
        fn planet(&self) -> &Planet {
            &self.planet
        }
        fn constants(&self) -> &Constants {
            &self.constants
        }
        fn density_kgpm3(&self, altitude_m: f64) -> f64 {
            2e-4 * (1.0 + self.density_error) * ((40e3 - altitude_m) / 7_500.0).exp()
        }
        fn drag_and_lift_coefficients(&self, _: f64, _: f64) -> (f64, f64) {
            (1.0, self.lift)
        }
    }

    proptest! {
        #[test]
        fn the_equations_are_those_of_the_onboard_model_on_a_planet_at_rest(
            x in flight(), bank in -3.0..3.0f64, alpha in prop::array::uniform2(-0.3..0.3f64)
        ) {
            let planet = Planet { radius_m: 3_397_200.0, mu_m3ps2: 4.282_829e13, rotation_radps: 0.0, j2: 0.0 };
            let world = SameWorld {
                planet,
                constants: Constants::new(&planet, 0.016),
                density_error: alpha[0],
                lift: 0.156 * (1.0 + alpha[1]),
            };
            let [r, v, gamma, theta, lambda, psi] = x;
            let theirs = spherical_rates(&world, &[r, theta, lambda, v, gamma, psi], bank.cos(), bank.sin());
            let ours = Spherical::MARS.banked(bank).rates(&x, &alpha);
            for (i, j) in [(RADIUS, 0), (SPEED, 3), (PATH_ANGLE, 4), (LONGITUDE, 1), (LATITUDE, 2), (HEADING, 5)] {
                // Relative to g/v and v/r for angles, of order 1e-3; rounding only.
                prop_assert!((ours[i] - theirs[j]).abs() < 1e-13 * (1.0 + theirs[j].abs()) + 1e-16, "{}", i);
            }
        }

        #[test]
        fn position_and_velocity_are_those_of_the_frames(x in flight()) {
            let [radius_m, speed_mps, flight_path_angle_rad, longitude_rad, latitude_rad, heading_rad] = x;
            let (r, v) = PlanetRelative {
                radius_m, longitude_rad, latitude_rad, speed_mps, flight_path_angle_rad, heading_rad
            }.to_cartesian();
            let (p, u) = (Spherical::MARS.position(&x), Spherical::MARS.velocity(&x));
            for (ours, theirs, tolerance) in [
                (p, [r.x(), r.y(), r.z()], 1e-8), (u, [v.x(), v.y(), v.z()], 1e-10)
            ] {
                for (a, b) in ours.iter().zip(theirs) {
                    prop_assert!((a - b).abs() < tolerance);
                }
            }
        }

        #[test]
        fn derivatives_through_the_step_agree_with_differences(x in flight()) {
            let model = Spherical::MARS.banked(0.9);
            let seeded: [Dual<8>; 6] = core::array::from_fn(|i| Dual::variable(x[i], i));
            let alpha = [Dual::<8>::variable(0.1, 6), Dual::variable(-0.1, 7)];
            let exact = model.step(&seeded, &alpha, 1.0);
            let steps = [10.0, 0.1, 1e-5, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4];
            let moved = |j: usize, by: f64| {
                let (mut x, mut alpha) = (x, [0.1, -0.1]);
                if j < 6 { x[j] += by } else { alpha[j - 6] += by }
                model.step(&x, &alpha, 1.0)
            };
            let sizes = [1e4, 1e2, 1e-2, 1e-2, 1e-2, 1e-2];
            for j in 0..8 {
                let (ahead, behind) = (moved(j, steps[j]), moved(j, -steps[j]));
                for i in 0..6 {
                    let difference = (ahead[i] - behind[i]) / (2.0 * steps[j]);
                    let scale = sizes[i] / (if j < 6 { sizes[j] } else { 1.0 });
                    prop_assert!((exact[i].partials[j] - difference).abs() < 1e-5 * scale, "{} {}", i, j);
                }
            }
        }
    }

    #[test]
    fn a_vehicle_at_rest_gives_numbers_that_are_not_finite() {
        let x = [3.5e6, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert!(Spherical::MARS.step(&x, &[0.0; 2], 1.0).iter().any(|x| !x.is_finite()));
    }
}
