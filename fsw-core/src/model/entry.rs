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
    /// Density at an altitude over the reference sphere, kg/m³.
    fn density_kgpm3(&self, altitude_m: S) -> S;
    /// Drag and lift coefficients at an altitude and a planet-relative speed (the onboard model knows no wind).
    fn drag_and_lift_coefficients(&self, altitude_m: S, speed_mps: S) -> (S, S);
    /// Reference area over mass, m²/kg.
    fn area_per_mass_m2pkg(&self) -> f64;
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
    fn area_per_mass_m2pkg(&self) -> f64 {
        self.environment.area_per_mass_m2pkg()
    }
}

/// Square of the sine of the angle between position and velocity below which lift has no defined direction and is taken as zero.
const VERTICAL_SINE_SQUARE: f64 = 1e-20;

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
    let [x, y, z, vx, vy, vz] = *state;
    let planet = env.planet();

    let r2 = x * x + y * y + z * z;
    let inverse_square = r2.recip();
    let radius = r2.sqrt();
    let [gx, gy, gz] = gravity::acceleration_from(planet, &[x, y, z], inverse_square, radius * inverse_square);

    let v2 = vx * vx + vy * vy + vz * vz;
    let speed = v2.sqrt();
    let altitude = radius - planet.radius_m;
    let (drag_coefficient, lift_coefficient) = env.drag_and_lift_coefficients(altitude, speed);
    // ρ S V / 2m: times C_D v it is the drag.
    let pressure = env.density_kgpm3(altitude) * speed * (0.5 * env.area_per_mass_m2pkg());

    let (hx, hy, hz) = (vy * z - vz * y, vz * x - vx * z, vx * y - vy * x);
    let h2 = hx * hx + hy * hy + hz * hz;
    let lift = if h2.value() > VERTICAL_SINE_SQUARE * r2.value() * v2.value() {
        pressure * lift_coefficient / h2.sqrt()
    } else {
        S::from_f64(0.0)
    };
    let up = lift * cos_bank;
    let right = lift * sin_bank * speed;
    let along_r = up * v2;
    let along_v = up * (x * vx + y * vy + z * vz) + pressure * drag_coefficient;

    let omega = planet.rotation_radps;
    let (twice, square) = (2.0 * omega, omega * omega);
    [
        vx,
        vy,
        vz,
        gx + along_r * x - along_v * vx + right * hx + vy * twice + x * square,
        gy + along_r * y - along_v * vy + right * hy - vx * twice + y * square,
        gz + along_r * z - along_v * vz + right * hz,
    ]
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
    let pressure = env.density_kgpm3(altitude) * v * v * (0.5 * env.area_per_mass_m2pkg());
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
