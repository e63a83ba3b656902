//! Judges and compensates the measurements of one frame.

use super::FrameInputs;
use super::limits::{
    MAX_AGE, MAX_DELTA_THETA_COUNTS, MAX_DELTA_V_COUNTS, MAX_LEAD, MAX_RANGE_M, MAX_RANGE_RATE_MPS, MAX_STAGNATION_PA,
    MAX_TRUTH_COMPONENT, MAX_TRUTH_SCALARS, MIN_QUALITY, MIN_RANGE_M, MIN_STAGNATION_PA, TRUTH_QUATERNION_TOLERANCE,
};
use crate::frames::{Body, Vec3};
use crate::link::packet::{
    DELTA_THETA_LSB_RAD, DELTA_V_LSB_MPS, Imu, MAX_SOURCES, Pressure, Radio, RejectCounters, Truth,
};
use crate::math::num::{abs, all_finite};
use crate::time::MissionTime;

/// The measurements of one minor frame that are fit for use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Batch {
    /// Inertial increments.
    pub imu: Option<ImuIncrement>,
    /// Stagnation pressure.
    pub pressure: Option<PressureMeasurement>,
    /// Range and range-rate, by slot of the source.
    pub radio: [Option<RadioMeasurement>; MAX_SOURCES],
    /// True state. Simulation only.
    pub truth: Option<(MissionTime, Truth)>,
}

/// Inertial increments over the minor frame that ends at `time`, body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuIncrement {
    /// End of the frame.
    pub time: MissionTime,
    /// Integral of the specific force in the rotating body axes, m/s.
    pub delta_v_b: Vec3<Body>,
    /// Relative rotation over the frame as a rotation vector, rad.
    pub delta_theta_b: Vec3<Body>,
    /// An accelerometer axis reached its limit within the frame: the true increment is larger.
    pub accelerometer_saturated: bool,
    /// A gyro axis reached its limit within the frame: the true rotation is larger.
    pub gyro_saturated: bool,
}

/// Stagnation pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureMeasurement {
    /// When.
    pub time: MissionTime,
    /// Stagnation pressure, Pa.
    pub stagnation_pa: f64,
}

/// Range and range-rate to one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadioMeasurement {
    /// When.
    pub time: MissionTime,
    /// Slot of the source.
    pub source: u8,
    /// Geometric range, m.
    pub range_m: f64,
    /// Rate of change of the range, m/s.
    pub range_rate_mps: f64,
}

/// Why a measurement is not used, in the order in which the causes are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unfit {
    Late,
    Early,
    Status,
    NotFinite,
    Range,
}

/// Judges every measurement of the minor frame that ends `now`: age, status, finite, range. What is unfit is left out
/// and counted under the first cause; the rest is converted to SI.
pub fn accept(now: MissionTime, inputs: &FrameInputs, counters: &mut RejectCounters) -> Batch {
    let mut batch = Batch {
        imu: fit(now, &inputs.imu, imu_increment, counters),
        pressure: fit(now, &inputs.pressure, pressure_measurement, counters),
        radio: [None; MAX_SOURCES],
        truth: fit(now, &inputs.truth, truth_state, counters),
    };
    for (slot, (accepted, offered)) in (0u8..).zip(batch.radio.iter_mut().zip(&inputs.radio)) {
        *accepted = fit(now, offered, |time, radio| radio_measurement(slot, time, radio), counters);
    }
    batch
}

/// The converted measurement if it is of this frame and fit for use.
fn fit<M, C>(
    now: MissionTime,
    offered: &Option<(MissionTime, M)>,
    convert: impl FnOnce(MissionTime, &M) -> Result<C, Unfit>,
    counters: &mut RejectCounters,
) -> Option<C> {
    let (time, measurement) = offered.as_ref()?;
    match timely(now, *time).and_then(|()| convert(*time, measurement)) {
        Ok(converted) => Some(converted),
        Err(unfit) => {
            let counter = match unfit {
                Unfit::Late => &mut counters.late,
                Unfit::Early => &mut counters.early,
                Unfit::Status => &mut counters.status,
                Unfit::NotFinite => &mut counters.not_finite,
                Unfit::Range => &mut counters.range,
            };
            *counter = counter.saturating_add(1);
            None
        }
    }
}

fn timely(now: MissionTime, time: MissionTime) -> Result<(), Unfit> {
    match (now.since(time), time.since(now)) {
        (Some(age), _) if age >= MAX_AGE => Err(Unfit::Late),
        (None, Some(lead)) if lead > MAX_LEAD => Err(Unfit::Early),
        _ => Ok(()),
    }
}

fn require(holds: bool, otherwise: Unfit) -> Result<(), Unfit> {
    if holds { Ok(()) } else { Err(otherwise) }
}

/// Counts to increments. Saturated data is clipped, not wrong in sign: it is passed on and marked, because a frame
/// without any increment would be worse.
fn imu_increment(time: MissionTime, imu: &Imu) -> Result<ImuIncrement, Unfit> {
    const SATURATED: u8 = Imu::ACCELEROMETER_SATURATED | Imu::GYRO_SATURATED;
    require(imu.status & !SATURATED == 0, Unfit::Status)?;
    require(imu.delta_v_counts.iter().all(|c| c.unsigned_abs() <= MAX_DELTA_V_COUNTS), Unfit::Range)?;
    require(imu.delta_theta_counts.iter().all(|c| c.unsigned_abs() <= MAX_DELTA_THETA_COUNTS), Unfit::Range)?;
    Ok(ImuIncrement {
        time,
        delta_v_b: Vec3::from_array(imu.delta_v_counts.map(|c| f64::from(c) * DELTA_V_LSB_MPS)),
        delta_theta_b: Vec3::from_array(imu.delta_theta_counts.map(|c| f64::from(c) * DELTA_THETA_LSB_RAD)),
        accelerometer_saturated: imu.status & Imu::ACCELEROMETER_SATURATED != 0,
        gyro_saturated: imu.status & Imu::GYRO_SATURATED != 0,
    })
}

fn pressure_measurement(time: MissionTime, pressure: &Pressure) -> Result<PressureMeasurement, Unfit> {
    let stagnation_pa = f64::from(pressure.stagnation_pa);
    require(pressure.status == 0, Unfit::Status)?;
    require(stagnation_pa.is_finite(), Unfit::NotFinite)?;
    require((MIN_STAGNATION_PA..=MAX_STAGNATION_PA).contains(&stagnation_pa), Unfit::Range)?;
    Ok(PressureMeasurement { time, stagnation_pa })
}

fn radio_measurement(slot: u8, time: MissionTime, radio: &Radio) -> Result<RadioMeasurement, Unfit> {
    let Radio { source, range_m, range_rate_mps, quality } = *radio;
    require(quality >= MIN_QUALITY, Unfit::Status)?;
    require(range_m.is_finite() && range_rate_mps.is_finite(), Unfit::NotFinite)?;
    require(source == slot, Unfit::Range)?;
    require((MIN_RANGE_M..=MAX_RANGE_M).contains(&range_m), Unfit::Range)?;
    require(abs(range_rate_mps) <= MAX_RANGE_RATE_MPS, Unfit::Range)?;
    Ok(RadioMeasurement { time, source, range_m, range_rate_mps })
}

fn truth_state(time: MissionTime, truth: &Truth) -> Result<(MissionTime, Truth), Unfit> {
    let scalars = [truth.bank_rad, truth.bank_rate_radps, truth.density_kgpm3, truth.mach, truth.dynamic_pressure_pa];
    let vectors = [truth.position_m, truth.velocity_mps];
    let [w, x, y, z] = truth.attitude;
    let finite = all_finite(&scalars) && all_finite(&truth.attitude) && vectors.iter().all(|v| all_finite(v));
    require(finite, Unfit::NotFinite)?;
    require(vectors.as_flattened().iter().all(|c| abs(*c) <= MAX_TRUTH_COMPONENT), Unfit::Range)?;
    require(scalars.iter().zip(MAX_TRUTH_SCALARS).all(|(s, max)| abs(*s) <= max), Unfit::Range)?;
    require(abs(w * w + x * x + y * y + z * z - 1.0) <= 2.0 * TRUTH_QUATERNION_TOLERANCE, Unfit::Range)?;
    Ok((time, *truth))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: MissionTime = MissionTime(1_000_000);

    fn full_frame() -> FrameInputs {
        let radio = Radio { source: 1, range_m: 4e5, range_rate_mps: -3e3, quality: 200 };
        FrameInputs {
            imu: Some((NOW, Imu { delta_v_counts: [-29_800, 0, 1_300], delta_theta_counts: [5, -6, 7], status: 0 })),
            pressure: Some((NOW, Pressure { stagnation_pa: 9_000.0, status: 0 })),
            radio: [None, Some((NOW, radio)), None, None],
            truth: Some((NOW, Truth { attitude: [1.0, 0.0, 0.0, 0.0], ..Truth::default() })),
        }
    }

    /// The batch and the counters after one edit of a full frame.
    fn after(edit: impl FnOnce(&mut FrameInputs)) -> (Batch, RejectCounters) {
        let (mut inputs, mut counters) = (full_frame(), RejectCounters::default());
        edit(&mut inputs);
        (accept(NOW, &inputs, &mut counters), counters)
    }

    #[test]
    fn healthy_measurements_pass_in_si() {
        let (batch, counters) = after(|_| {});
        let imu = batch.imu.unwrap();
        // Counts times the scale factor: -29800 · 1e-6 m/s and 7 · 1e-8 rad, to rounding.
        assert!((imu.delta_v_b.x() + 0.0298).abs() < 1e-15);
        assert!((imu.delta_theta_b.z() - 7e-8).abs() < 1e-20);
        assert_eq!((imu.time, imu.accelerometer_saturated, imu.gyro_saturated), (NOW, false, false));
        assert_eq!(batch.pressure.unwrap().stagnation_pa, 9_000.0);
        assert_eq!(batch.radio[1].unwrap().range_rate_mps, -3e3);
        assert!(batch.truth.is_some());
        assert_eq!(counters, RejectCounters::default());
    }

    #[test]
    fn a_measurement_counts_for_exactly_one_frame() {
        for (age, used) in [(0, true), (19_999, true), (20_000, false), (500_000, false)] {
            let (batch, counters) = after(|f| f.pressure.as_mut().unwrap().0 = MissionTime(NOW.0 - age));
            assert_eq!(batch.pressure.is_some(), used, "{age}");
            assert_eq!(counters.late, u32::from(!used), "{age}");
        }
    }

    #[test]
    fn a_time_stamp_far_ahead_is_early() {
        for (lead, used) in [(1, true), (10_000, true), (10_001, false)] {
            let (batch, counters) = after(|f| f.imu.as_mut().unwrap().0 = MissionTime(NOW.0 + lead));
            assert_eq!(batch.imu.is_some(), used, "{lead}");
            assert_eq!(counters.early, u32::from(!used), "{lead}");
        }
    }

    #[test]
    fn saturated_increments_are_marked_and_failed_ones_left_out() {
        let (batch, counters) = after(|f| f.imu.as_mut().unwrap().1.status = Imu::GYRO_SATURATED);
        let imu = batch.imu.unwrap();
        assert!(imu.gyro_saturated && !imu.accelerometer_saturated);
        assert_eq!(counters.status, 0);
        for status in [Imu::FAILED, 0x80] {
            let (batch, counters) = after(|f| f.imu.as_mut().unwrap().1.status = status);
            assert_eq!((batch.imu, counters.status), (None, 1));
        }
    }

    #[test]
    fn increments_beyond_the_saturation_are_out_of_range() {
        for counts in [i32::MIN, i32::MAX, MAX_DELTA_V_COUNTS as i32 + 1] {
            let (batch, counters) = after(|f| f.imu.as_mut().unwrap().1.delta_v_counts[2] = counts);
            assert_eq!((batch.imu, counters.range), (None, 1), "{counts}");
        }
        let (batch, _) = after(|f| f.imu.as_mut().unwrap().1.delta_v_counts[2] = -(MAX_DELTA_V_COUNTS as i32));
        assert!(batch.imu.is_some());
        let (batch, _) = after(|f| f.imu.as_mut().unwrap().1.delta_theta_counts[0] = MAX_DELTA_THETA_COUNTS as i32 + 1);
        assert!(batch.imu.is_none());
    }

    #[test]
    fn what_is_not_a_number_never_reaches_the_filter() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (batch, counters) = after(|f| f.pressure.as_mut().unwrap().1.stagnation_pa = bad as f32);
            assert_eq!((batch.pressure, counters.not_finite), (None, 1));
            let (batch, counters) = after(|f| f.radio[1].as_mut().unwrap().1.range_m = bad);
            assert_eq!((batch.radio[1], counters.not_finite), (None, 1));
            let (batch, counters) = after(|f| f.radio[1].as_mut().unwrap().1.range_rate_mps = bad);
            assert_eq!((batch.radio[1], counters.not_finite), (None, 1));
            let (batch, counters) = after(|f| f.truth.as_mut().unwrap().1.velocity_mps[0] = bad);
            assert_eq!((batch.truth, counters.not_finite), (None, 1));
        }
    }

    #[test]
    fn absurd_values_are_out_of_range() {
        for edit in [
            (|f: &mut FrameInputs| f.pressure.as_mut().unwrap().1.stagnation_pa = 1e9) as fn(&mut FrameInputs),
            |f| f.pressure.as_mut().unwrap().1.stagnation_pa = -2e3,
            |f| f.radio[1].as_mut().unwrap().1.range_m = -1.0,
            |f| f.radio[1].as_mut().unwrap().1.range_m = 1e300,
            |f| f.radio[1].as_mut().unwrap().1.range_rate_mps = -1e5,
            |f| f.radio[1].as_mut().unwrap().1.source = 3,
            |f| f.truth.as_mut().unwrap().1.attitude = [0.0; 4],
            |f| f.truth.as_mut().unwrap().1.position_m = [1e300, 0.0, 0.0],
            |f| f.truth.as_mut().unwrap().1.bank_rate_radps = -1e300,
        ] {
            let (_, counters) = after(edit);
            assert_eq!(counters, RejectCounters { range: 1, ..RejectCounters::default() });
        }
    }

    #[test]
    fn bad_status_and_no_signal_forbid_use() {
        let (batch, counters) = after(|f| {
            f.pressure.as_mut().unwrap().1.status = 1;
            f.radio[1].as_mut().unwrap().1.quality = 0;
        });
        assert_eq!((batch.pressure, batch.radio[1], counters.status), (None, None, 2));
        assert!(batch.imu.is_some(), "the rest of the frame is not affected");
    }
}
