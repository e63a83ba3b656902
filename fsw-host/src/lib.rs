//! Host harness: connects the truth simulator to the flight computer, records the flight, measures it and shows it.
//!
//! The binary `aeroshell` is a thin command line over this library: [`cli`] reads the arguments, one module per
//! command does the work, and everything a flight leaves behind passes through one [`record::FlightRecord`].

pub mod cli;
pub mod record;
pub mod report;
