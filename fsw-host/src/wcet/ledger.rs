//! What a flight computer said its frames cost, flight by flight.

use fsw_core::link::packet::{CostTlm, Downlink};
use fsw_core::probe::{KERNEL_COUNT, Kernel, MeasuredCost, SLOT_COUNT, SlotId};
use fsw_core::time::{FRAME, FRAMES_PER_SECOND};

use crate::tap::{Heard, Tap};

/// Cost of one minor frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCost {
    /// Index of the frame.
    pub frame: u32,
    /// The whole frame.
    pub whole: u32,
    /// Per slot of the schedule.
    pub slots: [u32; SLOT_COUNT],
    /// Per algorithm.
    pub kernels: [u32; KERNEL_COUNT],
    /// Units of work per algorithm.
    pub units: [u16; KERNEL_COUNT],
}

impl FrameCost {
    /// From what a meter measured.
    #[must_use]
    pub fn measured(frame: u32, cost: &MeasuredCost) -> Self {
        let MeasuredCost { whole, slots, kernels, units, .. } = *cost;
        Self { frame, whole, slots, kernels, units }
    }

    /// Time at which the frame ends, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        f64::from(self.frame) * FRAME.as_s()
    }

    /// Which second of the flight it belongs to; the first frame of a flight is number 1.
    #[must_use]
    pub fn second(&self) -> u32 {
        self.frame.saturating_sub(1) / FRAMES_PER_SECOND
    }
}

/// Cost of one guidance cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CycleCost {
    /// The frame in which its result took effect.
    pub frame: u32,
    /// The guidance slot of all its frames.
    pub cost: u32,
    /// Predictor calls.
    pub predictions: u8,
    /// Evaluations of the equations of motion.
    pub evaluations: u16,
}

/// Everything that one flight cost.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FlightCost {
    /// By frame, in order.
    pub frames: Vec<FrameCost>,
    /// By guidance cycle, in order.
    pub cycles: Vec<CycleCost>,
    /// Deepest stack use, bytes; 0 where it is not measured.
    pub stack_high_water_bytes: u32,
    /// Guidance slot of the cycle that is not over yet.
    open_cycle: u32,
    /// What the telemetry of the last cycle said, until its frame's cost is there.
    reported: Option<(u8, u16)>,
}

impl FlightCost {
    /// From the answer of a flight computer that reports its cost.
    #[must_use]
    pub fn of_answer(answer: &[u8]) -> Self {
        let mut flight = Self::default();
        Tap::<Downlink>::default().feed(answer, |_, heard| {
            if let Heard::Packet(frame) = heard {
                flight.hear(&frame.packet);
            }
        });
        flight
    }

    /// Hears a packet; the cost of a frame comes after the frame's own packets.
    pub fn hear(&mut self, packet: &Downlink) {
        match packet {
            Downlink::GuidanceTlm(tlm) => self.reported = Some((tlm.predictions, tlm.evaluations)),
            Downlink::CostTlm(CostTlm { frame, whole, slots, kernels, units, stack_high_water_bytes }) => {
                self.stack_high_water_bytes = self.stack_high_water_bytes.max(*stack_high_water_bytes);
                let (frame, whole) = (*frame, *whole);
                self.enter(FrameCost { frame, whole, slots: *slots, kernels: *kernels, units: *units });
            }
            _ => {}
        }
    }

    /// Enters the cost of a frame.
    pub fn enter(&mut self, frame: FrameCost) {
        self.frames.push(frame);
        self.open_cycle = self.open_cycle.saturating_add(frame.slots[SlotId::Guidance as usize]);
        if let Some((predictions, evaluations)) = self.reported.take() {
            let cost = std::mem::take(&mut self.open_cycle);
            self.cycles.push(CycleCost { frame: frame.frame, cost, predictions, evaluations });
        }
    }

    /// The frames of each second of the flight that reported any.
    pub fn seconds(&self) -> impl Iterator<Item = &[FrameCost]> {
        self.frames.chunk_by(|a, b| a.second() == b.second())
    }

    /// Cost and units of an algorithm over the whole flight.
    #[must_use]
    pub fn total(&self, kernel: Kernel) -> (u64, u64) {
        let kernel = kernel as usize;
        let add =
            |sum: (u64, u64), f: &FrameCost| (sum.0 + u64::from(f.kernels[kernel]), sum.1 + u64::from(f.units[kernel]));
        self.frames.iter().fold((0, 0), add)
    }
}

/// Worst frame over mean frame of a second; none when the second is not whole.
#[must_use]
pub fn evenness(second: &[FrameCost]) -> Option<f64> {
    let worst = second.iter().map(|frame| frame.whole).max()?;
    let sum: u64 = second.iter().map(|frame| u64::from(frame.whole)).sum();
    let whole = second.len() == FRAMES_PER_SECOND as usize && sum > 0;
    whole.then(|| f64::from(worst) * second.len() as f64 / sum as f64)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use fsw_core::link::packet::GuidanceTlm;

    /// A frame that cost so much, half of it guidance.
    pub(crate) fn frame(frame: u32, whole: u32) -> FrameCost {
        let mut cost = FrameCost { frame, whole, ..FrameCost::default() };
        cost.slots[SlotId::Guidance as usize] = whole / 2;
        (cost.kernels[Kernel::Predictor as usize], cost.units[Kernel::Predictor as usize]) = (whole / 4, 2);
        cost
    }

    #[test]
    fn a_cycle_ends_with_the_frame_of_its_telemetry() {
        let mut flight = FlightCost::default();
        for index in 1..=4 {
            if index == 3 {
                let tlm = GuidanceTlm { predictions: 2, evaluations: 90, ..GuidanceTlm::default() };
                flight.hear(&Downlink::GuidanceTlm(tlm));
            }
            flight.enter(frame(index, 100));
        }
        assert_eq!(flight.cycles, [CycleCost { frame: 3, cost: 150, predictions: 2, evaluations: 90 }]);
        assert_eq!(flight.total(Kernel::Predictor), (100, 8));
    }

    #[test]
    fn the_first_frame_begins_the_first_second_and_only_whole_seconds_are_even_or_not() {
        let mut flight = FlightCost::default();
        (1..=120).for_each(|index| flight.enter(frame(index, if index == 60 { 300 } else { 100 })));
        let seconds: Vec<_> = flight.seconds().collect();
        assert_eq!(seconds.iter().map(|second| second.len()).collect::<Vec<_>>(), [50, 50, 20]);
        assert_eq!(evenness(seconds[0]), Some(1.0));
        assert_eq!(evenness(seconds[1]), Some(300.0 * 50.0 / 5200.0));
        assert_eq!(evenness(seconds[2]), None);
    }
}
