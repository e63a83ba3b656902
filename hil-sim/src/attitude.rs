//! Trim attitude: the body at its trim angle of attack about the air-relative velocity, zero sideslip, at a bank angle.

use fsw_core::frames::{Body, Inertial, Rot, Vec3};
use libm::sincos;

/// Directions of the flow at one instant, inertial axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowAxes {
    /// Along the air-relative velocity.
    pub forward: Vec3<Inertial>,
    /// Normal to it in the vertical plane, up: lift at zero bank.
    pub up: Vec3<Inertial>,
    /// To the right of it, horizontal: lift at a bank of +90°.
    pub right: Vec3<Inertial>,
}

/// An angle by its sine and cosine, for those who need them more than once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    sine: f64,
    cosine: f64,
}

impl Turn {
    /// Of an angle.
    #[must_use]
    pub fn new(angle_rad: f64) -> Self {
        let (sine, cosine) = sincos(angle_rad);
        Self { sine, cosine }
    }
}

impl FlowAxes {
    /// Axes from position and air-relative velocity. In vertical flight, where "up" is undefined, a fixed direction stands in.
    #[must_use]
    pub fn new(r_i: &Vec3<Inertial>, v_air_i: &Vec3<Inertial>) -> Self {
        let forward = v_air_i.unit().unwrap_or(Vec3::new(1.0, 0.0, 0.0));
        let normal = |v: &Vec3<Inertial>| (*v - forward * forward.dot(v)).unit();
        // A component below 1e-12 of the radius is no plane; unit() refuses it on the scaled vector.
        let up = r_i
            .unit()
            .and_then(|vertical| normal(&vertical))
            .or_else(|| normal(&Vec3::new(0.0, 0.0, 1.0)))
            .or_else(|| normal(&Vec3::new(1.0, 0.0, 0.0)))
            .unwrap_or(Vec3::new(0.0, 0.0, 1.0));
        Self { forward, up, right: forward.cross(&up) }
    }

    /// Direction of the lift at a bank angle.
    #[must_use]
    pub fn lift(&self, bank_rad: f64) -> Vec3<Inertial> {
        self.lift_at(&Turn::new(bank_rad))
    }

    /// The same of a bank by its sine and cosine.
    #[must_use]
    pub fn lift_at(&self, bank: &Turn) -> Vec3<Inertial> {
        self.up * bank.cosine + self.right * bank.sine
    }

    /// Attitude body → inertial at a bank angle and a trim angle of attack α: the velocity in body axes is
    /// V (cos α, 0, sin α), the lift direction (sin α, 0, −cos α).
    #[must_use]
    pub fn attitude_bi(&self, bank_rad: f64, angle_of_attack_rad: f64) -> Rot<Body, Inertial> {
        self.attitude_at(&Turn::new(bank_rad), &Turn::new(angle_of_attack_rad))
    }

    /// The same of both angles by their sine and cosine.
    #[must_use]
    pub fn attitude_at(&self, bank: &Turn, angle_of_attack: &Turn) -> Rot<Body, Inertial> {
        let Turn { sine: sin_alpha, cosine: cos_alpha } = *angle_of_attack;
        let lift = self.lift_at(bank);
        let x_b = self.forward * cos_alpha + lift * sin_alpha;
        let z_b = self.forward * sin_alpha - lift * cos_alpha;
        // Orthonormal by construction, so the identity is never taken.
        Rot::from_columns(&x_b, &z_b.cross(&x_b), &z_b).unwrap_or_else(Rot::identity)
    }
}

/// Specific force in body axes from drag and lift acceleration (or their integrals over time), at the angle of attack.
#[must_use]
pub fn force_b(drag: f64, lift: f64, angle_of_attack: &Turn) -> Vec3<Body> {
    let Turn { sine: s, cosine: c } = *angle_of_attack;
    Vec3::new(-drag * c + lift * s, 0.0, -drag * s - lift * c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::frames::bank_from_attitude;

    fn flow() -> (Vec3<Inertial>, Vec3<Inertial>) {
        (Vec3::new(2.9e6, -1.4e6, 1.1e6), Vec3::new(1200.0, 3900.0, -2400.0))
    }

    #[test]
    fn the_bank_of_the_attitude_is_the_bank_given() {
        let (r, v) = flow();
        for bank in [-3.0, -1.0, 0.0, 0.4, 2.5] {
            let attitude = FlowAxes::new(&r, &v).attitude_bi(bank, -0.28);
            assert!((bank_from_attitude(&attitude, &r, &v).unwrap() - bank).abs() < 1e-12);
        }
    }

    #[test]
    fn the_velocity_in_body_axes_shows_the_angle_of_attack_and_no_sideslip() {
        let (r, v) = flow();
        let alpha = -16f64.to_radians();
        let v_b = FlowAxes::new(&r, &v).attitude_bi(0.9, alpha).inverse().apply(&v);
        assert!((v_b - Vec3::new(alpha.cos(), 0.0, alpha.sin()) * v.norm()).norm() < 1e-9);
    }

    #[test]
    fn the_sensed_force_points_where_the_specification_says() {
        let at = |degrees: f64| force_b(1.45, 0.24 * 1.45, &Turn::new(degrees.to_radians()));
        assert!((at(-16.0) - Vec3::new(-1.490, 0.0, 0.065)).norm() < 1e-3);
        assert!((at(16.0).z() - -0.73).abs() < 5e-3);
    }

    #[test]
    fn lift_in_body_axes_agrees_with_lift_in_inertial_axes() {
        let (r, v) = flow();
        let flow = FlowAxes::new(&r, &v);
        let expected = flow.lift(-0.6) * 3.0 - flow.forward * 11.0;
        let turned = flow.attitude_bi(-0.6, -0.28).apply(&force_b(11.0, 3.0, &Turn::new(-0.28)));
        assert!((turned - expected).norm() < 1e-13);
    }

    #[test]
    fn vertical_flight_still_has_axes() {
        let axes = FlowAxes::new(&Vec3::new(3e6, 0.0, 0.0), &Vec3::new(-300.0, 0.0, 0.0));
        assert!((axes.forward.cross(&axes.up) - axes.right).norm() < 1e-12 && (axes.up.norm() - 1.0).abs() < 1e-12);
    }
}
