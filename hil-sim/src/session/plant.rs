//! [`Plant`]: what a conductor flies.

use fsw_core::link::packet;

use crate::truth::{FramePackets, Truth};

/// What the conductor flies.
pub trait Plant {
    /// One minor frame under a bank command.
    fn advance(&mut self, bank_accel_radps2: f64, bank_rate_radps: f64);
    /// What the sensors said at its end.
    fn packets(&self) -> &FramePackets;
    /// The true state.
    fn truth(&self) -> packet::Truth;
    /// Altitude over the reference sphere, m.
    fn altitude_m(&self) -> f64;
}

impl Plant for Truth {
    fn advance(&mut self, bank_accel_radps2: f64, bank_rate_radps: f64) {
        Self::advance(self, bank_accel_radps2, bank_rate_radps);
    }

    fn packets(&self) -> &FramePackets {
        self.frame_packets()
    }

    fn truth(&self) -> packet::Truth {
        self.packet()
    }

    fn altitude_m(&self) -> f64 {
        Self::altitude_m(self)
    }
}
