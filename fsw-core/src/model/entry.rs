//! Three-degree-of-freedom equations of motion over a rotating, oblate planet, once in Cartesian form (what flies) and once
//! in the spherical form of the paper. Both are generic in the scalar and in the environment.

use super::gravity;
use crate::math::Scalar;
use crate::planet::Planet;

/// What the equations of motion ask of the world around the vehicle. The predictor, each hypothesis of a filter bank and a
/// test can supply different ones.
pub trait Environment<S: Scalar> {
    /// The planet.
    fn planet(&self) -> &Planet;
    /// Constants of planet and vehicle.
    fn constants(&self) -> &Constants;
    /// Density at an altitude over the reference sphere, kg/m³.
    fn density_kgpm3(&self, altitude_m: S) -> S;
    /// Drag and lift coefficients at an altitude and a planet-relative speed (the onboard model knows no wind).
    fn drag_and_lift_coefficients(&self, altitude_m: S, speed_mps: S) -> (S, S);
}

/// What of planet and vehicle enters the equations of motion, multiplied once and not in every evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Constants {
    /// Reference radius, m.
    pub radius_m: f64,
    /// Gravitational parameter, m³/s².
    pub mu_m3ps2: f64,
    /// 3/2 J2 R², m².
    pub oblateness_m2: f64,
    /// Twice the rotation rate, rad/s.
    pub twice_rotation_radps: f64,
    /// Square of the rotation rate, rad²/s².
    pub rotation_square: f64,
    /// Half the reference area over mass, m²/kg.
    pub half_area_per_mass_m2pkg: f64,
}

impl Constants {
    /// Of a planet and a vehicle of this reference area over mass, m²/kg.
    #[must_use]
    pub const fn new(planet: &Planet, area_per_mass_m2pkg: f64) -> Self {
        Self {
            radius_m: planet.radius_m,
            mu_m3ps2: planet.mu_m3ps2,
            oblateness_m2: 1.5 * planet.j2 * planet.radius_m * planet.radius_m,
            twice_rotation_radps: 2.0 * planet.rotation_radps,
            rotation_square: planet.rotation_radps * planet.rotation_radps,
            half_area_per_mass_m2pkg: 0.5 * area_per_mass_m2pkg,
        }
    }
}

/// An environment with its drag and lift scaled: what adaptation learned, or one hypothesis of a filter bank.
#[derive(Clone, Copy, Debug)]
pub struct Scaled<'a, E, S> {
    /// The environment that is scaled.
    pub environment: &'a E,
    /// Factor on the drag.
    pub drag_ratio: S,
    /// Factor on the lift.
    pub lift_ratio: S,
}

impl<S: Scalar, E: Environment<S>> Environment<S> for Scaled<'_, E, S> {
    #[inline(always)]
    fn planet(&self) -> &Planet {
        self.environment.planet()
    }
    #[inline(always)]
    fn density_kgpm3(&self, altitude_m: S) -> S {
        self.environment.density_kgpm3(altitude_m)
    }
    #[inline(always)]
    fn drag_and_lift_coefficients(&self, altitude_m: S, speed_mps: S) -> (S, S) {
        let (drag, lift) = self.environment.drag_and_lift_coefficients(altitude_m, speed_mps);
        (drag * self.drag_ratio, lift * self.lift_ratio)
    }
    #[inline(always)]
    fn constants(&self) -> &Constants {
        self.environment.constants()
    }
}

/// Added to |v × r|², which reaches 4e20 m⁴/s²: lift fades to zero where it has no direction, in vertical flight, instead of
/// being divided by zero. Far below the last bit of any other flight.
const VERTICAL_M4PS2: f64 = 1e-3;

/// Time derivative of the Cartesian state: position (m) and planet-relative velocity (m/s), both in planet-fixed axes.
///
/// P4 eq. 1 as corrected in `doc/equations.md`, written as vectors in the rotating axes:
///
/// ```text
/// r' = v
/// v' = g(r) − 2 ω×v − ω×(ω×r) − (ρ S/2m) [ C_D V v − C_L (V/|h|) ( cosσ (V² r − (r·v) v) + sinσ V h ) ],   h = v × r
/// ```
///
/// h points to the right of the velocity, V² r − (r·v) v up from it. `cos_bank`, `sin_bank` are of the bank angle: 0 lift up,
/// positive to the right. No trigonometry; one exponential, three roots, two divisions. Lift is zero in vertical flight.
/// The state must not be at the planet's centre.
#[inline]
pub fn cartesian_rates<S: Scalar, E: Environment<S>>(env: &E, state: &[S; 6], cos_bank: S, sin_bank: S) -> [S; 6] {
    cartesian_rates_and_flow(env, state, cos_bank, sin_bank).0
}

/// What [`cartesian_rates_and_flow`] finds on its way to the rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow<S> {
    /// Distance from the planet's centre, m.
    pub radius_m: S,
    /// Planet-relative speed, m/s.
    pub speed_mps: S,
    /// Position times velocity, m²/s.
    pub r_dot_v: S,
    /// Density, kg/m³.
    pub density_kgpm3: S,
    /// Drag coefficient.
    pub drag_coefficient: S,
    /// Lift coefficient.
    pub lift_coefficient: S,
}

/// As [`cartesian_rates`], with the flow around the vehicle, which costs nothing more.
#[inline(always)]
pub fn cartesian_rates_and_flow<S: Scalar, E: Environment<S>>(
    env: &E,
    state: &[S; 6],
    cos_bank: S,
    sin_bank: S,
) -> ([S; 6], Flow<S>) {
    let [x, y, z, vx, vy, vz] = *state;
    let constants = env.constants();

    let r2 = x * x + y * y + z * z;
    let inverse_square = r2.recip();
    let radius = r2.sqrt();
    let [gx, gy, gz] = gravity::acceleration_from(constants, &[x, y, z], inverse_square, radius * inverse_square);

    let v2 = vx * vx + vy * vy + vz * vz;
    let speed = v2.sqrt();
    let altitude = radius - constants.radius_m;
    let (drag_coefficient, lift_coefficient) = env.drag_and_lift_coefficients(altitude, speed);
    // ρ S V / 2m: times C_D v it is the drag.
    let density = env.density_kgpm3(altitude);
    let pressure = density * speed * constants.half_area_per_mass_m2pkg;

    let (hx, hy, hz) = (vy * z - vz * y, vz * x - vx * z, vx * y - vy * x);
    let h2 = hx * hx + hy * hy + hz * hz;
    let lift = pressure * lift_coefficient / (h2 + VERTICAL_M4PS2).sqrt();
    let up = lift * cos_bank;
    let right = lift * sin_bank * speed;
    let along_r = up * v2;
    let r_dot_v = x * vx + y * vy + z * vz;
    let along_v = up * r_dot_v + pressure * drag_coefficient;

    let (twice, square) = (constants.twice_rotation_radps, constants.rotation_square);
    let rates = [
        vx,
        vy,
        vz,
        gx + along_r * x - along_v * vx + right * hx + vy * twice + x * square,
        gy + along_r * y - along_v * vy + right * hy - vx * twice + y * square,
        gz + along_r * z - along_v * vz + right * hz,
    ];
    let flow = Flow {
        radius_m: radius,
        speed_mps: speed,
        r_dot_v,
        density_kgpm3: density,
        drag_coefficient,
        lift_coefficient,
    };
    (rates, flow)
}

/// Time derivative of the spherical state: radius (m), longitude, planetocentric latitude (rad), planet-relative speed (m/s),
/// flight-path angle and heading (rad; γ positive up, ψ clockwise from north).
///
/// P4 eq. 1 as corrected in `doc/equations.md`, line by line. Singular at the poles, at rest and in vertical flight.
/// Symbols: D, L drag and lift per mass; `g_r` inward, `g_n` northward gravity; ω planet rate; σ bank.
#[must_use]
pub fn spherical_rates<S: Scalar, E: Environment<S>>(env: &E, state: &[S; 6], cos_bank: S, sin_bank: S) -> [S; 6] {
    let [r, _longitude, phi, v, gamma, psi] = *state;
    let planet = env.planet();
    let omega = planet.rotation_radps;
    let (sin_phi, cos_phi) = (phi.sin(), phi.cos());
    let (sin_gamma, cos_gamma) = (gamma.sin(), gamma.cos());
    let (sin_psi, cos_psi) = (psi.sin(), psi.cos());

    let altitude = r - planet.radius_m;
    let (drag_coefficient, lift_coefficient) = env.drag_and_lift_coefficients(altitude, v);
    let pressure = env.density_kgpm3(altitude) * v * v * env.constants().half_area_per_mass_m2pkg;
    let (d, l) = (pressure * drag_coefficient, pressure * lift_coefficient);

    let g = (r * r).recip() * planet.mu_m3ps2;
    let q = (r * r).recip() * (1.5 * planet.j2 * planet.radius_m * planet.radius_m);
    let g_r = g * (q * (-(sin_phi * sin_phi * 3.0) + 1.0) + 1.0);
    let g_n = -(g * q * sin_phi * cos_phi * 2.0);

    let centrifugal = r * (omega * omega);
    let speed_rate = -d - g_r * sin_gamma
        + g_n * cos_gamma * cos_psi
        + centrifugal * cos_phi * (sin_gamma * cos_phi - cos_gamma * sin_phi * cos_psi);
    let turn_up = l * cos_bank + (v * v / r - g_r) * cos_gamma - g_n * sin_gamma * cos_psi
        + v * cos_phi * sin_psi * (2.0 * omega)
        + centrifugal * cos_phi * (cos_gamma * cos_phi + sin_gamma * sin_phi * cos_psi);
    let turn_right = l * sin_bank / cos_gamma + v * v / r * cos_gamma * sin_psi * sin_phi / cos_phi
        - g_n * sin_psi / cos_gamma
        - v * (sin_gamma / cos_gamma * cos_phi * cos_psi - sin_phi) * (2.0 * omega)
        + centrifugal / cos_gamma * sin_phi * cos_phi * sin_psi;
    [
        v * sin_gamma,
        v * cos_gamma * sin_psi / (r * cos_phi),
        v * cos_gamma * cos_psi / r,
        speed_rate,
        turn_up / v,
        turn_right / v,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Dual, rk4};
    use crate::model::golden_entries::{Case, model_of};
    use crate::planet::MARS;
    use proptest::prelude::*;

    /// Spherical states that the spherical form can hold: away from the poles, from rest and from the vertical.
    fn flight() -> impl Strategy<Value = ([f64; 6], f64)> {
        (3.4e6..3.53e6f64, -3.1..3.1f64, -1.4..1.4f64, 200.0..6000.0f64, -1.3..1.3f64, (-3.1..3.1f64, -3.1..3.1f64))
            .prop_map(|(r, lon, lat, v, gamma, (psi, bank))| ([r, lon, lat, v, gamma, psi], bank))
    }

    /// Position and planet-relative velocity of a spherical state: east, north and up written out.
    fn cartesian<S: Scalar>([r, lon, lat, v, gamma, psi]: [S; 6]) -> [S; 6] {
        let up = [lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin()];
        let east = [-lon.sin(), lon.cos(), S::from_f64(0.0)];
        let north = [-(lat.sin() * lon.cos()), -(lat.sin() * lon.sin()), lat.cos()];
        let (ve, vn, vu) = (v * gamma.cos() * psi.sin(), v * gamma.cos() * psi.cos(), v * gamma.sin());
        let velocity = |i: usize| ve * east[i] + vn * north[i] + vu * up[i];
        [r * up[0], r * up[1], r * up[2], velocity(0), velocity(1), velocity(2)]
    }

    /// Largest deviation between a Jacobian by duals and by central differences, relative to the largest element of its row.
    fn deviation<F, G>(state: &[f64; 6], exact: F, plain: G) -> f64
    where
        F: Fn(&[Dual<6>; 6]) -> [Dual<6>; 6],
        G: Fn(&[f64; 6]) -> [f64; 6],
    {
        let jacobian = exact(&Dual::variables(state));
        let mut worst = 0.0;
        let steps = [10.0, 10.0, 10.0, 0.01, 0.01, 0.01];
        for j in 0..6 {
            let (mut ahead, mut behind) = (*state, *state);
            ahead[j] += steps[j];
            behind[j] -= steps[j];
            let (ahead, behind) = (plain(&ahead), plain(&behind));
            for i in 0..6 {
                let difference = (ahead[i] - behind[i]) / (2.0 * steps[j]);
                // Positions and velocities have units of their own: compare with the largest of the same block. The
                // gradients of gravity (2 μ/r³, 2e-6 1/s²) and of drag may cancel in it; their truncation does not.
                let (block, floor) = if j < 3 { (0..3, 2e-6) } else { (3..6, 1e-12) };
                let scale =
                    jacobian[i].partials[block].iter().fold(floor, |m, p| if p.abs() > m { p.abs() } else { m });
                let error = (jacobian[i].partials[j] - difference).abs() / scale;
                worst = if error > worst { error } else { worst };
            }
        }
        worst
    }

    proptest! {
        #[test]
        fn both_forms_have_the_same_derivative((state, bank) in flight()) {
            let model = model_of(&Case { planet: MARS, ..Case::EXP0 });
            let (sine, cosine) = (bank.sin(), bank.cos());
            let rates = spherical_rates(&model, &state, cosine, sine);
            // Carry the spherical rates through the conversion as a directional derivative.
            let mut moving = [Dual::<1>::constant(0.0); 6];
            for i in 0..6 {
                moving[i] = Dual { value: state[i], partials: [rates[i]] };
            }
            let converted = cartesian(moving);
            let direct = cartesian_rates(&model, &cartesian(state), cosine, sine);
            for i in 0..6 {
                // Velocities reach 6e3 m/s and accelerations 2e3 m/s²: 1e-8 is 1e-12 of that.
                prop_assert!((converted[i].partials[0] - direct[i]).abs() < 1e-8, "{}: {} {}", i, converted[i].partials[0], direct[i]);
            }
        }

        #[test]
        fn the_dual_jacobian_agrees_with_central_differences((state, bank) in flight()) {
            let model = model_of(&Case { planet: MARS, ..Case::EXP0 });
            let (sine, cosine) = (bank.sin(), bank.cos());
            let worst = deviation(
                &cartesian(state),
                |s| cartesian_rates(&model, s, Dual::constant(cosine), Dual::constant(sine)),
                |s| cartesian_rates(&model, s, cosine, sine),
            );
            // Truncation (10 m over a scale height of 1e4)² and rounding of 3.5e6 m over 20 m: both about 1e-7.
            prop_assert!(worst < 2e-6, "{}", worst);
        }

        #[test]
        fn the_jacobian_of_a_whole_step_agrees_too((state, bank) in flight()) {
            let model = model_of(&Case { planet: MARS, ..Case::EXP0 });
            let (sine, cosine) = (bank.sin(), bank.cos());
            let worst = deviation(
                &cartesian(state),
                |s| rk4(s, 0.1, |_, s| cartesian_rates(&model, s, Dual::constant(cosine), Dual::constant(sine))),
                |s| rk4(s, 0.1, |_, s| cartesian_rates(&model, s, cosine, sine)),
            );
            prop_assert!(worst < 2e-6, "{}", worst);
        }

        #[test]
        fn without_air_the_energy_in_the_rotating_axes_is_kept((state, bank) in flight()) {
            // Jacobi's integral: v²/2 + U − ω²(x² + y²)/2 has no rate, so v·a' = 0 once gravity and centrifugal force are
            // taken off; drag opposes the velocity and lift is normal to it.
            let model = model_of(&Case { planet: MARS, ..Case::EXP0 });
            let s = cartesian(state);
            let [x, y, z, vx, vy, vz] = s;
            let [_, _, _, ax, ay, az] = cartesian_rates(&model, &s, bank.cos(), bank.sin());
            let [gx, gy, gz] = gravity::acceleration(&MARS, &[x, y, z]);
            let w2 = MARS.rotation_radps * MARS.rotation_radps;
            let power = vx * (ax - gx - w2 * x) + vy * (ay - gy - w2 * y) + vz * (az - gz);
            let v2 = vx * vx + vy * vy + vz * vz;
            let radius = (x * x + y * y + z * z).sqrt();
            let drag = 0.5 * model.atmosphere.density(radius - MARS.radius_m) * v2 / 146.0;
            // Rounding of terms of drag·v, up to 1e7 W/kg.
            prop_assert!((power + drag * v2.sqrt()).abs() < 1e-11 * (drag + 10.0) * v2.sqrt(), "{} {}", power, drag);
        }
    }

    #[test]
    fn a_positive_bank_turns_to_the_right() {
        let model = model_of(&Case::EXP0);
        // Over the equator flying north: right is east.
        let northward = cartesian([3.42e6, 0.0, 0.0, 4000.0, 0.0, 0.0]);
        let [_, _, _, _, ay, _] = cartesian_rates(&model, &northward, 0.0, 1.0);
        assert!(ay > 1.0);
        let [_, _, _, _, _, heading_rate] = spherical_rates(&model, &[3.42e6, 0.0, 0.0, 4000.0, 0.0, 0.0], 0.0, 1.0);
        assert!((heading_rate - ay / 4000.0).abs() < 1e-15);
    }

    #[test]
    fn vertical_flight_and_rest_have_finite_rates() {
        let model = model_of(&Case { planet: MARS, ..Case::EXP0 });
        for velocity in [[-400.0, 0.0, 0.0], [0.0; 3]] {
            let [vx, vy, vz] = velocity;
            let state = [3.41e6, 0.0, 0.0, vx, vy, vz];
            assert!(cartesian_rates(&model, &state, 1.0, 0.0).iter().all(|x| x.is_finite()));
            let (one, zero) = (Dual::constant(1.0), Dual::constant(0.0));
            let jacobian = cartesian_rates(&model, &Dual::variables(&state), one, zero);
            assert!(jacobian.iter().all(|x| x.value.is_finite() && x.partials.iter().all(|p| p.is_finite())));
        }
    }

    #[test]
    fn scaled_drag_and_lift_scale_what_the_air_does() {
        let model = model_of(&Case::EXP0);
        let doubled = Scaled { environment: &model, drag_ratio: 2.0, lift_ratio: 0.0 };
        let state = cartesian([3.42e6, 0.0, 0.0, 4000.0, 0.0, 1.57]);
        let none = Scaled { environment: &model, drag_ratio: 0.0, lift_ratio: 0.0 };
        let (free, drag, twice) = (
            cartesian_rates(&none, &state, 1.0, 0.0),
            cartesian_rates(&Scaled { lift_ratio: 0.0, drag_ratio: 1.0, ..none }, &state, 1.0, 0.0),
            cartesian_rates(&doubled, &state, 1.0, 0.0),
        );
        for i in 3..6 {
            assert!((twice[i] - free[i] - 2.0 * (drag[i] - free[i])).abs() < 1e-12);
        }
    }
}
