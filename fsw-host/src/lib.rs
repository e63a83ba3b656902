//! Host harness: connects the truth simulator to the flight computer, records the flight, measures it and shows it.
//!
//! The binary `aeroshell` is a thin command line over this library: [`cli`] reads the arguments, one module per
//! command does the work, and everything a flight leaves behind passes through one [`record::FlightRecord`].

pub mod bound;
pub mod campaign;
pub mod cli;
pub mod columns;
pub mod cost;
pub mod cycles;
pub mod ends;
pub mod error;
pub mod fly;
pub mod footprint;
pub mod interrupt;
pub mod linklog;
pub mod measure;
pub mod output;
pub mod progress;
pub mod propagate;
pub mod pump;
pub mod rank;
pub mod realtime;
pub mod record;
pub mod recorded;
pub mod recorder;
pub mod replay;
pub mod report;
pub mod runfolder;
pub mod scenarios;
pub mod screen;
pub mod study;
pub mod summary;
pub mod sweep;
pub mod tables;
pub mod tap;
pub mod target;
pub mod telemetry;
pub mod wcet;
