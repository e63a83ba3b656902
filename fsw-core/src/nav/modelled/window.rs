//! [`Window`]: what the strapdown and the sensors said over the five frames between two epochs of a model-based filter.

use crate::frames::{Body, Inertial, Rot};
use crate::link::packet::{Innovation, MAX_INNOVATIONS, MeasurementKind, Verdict};
use crate::math::fun::sqrt;
use crate::nav::estimators::models::{AXES, Noise, Quantity};
use crate::nav::filter::measurement::Queue;
use crate::nav::strapdown::StepRecord;
use crate::time::{FRAME, MissionTime};

/// A reading that a filter takes in at the end of its window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Time of the measurement.
    pub time: MissionTime,
    /// What telemetry calls it.
    pub kind: MeasurementKind,
    /// Slot of the source; 0 for pressure.
    pub source: u8,
    /// What was measured.
    pub quantity: Quantity,
    /// How well.
    pub noise: Noise,
    /// The reading.
    pub value: f64,
    /// How long before the end of the window.
    pub age_s: f64,
}

impl Sight {
    /// The uniform record of telemetry.
    #[must_use]
    pub fn record(&self, value: f64, variance: f64, verdict: Verdict) -> Innovation {
        let sigma = if variance > 0.0 { sqrt(variance) } else { 0.0 };
        let (kind, source) = (self.kind, self.source);
        Innovation { time: self.time, kind, source, value: value as f32, sigma: sigma as f32, verdict }
    }
}

/// Sums over the frames of a window.
#[derive(Clone, Debug)]
pub struct Window {
    frames: u8,
    /// Velocity increments of the specific force, inertial axes.
    delta_v_mps: [f64; AXES],
    /// Body axes in inertial axes, summed over the frames.
    body_axes: [[f64; AXES]; AXES],
    cos_bank: f64,
    sin_bank: f64,
    /// A frame had no inertial measurement: its force is the model's own.
    bridged: bool,
    /// Radio and pressure.
    pub sights: Queue<Sight>,
}

impl Default for Window {
    fn default() -> Self {
        Self::new()
    }
}

impl Window {
    /// A window that has just begun.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            frames: 0,
            delta_v_mps: [0.0; AXES],
            body_axes: [[0.0; AXES]; AXES],
            cos_bank: 0.0,
            sin_bank: 0.0,
            bridged: false,
            sights: Queue::new(),
        }
    }

    /// Begins again, in place.
    pub fn clear(&mut self) {
        let Self { frames, delta_v_mps, body_axes, cos_bank, sin_bank, bridged, sights } = self;
        sights.clear();
        (*frames, *bridged) = (0, false);
        (*delta_v_mps, *body_axes) = ([0.0; AXES], [[0.0; AXES]; AXES]);
        (*cos_bank, *sin_bank) = (0.0, 0.0);
    }

    /// Adds a frame: what the strapdown felt, the mean attitude, the bank, and whether the frame was bridged.
    pub fn add(
        &mut self,
        record: &StepRecord,
        attitudes: (&Rot<Body, Inertial>, &Rot<Body, Inertial>),
        (cos_bank, sin_bank): (f64, f64),
        bridged: bool,
    ) {
        self.frames = self.frames.saturating_add(1);
        for (sum, part) in self.delta_v_mps.iter_mut().zip(record.delta_v_i.to_array()) {
            *sum += part;
        }
        let mean = (attitudes.0.dcm() + attitudes.1.dcm()) * 0.5;
        for (axis, column) in self.body_axes.iter_mut().zip(mean.column_iter()) {
            axis.iter_mut().zip(column.iter()).for_each(|(sum, part)| *sum += part);
        }
        self.cos_bank += cos_bank;
        self.sin_bank += sin_bank;
        self.bridged |= bridged;
    }

    /// Length so far, s.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        f64::from(self.frames) * FRAME.as_s()
    }

    fn mean(&self) -> f64 {
        if self.frames > 0 { 1.0 / f64::from(self.frames) } else { 0.0 }
    }

    /// Mean body axes, each in inertial axes.
    #[must_use]
    pub fn body_axes(&self) -> [[f64; AXES]; AXES] {
        let mean = self.mean();
        self.body_axes.map(|axis| axis.map(|component| component * mean))
    }

    /// Cosine and sine of the mean bank.
    #[must_use]
    pub fn bank(&self) -> (f64, f64) {
        let size = sqrt(self.cos_bank * self.cos_bank + self.sin_bank * self.sin_bank);
        if size > 0.0 { (self.cos_bank / size, self.sin_bank / size) } else { (1.0, 0.0) }
    }

    /// Mean specific force along the mean body axes, m/s²; none if a frame of it was not measured.
    #[must_use]
    pub fn specific_force_mps2(&self) -> Option<[f64; AXES]> {
        let length_s = self.length_s();
        if self.bridged || length_s <= 0.0 {
            return None;
        }
        let [x, y, z] = self.delta_v_mps.map(|part| part / length_s);
        Some(self.body_axes().map(|[ax, ay, az]| x * ax + y * ay + z * az))
    }

    /// How strong the force was that was felt or, in its place, expected, m/s².
    #[must_use]
    pub fn force_mps2(&self) -> f64 {
        let [x, y, z] = self.delta_v_mps;
        let length_s = self.length_s();
        if length_s > 0.0 { sqrt(x * x + y * y + z * z) / length_s } else { 0.0 }
    }
}

/// Readings of a window, forces along three axes included, at most.
pub const MAX_SIGHTS: usize = MAX_INNOVATIONS + AXES;
