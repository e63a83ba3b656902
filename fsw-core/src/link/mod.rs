//! The byte stream: packets, their parameters, framing, order and the handshake.
//!
//! A packet travels as postcard bytes, followed by their CRC-32 (little endian), byte-stuffed with COBS and closed by
//! `0x00`. [`framing`] turns values into such bytes and back, [`receiver`] adds order and counting by cause,
//! [`handshake`] refuses a peer of another protocol. `doc/icd.md` is the document for the other side.

pub mod discretes;
pub mod framing;
pub mod handshake;
pub mod packet;
pub mod parameters;
pub mod port;
pub mod receiver;
pub mod schema;
pub mod sequence;
