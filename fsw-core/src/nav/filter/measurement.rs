//! The life of a measurement: observed (valid or not, innovation against the nominal state of its own frame), queued,
//! gated and used when the covariance of its epoch is ready, and told to telemetry in one uniform record either way.

use super::covariance::Covariance;
use super::layout::{ALL, Full, LOG_DENSITY, POSITION, PRESSURE_OFFSET, PRESSURE_SCALE, VELOCITY};
use crate::link::packet::{Innovation, MAX_INNOVATIONS, MeasurementKind, Verdict};
use crate::math::fun::sqrt;
use crate::math::gate::sigma_gate;
use crate::time::MissionTime;

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

    /// The change of the measurement that an error of the states makes.
    #[must_use]
    pub fn dot(&self, x: &Full) -> f64 {
        self.along(x) + self.in_air(x)
    }

    /// The part of position and velocity in it.
    #[inline(always)]
    #[allow(clippy::indexing_slicing)] // constant block offsets within a fixed array
    pub(super) fn along(&self, x: &Full) -> f64 {
        let ([rx, ry, rz], [vx, vy, vz]) = (self.position, self.velocity);
        let position = rx * x[POSITION] + ry * x[POSITION + 1] + rz * x[POSITION + 2];
        let velocity = vx * x[VELOCITY] + vy * x[VELOCITY + 1] + vz * x[VELOCITY + 2];
        position + velocity
    }

    /// The part of density and pressure.
    #[inline(always)]
    #[allow(clippy::indexing_slicing)] // constant places in a fixed array
    pub(super) fn in_air(&self, x: &Full) -> f64 {
        let pressure = self.pressure_scale * x[PRESSURE_SCALE] + self.pressure_offset * x[PRESSURE_OFFSET];
        self.log_density * x[LOG_DENSITY] + pressure
    }

    /// Whether there is such a part.
    pub(super) fn depends_on_air(&self) -> bool {
        !(self.log_density == 0.0 && self.pressure_scale == 0.0 && self.pressure_offset == 0.0)
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

/// Scalar update of `error` (found so far, about the nominal state of the epoch) and covariance.
///
/// `injected` is what was added to the nominal state at the epoch, after the innovation was formed. Gain K = u/S with
/// u = P h and S = hᵀu + R.
pub fn update(
    observation: &Observation,
    rule: &UpdateRule,
    injected: &Full,
    error: &mut Full,
    covariance: &mut Covariance,
) -> Innovation {
    let h = &observation.sensitivity;
    let (mut whitened, mut u): (Full, Full) = ([0.0; ALL], [0.0; ALL]);
    let variance = covariance.whiten(h, &mut whitened) + observation.noise_variance;
    let value = observation.innovation - h.dot(injected) - h.dot(error);
    if !rule.correcting {
        return observation.record(value, variance, Verdict::NotUsed);
    }
    if !sigma_gate(value, variance, rule.gate_sigma).accepted {
        return observation.record(value, variance, Verdict::Gated);
    }
    covariance.reduce(&whitened, observation.noise_variance, &mut u);
    let deviation = value / variance;
    for (x, u) in error.iter_mut().zip(&u) {
        *x += u * deviation;
    }
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
        Self::new()
    }
}

impl<T> Queue<T> {
    /// An empty one.
    pub const fn new() -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nav::filter::covariance::ProcessNoise;
    use crate::nav::filter::covariance::tests::{Dense, dense, started, transition};
    use std::boxed::Box;

    const OPEN: UpdateRule = UpdateRule { correcting: true, gate_sigma: 1e9 };

    fn correlated() -> Box<Covariance> {
        let (t, mut p) = (transition(), started());
        for _ in 0..200 {
            p.predict(&t, &ProcessNoise { velocity: 2e-8, attitude: 4e-11, log_density: 1e-5 });
        }
        p
    }

    fn observation(k: u32) -> Observation {
        let s = f64::from(k);
        Observation {
            kind: if k.is_multiple_of(2) { MeasurementKind::Pressure } else { MeasurementKind::Range },
            innovation: 40.0 + s,
            noise_variance: 100.0,
            sensitivity: Sensitivity {
                position: [-0.6, 0.3 - 0.1 * s, 0.7],
                velocity: [1.0, -2.0, 0.5 * s],
                log_density: if k.is_multiple_of(2) { 3000.0 } else { 0.0 },
                pressure_scale: if k.is_multiple_of(2) { 3000.0 } else { 0.0 },
                pressure_offset: if k.is_multiple_of(2) { 1.0 } else { 0.0 },
            },
            valid: true,
            ..Observation::default()
        }
    }

    #[test]
    fn the_update_is_the_dense_joseph_form() {
        let mut p = correlated();
        let mut error: Full = [0.0; ALL];
        let (mut expected, mut state) = (dense(&p), nalgebra::SVector::<f64, ALL>::zeros());
        for k in 0..6 {
            let o = observation(k);
            let unit = |j: usize| core::array::from_fn(|i| if i == j { 1.0 } else { 0.0 });
            let h = nalgebra::SVector::<f64, ALL>::from_fn(|j, _| o.sensitivity.dot(&unit(j)));
            let s = (h.transpose() * expected * h)[0] + o.noise_variance;
            let gain = expected * h / s;
            state += gain * (o.innovation - h.dot(&state));
            let a = Dense::identity() - gain * h.transpose();
            expected = a * expected * a.transpose() + gain * gain.transpose() * o.noise_variance;

            let record = update(&o, &OPEN, &[0.0; ALL], &mut error, &mut p);
            assert_eq!(record.verdict, Verdict::Used);
            assert!((f64::from(record.sigma) - s.sqrt()).abs() < 1e-6 * s.sqrt());
            let found = dense(&p);
            for i in 0..ALL {
                for j in 0..ALL {
                    let scale = (expected[(i, i)] * expected[(j, j)]).sqrt();
                    // Cancellation of up to 1e-4 of the variance before the update, at 1e-16.
                    assert!((found[(i, j)] - expected[(i, j)]).abs() <= 1e-9 * scale, "{k}: {i} {j}");
                }
            }
            (0..ALL).for_each(|i| {
                assert!((error[i] - state[i]).abs() <= 1e-9 * expected[(i, i)].sqrt(), "{k}: state {i}");
            });
        }
    }

    #[test]
    fn what_was_injected_is_taken_off_the_innovation() {
        let (mut p, o) = (correlated(), observation(1));
        let mut injected: Full = [0.0; ALL];
        injected[POSITION] = 10.0;
        let record = update(&o, &OPEN, &injected, &mut [0.0; ALL], &mut p);
        assert!((f64::from(record.value) - (41.0 + 6.0)).abs() < 1e-5);
    }

    #[test]
    fn an_outlier_is_gated_and_changes_nothing() {
        let (mut p, mut error) = (correlated(), [0.0; ALL]);
        let before = dense(&p);
        let o = Observation { innovation: 1e6, ..observation(1) };
        let rule = UpdateRule { correcting: true, gate_sigma: 5.0 };
        assert_eq!(update(&o, &rule, &[0.0; ALL], &mut error, &mut p).verdict, Verdict::Gated);
        assert_eq!((dense(&p), error), (before, [0.0; ALL]));
    }

    #[test]
    fn dead_reckoning_forms_innovations_and_corrects_nothing() {
        let (mut p, mut error) = (correlated(), [0.0; ALL]);
        let before = dense(&p);
        let rule = UpdateRule { correcting: false, gate_sigma: 5.0 };
        let record = update(&observation(1), &rule, &[0.0; ALL], &mut error, &mut p);
        assert!(record.verdict == Verdict::NotUsed && record.sigma > 0.0);
        assert_eq!((dense(&p), error), (before, [0.0; ALL]));
    }

    #[test]
    fn a_full_queue_counts_what_it_loses() {
        let mut queue = Queue::<u8>::default();
        (0..12).for_each(|k| queue.push(k));
        assert_eq!((queue.items().len(), queue.overflow()), (MAX_INNOVATIONS, 3));
        queue.clear();
        assert_eq!((queue.items().len(), queue.overflow()), (0, 3));
    }
}
