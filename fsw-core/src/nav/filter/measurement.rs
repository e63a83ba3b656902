//! The life of a measurement: observed (valid or not, innovation against the nominal state of its own frame), queued,
//! gated and used when the covariance of its epoch is ready, and told to telemetry in one uniform record either way.

use super::covariance::Covariance;
use super::layout::{
    AXES, ESTIMATED, Estimated, Full, LOG_DENSITY, POSITION, PRESSURE_OFFSET, PRESSURE_SCALE, VELOCITY,
};
use crate::link::packet::{Innovation, MAX_INNOVATIONS, MeasurementKind, Verdict};
use crate::math::fun::sqrt;
use crate::math::gate::sigma_gate;
use crate::time::MissionTime;

/// Columns that a measurement can touch: position, velocity, log-density, pressure scale and offset.
const TOUCHED: usize = 2 * AXES + 3;

/// Derivative of a measurement with respect to the error states; all others are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensitivity {
    /// With respect to position, per m.
    pub position: [f64; 3],
    /// With respect to velocity, per m/s.
    pub velocity: [f64; 3],
    /// With respect to log-density.
    pub log_density: f64,
    /// With respect to the pressure scale.
    pub pressure_scale: f64,
    /// With respect to the pressure offset.
    pub pressure_offset: f64,
}

impl Sensitivity {
    /// The same measurement in terms of the errors `age_s` later: δr = δr₊ − δv₊·age, to first order in 0.1 s.
    #[must_use]
    pub fn seen_from_later(&self, age_s: f64) -> Self {
        let ([x, y, z], [vx, vy, vz]) = (self.position, self.velocity);
        Self { velocity: [vx - age_s * x, vy - age_s * y, vz - age_s * z], ..*self }
    }

    fn columns(&self) -> [(usize, f64); TOUCHED] {
        let ([x, y, z], [vx, vy, vz]) = (self.position, self.velocity);
        [
            (POSITION, x),
            (POSITION + 1, y),
            (POSITION + 2, z),
            (VELOCITY, vx),
            (VELOCITY + 1, vy),
            (VELOCITY + 2, vz),
            (LOG_DENSITY, self.log_density),
            (PRESSURE_SCALE, self.pressure_scale),
            (PRESSURE_OFFSET, self.pressure_offset),
        ]
    }

    /// The change of the measurement that an error of the estimated states makes.
    #[must_use]
    pub fn dot(&self, x: &Estimated) -> f64 {
        self.columns().iter().map(|&(j, h)| h * x.get(j).copied().unwrap_or(0.0)).sum()
    }

    fn dot_all(&self, x: &Full) -> f64 {
        self.columns().iter().map(|&(j, h)| h * x.get(j).copied().unwrap_or(0.0)).sum()
    }
}

/// One scalar measurement against the nominal state of its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Time of the measurement.
    pub time: MissionTime,
    /// What was measured.
    pub kind: MeasurementKind,
    /// Slot of the source; 0 for pressure.
    pub source: u8,
    /// Measured minus predicted.
    pub innovation: f64,
    /// Variance of its white noise.
    pub noise_variance: f64,
    /// Derivative of the prediction.
    pub sensitivity: Sensitivity,
    /// False when the model does not hold here.
    pub valid: bool,
}

impl Observation {
    /// The uniform record.
    #[must_use]
    pub fn record(&self, value: f64, variance: f64, verdict: Verdict) -> Innovation {
        let sigma = if variance > 0.0 { sqrt(variance) } else { 0.0 };
        Innovation {
            time: self.time,
            kind: self.kind,
            source: self.source,
            value: value as f32,
            sigma: sigma as f32,
            verdict,
        }
    }
}

/// How innovations become corrections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpdateRule {
    /// False: innovations are formed and recorded, nothing is corrected.
    pub correcting: bool,
    /// Innovations beyond this many standard deviations are gated.
    pub gate_sigma: f64,
}

/// Scalar Schmidt update of `error` (estimated so far, about the nominal state of the epoch) and covariance.
///
/// `injected` is what was added to the nominal state at the epoch, after the innovation was formed. Gain K = u_x/S with
/// u = P h and S = hᵀu + R; considered states keep gain zero, so P_xx −= u_x u_xᵀ/S, P_xc −= u_x u_cᵀ/S, P_cc stays
/// (Schmidt 1966; Bierman 1977, §VIII.2). In exact arithmetic this is the Joseph form with that gain.
pub fn update(
    observation: &Observation,
    rule: &UpdateRule,
    injected: &Estimated,
    error: &mut Estimated,
    covariance: &mut Covariance,
) -> Innovation {
    let h = &observation.sensitivity;
    let mut u: Full = [0.0; super::layout::ALL];
    covariance.times(&h.columns(), &mut u);
    let variance = h.dot_all(&u) + observation.noise_variance;
    let value = observation.innovation - h.dot(injected) - h.dot(error);
    if !rule.correcting {
        return observation.record(value, variance, Verdict::NotUsed);
    }
    if !sigma_gate(value, variance, rule.gate_sigma).accepted {
        return observation.record(value, variance, Verdict::Gated);
    }
    for (x, gain) in error.iter_mut().zip(u.iter().take(ESTIMATED)) {
        *x += gain * value / variance;
    }
    covariance.reduce(&u, variance);
    observation.record(value, variance, Verdict::Used)
}

/// A bounded list of things that came up since it was last emptied; what does not fit is counted.
#[derive(Clone, Debug)]
pub struct Queue<T> {
    items: heapless::Vec<T, MAX_INNOVATIONS>,
    overflow: u16,
}

impl<T> Default for Queue<T> {
    fn default() -> Self {
        Self { items: heapless::Vec::new(), overflow: 0 }
    }
}

impl<T> Queue<T> {
    /// Adds an item, or counts it as lost when the queue is full.
    pub fn push(&mut self, item: T) {
        if self.items.push(item).is_err() {
            self.overflow = self.overflow.saturating_add(1);
        }
    }

    /// The items in the order they came.
    #[must_use]
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Empties the queue; the overflow count stays.
    pub fn clear(&mut self) {
        self.items.clear();
    }

    /// Items lost so far.
    #[must_use]
    pub fn overflow(&self) -> u16 {
        self.overflow
    }
}
