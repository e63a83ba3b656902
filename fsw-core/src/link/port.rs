//! Byte streams of the hardware.
