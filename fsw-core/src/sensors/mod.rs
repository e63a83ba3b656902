//! Sensor data on its way in: collected over a minor frame, judged, compensated, handed on as one [`Batch`].
//!
//! Nothing here stops the loop: a measurement is either fit for use or counted under the cause that rules it out.

mod accept;
mod inputs;
pub mod limits;

pub use accept::{Batch, ImuIncrement, PressureMeasurement, RadioMeasurement, accept};
pub use inputs::FrameInputs;
