//! [`Cartesian`]: the model of P3, a point mass in inertial axes through exponential air that turns with the planet.

use super::{AXES, Air, Process, Vehicle};
use crate::math::{Scalar, fun, rk4};

/// The vehicle and its world in inertial position and velocity: x = [r, v] (m, m/s), z along the planet's spin.
///
/// Parameters α, as many of them as `P` says, from the first on: d = ln(1 + Δ) with Δ the relative error of the density;
/// relative error of the lift-to-drag ratio. No singularity but at rest in the air and in vertical flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cartesian<const P: usize> {
    /// Gravitational parameter μ, m³/s².
    pub mu_m3ps2: f64,
    /// Spin of the planet and its air about z, rad/s.
    pub spin_radps: f64,
    /// Density ρ₀ at the reference radius, kg/m³.
    pub density_kgpm3: f64,
    /// Reference radius r₀, m.
    pub reference_radius_m: f64,
    /// Scale height hₛ, m.
    pub scale_height_m: f64,
    /// C_D S/m, m²/kg: one over the ballistic coefficient.
    pub drag_area_m2pkg: f64,
    /// Lift over drag.
    pub lift_to_drag: f64,
    cos_bank: f64,
    sin_bank: f64,
}

/// What the air does to the vehicle: f = along·u + up·r + side·(u × r), with u the velocity in the air.
struct Aerodynamics<S> {
    u: [S; AXES],
    along: S,
    up: S,
    side: Option<S>,
}

impl<const P: usize> Cartesian<P> {
    /// P3's Mars and vehicle (§4), lift up.
    pub const MARS: Self = Self {
        mu_m3ps2: 4.2828e13,
        spin_radps: 7.0882e-5,
        density_kgpm3: 2e-4,
        reference_radius_m: 3_437_200.0,
        scale_height_m: 7_500.0,
        drag_area_m2pkg: 1.0 / 146.0,
        lift_to_drag: 0.24,
        cos_bank: 1.0,
        sin_bank: 0.0,
    };

    /// The same, banked: 0 lift up, positive to the right, rad.
    #[must_use]
    pub fn banked(self, bank_rad: f64) -> Self {
        let (sin_bank, cos_bank) = fun::sin_cos(bank_rad);
        Self { cos_bank, sin_bank, ..self }
    }

    /// v − Ω × r.
    #[inline(always)]
    fn in_air<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        let [x, y, _, vx, vy, vz] = *state;
        [vx + y * self.spin_radps, vy - x * self.spin_radps, vz]
    }

    /// ρ = ρ₀ exp(d + (r₀ − r)/hₛ), P3 eq. 1.
    #[inline(always)]
    fn density<S: Scalar>(&self, radius: S, parameters: &[S; P]) -> S {
        let heights = (radius - self.reference_radius_m) * (-1.0 / self.scale_height_m);
        let exponent = match parameters.first() {
            Some(error) => heights + *error,
            None => heights,
        };
        exponent.exp() * self.density_kgpm3
    }

    /// P3 eqs. 3–6, drag against the velocity u in the air, lift across it. With p = r − u (u·r)/u² the part of r across
    /// u, lift at bank σ is L (cos σ p/|p| + sin σ u×r/(|u||p|)); by u, r and u × r the sum costs six products.
    #[inline(always)]
    fn aerodynamics<S: Scalar>(&self, state: &[S; 6], parameters: &[S; P], radius: S) -> Aerodynamics<S> {
        let position = self.position(state);
        let u = self.in_air(state);
        let square = dot(&u, &u);
        let speed = square.sqrt();
        let thrust = self.density(radius, parameters) * (0.5 * self.drag_area_m2pkg);
        let climb = dot(&u, &position) / square;
        let across = (radius * radius - climb * climb * square).sqrt();
        let lift = match parameters.get(1) {
            Some(error) => thrust * square * (*error + 1.0) * self.lift_to_drag,
            None => thrust * square * self.lift_to_drag,
        };
        let up = lift * self.cos_bank / across;
        let along = -(thrust * speed) - up * climb;
        // Lift in the vertical plane, as P3 flies, need not pay for the third direction.
        let side = (self.sin_bank != 0.0).then(|| lift * self.sin_bank / (speed * across));
        Aerodynamics { u, along, up, side }
    }
}

impl<S: Scalar> Aerodynamics<S> {
    /// The force per mass, with `pull` added to the factor of the position.
    #[inline(always)]
    fn force(&self, position: &[S; AXES], pull: Option<S>) -> [S; AXES] {
        let ([ux, uy, uz], [x, y, z]) = (self.u, *position);
        let up = match pull {
            Some(pull) => self.up + pull,
            None => self.up,
        };
        let level = [self.along * ux + up * x, self.along * uy + up * y, self.along * uz + up * z];
        let (Some(side), [fx, fy, fz]) = (self.side, level) else { return level };
        [fx + side * (uy * z - uz * y), fy + side * (uz * x - ux * z), fz + side * (ux * y - uy * x)]
    }
}

#[inline(always)]
fn dot<S: Scalar>(a: &[S; AXES], b: &[S; AXES]) -> S {
    let ([ax, ay, az], [bx, by, bz]) = (*a, *b);
    ax * bx + ay * by + az * bz
}

impl<const P: usize> Process<6, P> for Cartesian<P> {
    /// One Runge–Kutta step of P3 eq. 3; no Coriolis or centrifugal term, because the axes are inertial.
    fn step<S: Scalar>(&self, state: &[S; 6], parameters: &[S; P], step_s: f64) -> [S; 6] {
        rk4(state, step_s, |_, state| {
            let position = self.position(state);
            let square = dot(&position, &position);
            let radius = square.sqrt();
            let pull = (square * radius).recip() * -self.mu_m3ps2;
            let [ax, ay, az] = self.aerodynamics(state, parameters, radius).force(&position, Some(pull));
            let [.., vx, vy, vz] = *state;
            [vx, vy, vz, ax, ay, az]
        })
    }
}

impl<const P: usize> Vehicle<6, P> for Cartesian<P> {
    fn air<S: Scalar>(&self, state: &[S; 6], parameters: &[S; P]) -> Air<S> {
        let position = self.position(state);
        let u = self.in_air(state);
        Air { density_kgpm3: self.density(dot(&position, &position).sqrt(), parameters), speed_square: dot(&u, &u) }
    }

    /// Inertial axes: P3 takes the attitude as known.
    fn specific_force<S: Scalar>(&self, state: &[S; 6], parameters: &[S; P], axis: usize) -> S {
        let position = self.position(state);
        let radius = dot(&position, &position).sqrt();
        let [x, y, z] = self.aerodynamics(state, parameters, radius).force(&position, None);
        match axis {
            0 => x,
            1 => y,
            _ => z,
        }
    }

    fn position<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        let [x, y, z, ..] = *state;
        [x, y, z]
    }

    fn velocity<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        let [.., vx, vy, vz] = *state;
        [vx, vy, vz]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Spherical;
    use super::*;
    use crate::math::Dual;
    use proptest::prelude::*;

    /// P3 Table 1.
    const ENTRY: [f64; 6] = [-2_102_033.0, 2_816_074.0, -238_991.0, 994.910, -781.820, 5_950.410];

    fn spherical() -> impl Strategy<Value = [f64; 6]> {
        (3.41e6..3.53e6f64, 400.0..7000.0f64, -0.4..0.1f64, -3.0..3.0f64, -1.2..1.2f64, -3.0..3.0f64)
            .prop_map(|(r, v, gamma, theta, lambda, psi)| [r, v, gamma, theta, lambda, psi])
    }

    /// The spherical model's world, at rest.
    fn same_world(of: &Spherical, bank_rad: f64) -> Cartesian<2> {
        Cartesian::<2> {
            mu_m3ps2: of.mu_m3ps2,
            spin_radps: 0.0,
            density_kgpm3: of.density_kgpm3,
            reference_radius_m: of.reference_radius_m,
            scale_height_m: of.scale_height_m,
            drag_area_m2pkg: of.drag_area_m2pkg,
            lift_to_drag: of.lift_to_drag,
            ..Cartesian::MARS
        }
        .banked(bank_rad)
    }

    fn inertial(model: &Spherical, x: &[f64; 6]) -> [f64; 6] {
        let ([x, y, z], [vx, vy, vz]) = (model.position(x), model.velocity(x));
        [x, y, z, vx, vy, vz]
    }

    proptest! {
        #[test]
        fn on_a_planet_at_rest_it_moves_as_the_spherical_model_does(
            x in spherical(), bank in -3.0..3.0f64, density in -0.3..0.3f64, lift in -0.3..0.3f64
        ) {
            let theirs = Spherical::MARS.banked(bank);
            let ours = same_world(&theirs, bank);
            let alpha = [f64::ln(1.0 + density), lift];
            let moved = ours.step(&inertial(&theirs, &x), &alpha, 0.005);
            let expected = inertial(&theirs, &theirs.step(&x, &[density, lift], 0.005));
            // Rounding of 3.5e6 m; a force wrong by 2e-5 m/s² would show.
            for i in 0..6 {
                prop_assert!((moved[i] - expected[i]).abs() < 1e-7, "{}: {} {}", i, moved[i], expected[i]);
            }
        }

        #[test]
        fn derivatives_through_the_step_agree_with_differences(
            x in spherical(), bank in -3.0..3.0f64, lift in -0.1..0.1f64
        ) {
            let model = Cartesian::<2>::MARS.banked(bank);
            let x = inertial(&Spherical::MARS, &x);
            let seeded: [Dual<8>; 6] = core::array::from_fn(|i| Dual::variable(x[i], i));
            let exact = model.step(&seeded, &[Dual::variable(0.1, 6), Dual::variable(lift, 7)], 1.0);
            let steps = [10.0, 10.0, 10.0, 0.1, 0.1, 0.1, 1e-4, 1e-4];
            let sizes = [1e4, 1e4, 1e4, 1e2, 1e2, 1e2];
            for j in 0..8 {
                let moved = |by: f64| {
                    let (mut x, mut alpha) = (x, [0.1, lift]);
                    if j < 6 { x[j] += by } else { alpha[j - 6] += by }
                    model.step(&x, &alpha, 1.0)
                };
                let (ahead, behind) = (moved(steps[j]), moved(-steps[j]));
                for i in 0..6 {
                    let difference = (ahead[i] - behind[i]) / (2.0 * steps[j]);
                    let scale = sizes[i] / (if j < 6 { sizes[j] } else { 1.0 });
                    prop_assert!((exact[i].partials[j] - difference).abs() < 1e-5 * scale, "{} {}", i, j);
                }
            }
        }

        #[test]
        fn a_turn_about_the_spin_turns_everything(x in spherical(), bank in -3.0..3.0f64, angle in -3.0..3.0f64) {
            let model = Cartesian::<1>::MARS.banked(bank);
            let x = inertial(&Spherical::MARS, &x);
            let turned = |[x, y, z, vx, vy, vz]: [f64; 6]| {
                let (s, c) = angle.sin_cos();
                [c * x - s * y, s * x + c * y, z, c * vx - s * vy, s * vx + c * vy, vz]
            };
            let (one, other) = (turned(model.step(&x, &[0.05], 0.1)), model.step(&turned(x), &[0.05], 0.1));
            for i in 0..6 {
                prop_assert!((one[i] - other[i]).abs() < 1e-7); // rounding of 3.5e6 m
            }
        }
    }

    #[test]
    fn at_p3s_entry_lift_is_up_and_a_quarter_of_the_drag() {
        let model = Cartesian::<1>::MARS;
        let force = |axis| model.specific_force(&ENTRY, &[0.0], axis);
        let f = [force(0), force(1), force(2)];
        let u = model.in_air(&ENTRY);
        let r = model.position(&ENTRY);
        let (speed, radius) = (dot(&u, &u).sqrt(), dot(&r, &r).sqrt());
        let drag = -dot(&f, &u) / speed;
        let size = dot(&f, &f).sqrt();
        assert!((size / drag - f64::hypot(1.0, 0.24)).abs() < 1e-12);
        // The lift's direction against the vertical: 0.964 (specification, section 1).
        let lift: [f64; 3] = core::array::from_fn(|i| (f[i] + drag * u[i] / speed) / (0.24 * drag));
        assert!((dot(&lift, &r) / radius - 0.964).abs() < 5e-4);
    }

    #[test]
    fn an_error_of_the_density_is_a_shift_in_altitude() {
        let model = Cartesian::<1>::MARS;
        let radius = dot(&model.position(&ENTRY), &model.position(&ENTRY)).sqrt();
        let lower = model.density(radius - 7_500.0 * 0.1, &[0.0]);
        assert!((model.density(radius, &[0.1]) / lower - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_vehicle_at_rest_in_the_air_gives_numbers_that_are_not_finite() {
        let rest = [3.5e6, 0.0, 0.0, 0.0, 3.5e6 * 7.0882e-5, 0.0];
        assert!(Cartesian::<1>::MARS.step(&rest, &[0.0], 1.0).iter().any(|x| !x.is_finite()));
    }
}
