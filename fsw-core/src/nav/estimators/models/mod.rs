//! What the estimators know of the world, written once: [`Process`] moves a state by one step, [`Measurement`] says what a
//! sensor should read. Both are generic in the scalar, so that derivatives (through the whole Runge–Kutta step, with respect
//! to state and parameters) come from the very equations that give the values.
//!
//! **The contract with the kernels.** `N` is the size of the state x, `P` that of the parameters α, the quantities the
//! filter may be wrong about: factors, zero when the nominal model holds (density, lift). A model holds no estimate and
//! no time: everything that changes comes in as an argument or is set in the model by its user before the step (bank).
//! Models neither check nor fail; where equations have no value (at rest, over the pole) the result is not finite, and the
//! kernels turn that into an [`EstimatorError`](super::EstimatorError).
//!
//! * A linearised kernel evaluates with [`Dual`](crate::math::Dual) of width N (or N + P when α is estimated).
//! * A divided-difference kernel evaluates with `f64`, and for its sensitivities with duals of width P that are seeded
//!   with any direction in (x, α).
//!
//! [`Vehicle`] is what [`Sensor`] asks of a model; with it all sensors are written once for all kinds of state.

mod cartesian;
mod near;
mod onboard;
mod sensors;
mod spherical;

pub use cartesian::Cartesian;
pub use near::{Line, Near};
pub use onboard::{Earlier, Onboard};
pub use sensors::{Noise, Quantity, Reading, Sensor};
pub use spherical::{HEADING, LATITUDE, LONGITUDE, PATH_ANGLE, RADIUS, SPEED, Spherical};

use crate::math::Scalar;

/// Axes of a force or a position.
pub const AXES: usize = 3;

/// How a state of `N` numbers moves, given `P` parameters.
pub trait Process<const N: usize, const P: usize> {
    /// The state `step_s` later: F(x, α).
    fn step<S: Scalar>(&self, state: &[S; N], parameters: &[S; P], step_s: f64) -> [S; N];
}

/// A scalar measurement z = h(x, α) + noise.
pub trait Measurement<const N: usize, const P: usize> {
    /// What it should read: h(x, α).
    fn expected<S: Scalar>(&self, state: &[S; N], parameters: &[S; P]) -> S;

    /// Variance of its white noise where it should read `expected`; positive.
    fn variance(&self, expected: f64) -> f64;

    /// Read minus expected; a measurement of an angle wraps it.
    fn innovation(&self, read: f64, expected: f64) -> f64 {
        read - expected
    }

    /// Which component of a constant sensor bias adds to the reading, when the filter knows of one.
    fn bias_axis(&self) -> Option<usize> {
        None
    }
}

/// Air around the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air<S> {
    /// Density, kg/m³, with the parameters' part.
    pub density_kgpm3: S,
    /// Square of the speed relative to it, m²/s².
    pub speed_square: S,
}

/// A vehicle in the air of a planet: what sensors can see of it.
pub trait Vehicle<const N: usize, const P: usize>: Process<N, P> {
    /// The air it flies through.
    fn air<S: Scalar>(&self, state: &[S; N], parameters: &[S; P]) -> Air<S>;
    /// Specific force along an axis (0, 1, 2) of its accelerometer triad, m/s²; which axes those are is the model's to say.
    fn specific_force<S: Scalar>(&self, state: &[S; N], parameters: &[S; P], axis: usize) -> S;
    /// Position in the axes in which radio sources are given, m.
    fn position<S: Scalar>(&self, state: &[S; N]) -> [S; AXES];
    /// Velocity in those axes, m/s.
    fn velocity<S: Scalar>(&self, state: &[S; N]) -> [S; AXES];
}
