//! Sensor data on its way in: collected over a minor frame, judged, compensated, handed on as one [`Batch`].
//!
//! Nothing here stops the loop: a measurement is either fit for use or counted under the cause that rules it out.

mod accept;
mod inputs;
pub mod limits;
mod stuck;

pub use accept::{Batch, ImuIncrement, PressureMeasurement, RadioMeasurement, accept};
pub use inputs::FrameInputs;
pub use stuck::{MAX_EQUAL_FRAMES, MAX_EQUAL_PRESSURES, StuckMonitor};
