//! [`Onboard`]: the vehicle and the air of the onboard model, in inertial axes: what the papers' filters fly with on the real
//! packets. Oblate planet, air that turns with it, drag and lift by Mach number, bank and body axes from the strapdown.

use super::{AXES, Air, Process, Vehicle};
use crate::math::{Scalar, rk4};
use crate::model::OnboardModel;
use crate::model::entry::{Constants, Environment, cartesian_rates_and_flow};
use crate::planet::Planet;

/// State: inertial position (m) and velocity (m/s). Parameters: natural logarithm of density over that of the onboard model, and
/// relative error of the lift coefficient.
#[derive(Clone, Copy, Debug)]
pub struct Onboard<'a> {
    model: &'a OnboardModel,
    /// Of the equations of motion in axes that do not turn.
    inertial: Constants,
    /// The same without gravity: what an accelerometer feels.
    weightless: Constants,
    cos_bank: f64,
    sin_bank: f64,
    /// Each body axis, in inertial axes.
    body_axes: [[f64; AXES]; AXES],
}

/// The onboard model with the filter's parameters in it, on a planet that does not turn: its velocity is relative to the air.
struct World<'a, S> {
    model: &'a OnboardModel,
    constants: &'a Constants,
    density_ratio: S,
    lift_ratio: S,
}

impl<S: Scalar> Environment<S> for World<'_, S> {
    #[inline(always)]
    fn planet(&self) -> &Planet {
        &self.model.planet
    }
    #[inline(always)]
    fn constants(&self) -> &Constants {
        self.constants
    }
    #[inline(always)]
    fn density_kgpm3(&self, altitude_m: S) -> S {
        self.model.atmosphere.density(altitude_m) * self.density_ratio
    }
    #[inline(always)]
    fn drag_and_lift_coefficients(&self, altitude_m: S, speed_mps: S) -> (S, S) {
        let (drag, lift) = self.model.drag_and_lift_coefficients(altitude_m, speed_mps);
        (drag, lift * self.lift_ratio)
    }
}

impl<'a> Onboard<'a> {
    /// At a bank (cosine and sine; 0 lift up, positive to the right) and with these body axes, each in inertial axes.
    #[must_use]
    pub fn new(model: &'a OnboardModel, (cos_bank, sin_bank): (f64, f64), body_axes: [[f64; AXES]; AXES]) -> Self {
        let inertial = Constants { twice_rotation_radps: 0.0, rotation_square: 0.0, ..*model.constants() };
        let weightless = Constants { mu_m3ps2: 0.0, ..inertial };
        Self { model, inertial, weightless, cos_bank, sin_bank, body_axes }
    }

    /// Velocity relative to the air, which turns with the planet.
    #[inline(always)]
    fn air_relative<S: Scalar>(&self, state: &[S; 6]) -> [S; 6] {
        let [x, y, z, vx, vy, vz] = *state;
        let spin = self.model.planet.rotation_radps;
        [x, y, z, vx + y * spin, vy - x * spin, vz]
    }

    /// Acceleration, and density and speed relative to the air on the way to it. Never inlined: each width of derivatives
    /// is this code once.
    #[inline(never)]
    fn acceleration<S: Scalar>(&self, constants: &Constants, state: &[S; 6], ratios: &[S; 2]) -> ([S; AXES], Air<S>) {
        let [density_ratio, lift_ratio] = *ratios;
        let world = World { model: self.model, constants, density_ratio, lift_ratio };
        let (cosine, sine) = (S::from_f64(self.cos_bank), S::from_f64(self.sin_bank));
        let (rates, flow) = cartesian_rates_and_flow(&world, &self.air_relative(state), cosine, sine);
        let [_, _, _, ax, ay, az] = rates;
        let air = Air { density_kgpm3: flow.density_kgpm3, speed_square: flow.speed_mps * flow.speed_mps };
        ([ax, ay, az], air)
    }

    fn ratios<S: Scalar>(parameters: &[S; 2]) -> [S; 2] {
        let [log_density, lift_error] = *parameters;
        [log_density.exp(), lift_error + 1.0]
    }

    /// Specific force (inertial axes, m/s²) and the air it comes from.
    pub(super) fn force_and_air<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2]) -> ([S; AXES], Air<S>) {
        self.acceleration(&self.weightless, state, &Self::ratios(parameters))
    }

    pub(super) const fn planet(&self) -> &Planet {
        &self.model.planet
    }

    pub(super) const fn spin_radps(&self) -> f64 {
        self.model.planet.rotation_radps
    }

    pub(super) const fn body_axes(&self) -> &[[f64; AXES]; AXES] {
        &self.body_axes
    }

    /// Inertial acceleration, m/s².
    #[must_use]
    pub fn total_acceleration(&self, state: &[f64; 6], parameters: &[f64; 2]) -> [f64; AXES] {
        self.acceleration(&self.inertial, state, &Self::ratios(parameters)).0
    }
}

impl Process<6, 2> for Onboard<'_> {
    /// One Runge–Kutta step at constant bank.
    #[inline(never)]
    fn step<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2], step_s: f64) -> [S; 6] {
        let ratios = Self::ratios(parameters);
        rk4(state, step_s, |_, state| {
            let ([ax, ay, az], _) = self.acceleration(&self.inertial, state, &ratios);
            let [_, _, _, vx, vy, vz] = *state;
            [vx, vy, vz, ax, ay, az]
        })
    }
}

impl Vehicle<6, 2> for Onboard<'_> {
    fn air<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2]) -> Air<S> {
        self.acceleration(&self.weightless, state, &Self::ratios(parameters)).1
    }

    /// Body axes.
    fn specific_force<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2], axis: usize) -> S {
        let ([x, y, z], _) = self.acceleration(&self.weightless, state, &Self::ratios(parameters));
        let [cx, cy, cz] = self.body_axes.get(axis).copied().unwrap_or([f64::NAN; AXES]);
        x * cx + y * cy + z * cz
    }

    fn position<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        let [x, y, z, ..] = *state;
        [x, y, z]
    }

    fn velocity<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        let [_, _, _, vx, vy, vz] = *state;
        [vx, vy, vz]
    }
}

/// The same vehicle a little earlier than the state says: readings of a window are taken in at its end.
#[derive(Clone, Copy, Debug)]
pub struct Earlier<'a> {
    /// The vehicle.
    pub vehicle: &'a Onboard<'a>,
    /// How much earlier, s; up to some tenths.
    pub age_s: f64,
    /// Its inertial acceleration meanwhile, m/s².
    pub acceleration_mps2: [f64; AXES],
}

impl Earlier<'_> {
    /// r − v·age + ½a·age², v − a·age.
    fn back<S: Scalar>(&self, state: &[S; 6]) -> [S; 6] {
        let [x, y, z, vx, vy, vz] = *state;
        let [ax, ay, az] = self.acceleration_mps2;
        let (age, half_square) = (self.age_s, 0.5 * self.age_s * self.age_s);
        [
            x - vx * age + half_square * ax,
            y - vy * age + half_square * ay,
            z - vz * age + half_square * az,
            vx - age * ax,
            vy - age * ay,
            vz - age * az,
        ]
    }
}

impl Process<6, 2> for Earlier<'_> {
    fn step<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2], step_s: f64) -> [S; 6] {
        self.vehicle.step(state, parameters, step_s)
    }
}

impl Vehicle<6, 2> for Earlier<'_> {
    fn air<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2]) -> Air<S> {
        self.vehicle.air(&self.back(state), parameters)
    }
    fn specific_force<S: Scalar>(&self, state: &[S; 6], parameters: &[S; 2], axis: usize) -> S {
        self.vehicle.specific_force(&self.back(state), parameters, axis)
    }
    fn position<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        self.vehicle.position(&self.back(state))
    }
    fn velocity<S: Scalar>(&self, state: &[S; 6]) -> [S; AXES] {
        self.vehicle.velocity(&self.back(state))
    }
}

#[cfg(test)]
#[allow(clippy::needless_range_loop, reason = "row and column indices are used together")]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::math::Dual;
    use crate::model::entry::cartesian_rates;
    use proptest::prelude::*;

    fn onboard() -> OnboardModel {
        let c = Config::DEFAULT;
        OnboardModel::new(c.planet, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
    }

    const AXES_AS_THEY_ARE: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn flight() -> impl Strategy<Value = ([f64; 6], f64, [f64; 2])> {
        let position = (3.41e6..3.5e6f64, -1.2..1.2f64, -3.0..3.0f64)
            .prop_map(|(r, lat, lon)| [r * lat.cos() * lon.cos(), r * lat.cos() * lon.sin(), r * lat.sin()]);
        let velocity = prop::array::uniform3(-3000.0..3000.0f64);
        (position, velocity, -3.0..3.0f64, prop::array::uniform2(-0.3..0.3f64))
            .prop_map(|([x, y, z], [a, b, c], bank, alpha)| ([x, y, z, a + 500.0, b, c], bank, alpha))
    }

    proptest! {
        #[test]
        fn the_motion_is_that_of_the_predictor_seen_from_axes_that_do_not_turn((x, bank, _) in flight()) {
            let model = onboard();
            let vehicle = Onboard::new(&model, (bank.cos(), bank.sin()), AXES_AS_THEY_ARE);
            let [rx, ry, rz, ..] = x;
            // Both axes coincide at this instant; theirs turn.
            let spin = model.planet.rotation_radps;
            let relative = vehicle.air_relative(&x);
            let [_, _, _, vx, vy, _] = relative;
            let rates = cartesian_rates(&model, &relative, bank.cos(), bank.sin());
            // a_i = a_rel + 2 ω×v_rel + ω×(ω×r)
            let expected = [
                rates[3] - 2.0 * spin * vy - spin * spin * rx,
                rates[4] + 2.0 * spin * vx - spin * spin * ry,
                rates[5],
            ];
            let _ = rz;
            let found = vehicle.total_acceleration(&x, &[0.0; 2]);
            for (a, b) in found.iter().zip(expected) {
                prop_assert!((a - b).abs() < 1e-11 * (1.0 + b.abs()), "{a} {b}");
            }
        }

        #[test]
        fn derivatives_through_the_step_and_the_force_agree_with_differences((x, bank, alpha) in flight()) {
            let model = onboard();
            let vehicle = Onboard::new(&model, (bank.cos(), bank.sin()), [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]);
            let acceleration_mps2 = vehicle.total_acceleration(&x, &alpha);
            let earlier = Earlier { vehicle: &vehicle, age_s: 0.05, acceleration_mps2 };
            let seeded: [Dual<8>; 6] = core::array::from_fn(|i| Dual::variable(x[i], i));
            let seeds = [Dual::<8>::variable(alpha[0], 6), Dual::variable(alpha[1], 7)];
            let exact = vehicle.step(&seeded, &seeds, 0.1);
            let force: Dual<8> = earlier.specific_force(&seeded, &seeds, 2);
            let steps = [10.0, 10.0, 10.0, 0.1, 0.1, 0.1, 1e-4, 1e-4];
            let moved = |j: usize, by: f64| {
                let (mut x, mut alpha) = (x, alpha);
                if j < 6 { x[j] += by } else { alpha[j - 6] += by }
                (vehicle.step(&x, &alpha, 0.1), earlier.specific_force(&x, &alpha, 2))
            };
            // Forces reach some 1000 m/s² here: relative to what a change of each kind makes of them.
            let [ax, ay, az] = vehicle.acceleration(&vehicle.weightless, &x, &Onboard::ratios(&alpha)).0;
            let size = 1.0 + ax.abs() + ay.abs() + az.abs();
            for j in 0..8 {
                let (ahead, behind) = (moved(j, steps[j]), moved(j, -steps[j]));
                let scale = if j < 3 { 1e-4 } else if j < 6 { 1e-2 } else { 1.0 };
                for i in 0..6 {
                    let difference = (ahead.0[i] - behind.0[i]) / (2.0 * steps[j]);
                    let tolerance = 1e-5 * (size * scale + if i == j || i + 3 == j { 1.0 } else { 0.0 });
                    prop_assert!((exact[i].partials[j] - difference).abs() < tolerance, "{i} {j}: {} {difference}", exact[i].partials[j]);
                }
                let difference = (ahead.1 - behind.1) / (2.0 * steps[j]);
                prop_assert!((force.partials[j] - difference).abs() < 1e-5 * size * scale, "{j}");
            }
        }

        #[test]
        fn the_same_vehicle_earlier_is_where_it_came_from((x, bank, alpha) in flight()) {
            let model = onboard();
            let vehicle = Onboard::new(&model, (bank.cos(), bank.sin()), AXES_AS_THEY_ARE);
            let acceleration_mps2 = vehicle.total_acceleration(&x, &alpha);
            let earlier = Earlier { vehicle: &vehicle, age_s: 0.05, acceleration_mps2 };
            let then = vehicle.step(&x, &alpha, -0.05);
            let size = 1.0 + acceleration_mps2.iter().map(|a| a.abs()).sum::<f64>();
            for (a, b) in earlier.back(&x).iter().zip(then) {
                // What is left out is the change of the acceleration.
                prop_assert!((a - b).abs() < 0.05 * 0.05 * size, "{a} {b}");
            }
        }
    }
}
