//! What arrived for one minor frame.

use crate::link::packet::{Imu, MAX_SOURCES, Pressure, Radio, RejectCounters, Truth, Uplink};
use crate::time::MissionTime;

/// At most one measurement of each kind and source, each with its time stamp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameInputs {
    /// Inertial increments of the frame.
    pub imu: Option<(MissionTime, Imu)>,
    /// Stagnation pressure.
    pub pressure: Option<(MissionTime, Pressure)>,
    /// Range and range-rate, by slot of the source.
    pub radio: [Option<(MissionTime, Radio)>; MAX_SOURCES],
    /// True state. Simulation only.
    pub truth: Option<(MissionTime, Truth)>,
}

impl FrameInputs {
    /// Inputs without any measurement.
    #[must_use]
    pub const fn new() -> Self {
        Self { imu: None, pressure: None, radio: [None; MAX_SOURCES], truth: None }
    }

    /// Forgets all measurements.
    pub const fn clear(&mut self) {
        let Self { imu, pressure, radio, truth } = self;
        (*imu, *pressure, *truth) = (None, None, None);
        let [a, b, c, d] = radio;
        (*a, *b, *c, *d) = (None, None, None, None);
    }

    /// Puts a packet in its place; false when it is no measurement. Of two of the same kind the newer time stamp
    /// stays and the other one is counted as late; a radio packet of no known slot is counted as out of range.
    pub fn put(&mut self, time: MissionTime, packet: &Uplink, counters: &mut RejectCounters) -> bool {
        match packet {
            Uplink::Imu(imu) => place(&mut self.imu, time, *imu, counters),
            Uplink::Pressure(pressure) => place(&mut self.pressure, time, *pressure, counters),
            Uplink::Radio(radio) => match self.radio.get_mut(usize::from(radio.source)) {
                Some(slot) => place(slot, time, *radio, counters),
                None => counters.range = counters.range.saturating_add(1),
            },
            Uplink::Truth(truth) => place(&mut self.truth, time, *truth, counters),
            Uplink::Hello(_) | Uplink::Command(_) => return false,
        }
        true
    }
}

fn place<M>(slot: &mut Option<(MissionTime, M)>, time: MissionTime, measurement: M, counters: &mut RejectCounters) {
    if slot.is_some() {
        counters.late = counters.late.saturating_add(1);
    }
    if slot.as_ref().is_none_or(|(held, _)| time > *held) {
        *slot = Some((time, measurement));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::packet::Hello;

    #[test]
    fn packets_find_their_place() {
        let (mut inputs, mut counters) = (FrameInputs::new(), RejectCounters::default());
        let radio = Radio { source: 2, ..Radio::default() };
        let now = MissionTime(20_000);
        assert!(inputs.put(now, &Uplink::Imu(Imu::default()), &mut counters));
        assert!(inputs.put(now, &Uplink::Radio(radio), &mut counters));
        assert!(!inputs.put(now, &Uplink::Hello(Hello::ours(0)), &mut counters));
        assert_eq!(inputs.imu, Some((now, Imu::default())));
        assert_eq!(inputs.radio, [None, None, Some((now, radio)), None]);
        assert_eq!(counters, RejectCounters::default());
    }

    #[test]
    fn of_two_the_newer_stays_and_the_older_is_counted_whatever_their_order() {
        for times in [[1, 2], [2, 1]] {
            let (mut inputs, mut counters) = (FrameInputs::new(), RejectCounters::default());
            for time in times {
                let pressure = Pressure { stagnation_pa: time as f32, status: 0 };
                inputs.put(MissionTime(time), &Uplink::Pressure(pressure), &mut counters);
            }
            assert_eq!(inputs.pressure, Some((MissionTime(2), Pressure { stagnation_pa: 2.0, status: 0 })));
            assert_eq!(counters.late, 1);
        }
    }

    #[test]
    fn a_source_without_a_slot_is_out_of_range() {
        let (mut inputs, mut counters) = (FrameInputs::new(), RejectCounters::default());
        let radio = Radio { source: MAX_SOURCES as u8, ..Radio::default() };
        inputs.put(MissionTime(0), &Uplink::Radio(radio), &mut counters);
        assert_eq!(inputs, FrameInputs::new());
        assert_eq!(counters.range, 1);
    }
}
