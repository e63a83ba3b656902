//! Discrete outputs of the hardware.
