//! The executive: schedule, modes, one-screen [`Executive::tick`], and the byte-stream shell around it.
//!
//! * [`schedule`] `const` table of slots, rates, offsets and budgets. * [`modes`] transition table.
//! * [`Executive`] all mutable state of the flight software; a snapshot is a copy.
//! * [`FlightComputer`] decodes bytes, answers commands, ticks once per minor frame, encodes what goes down.
//! * [`Board`] the flight computer on its hardware: byte stream by `embedded-io`, discretes by `embedded-hal`.
//!
//! In a program with an executive of its own, the core is one call per minor frame, and one per received packet where the
//! packets of the link are kept:
//!
//! ```
//! use fsw_core::executive::{Executive, FlightComputer};
//! use fsw_core::link::packet::{Imu, Mode, Pace};
//! use fsw_core::probe::{MeasuredCost, NoProbe};
//! use fsw_core::sensors::FrameInputs;
//! use fsw_core::time::MissionTime;
//!
//! // Values in, values out. On a target it stands in a static: `new` is const.
//! let mut flight = Executive::new();
//! // Here `flight.config.apply(&block)` takes the parameters of the mission, each block checked.
//! flight.config.validate().expect("the parameters fit together");
//! flight.arm()?;
//! assert!(flight.go(Pace::LockStep));
//! for frame in 1..=50 {
//!     let now = MissionTime::of_frame(frame);
//!     let inputs = FrameInputs { imu: Some((now, Imu::default())), ..FrameInputs::new() };
//!     let outputs = flight.tick(now, &inputs, &MeasuredCost::NONE, &mut NoProbe);
//!     assert!(outputs.actuator.bank_accel_radps2.is_finite());
//! }
//! assert_eq!(flight.mode(), Mode::Coast);
//!
//! // Or bytes of the link in, whole frames of the link out.
//! let mut computer = FlightComputer::new(7);
//! computer.receive(b"noise\0", |frame| panic!("{} bytes in answer to noise", frame.len()));
//! # Ok::<(), fsw_core::model::ModelError>(())
//! ```

mod board;
mod computer;
mod cost;
pub mod modes;
pub mod schedule;
mod tick;

pub use board::{Board, BoardError, Clock, Room};
pub use computer::{
    ANSWERS_PER_FRAME, Dormant, EVENTS_PER_BURST, FlightComputer, MAX_BRIDGED_FRAMES, MAX_UNCONFIRMED_GAP,
};
pub use cost::{CostLedger, WHOLE_FRAME};
pub use tick::{Executive, Outputs};
