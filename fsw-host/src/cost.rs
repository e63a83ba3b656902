//! What the flight software cost: wall time in this process, or what a flight computer elsewhere told of itself.

use fsw_core::executive::schedule::{FRAME_BUDGET, SCHEDULE, Slot};
use fsw_core::probe::SLOT_COUNT;
use serde::{Deserialize, Serialize};

use crate::record::FlightRecord;

/// What the flight software cost, worst of the flight.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cost {
    /// `ns` of wall time in this process, `instructions` on an emulated processor, `counts` of a board's own counter.
    pub unit: String,
    /// The whole minor frame.
    pub frame: SlotCost,
    /// By slot of the schedule, in its order.
    pub slots: Vec<SlotCost>,
    /// Frames over budget, as the flight software counted them.
    pub slips: u16,
    /// Deepest stack use, bytes; none where it is not measured.
    pub stack_high_water_bytes: Option<u32>,
}

/// One line of [`Cost`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlotCost {
    /// Which slot.
    pub name: String,
    /// Most of a frame of the flight.
    pub max: u32,
    /// What it may be; none for wall time, which has no budget.
    pub budget: Option<u32>,
}

/// What an overrun is told of: a slot of the schedule, or the whole frame.
#[must_use]
pub fn slot_name(slot: u8) -> &'static str {
    SCHEDULE.get(usize::from(slot)).map_or("whole frame", |slot| slot.name)
}

/// What the flight software cost at `place`: measured here in this process, else as it told last, once a second.
#[must_use]
pub fn of(record: &FlightRecord, place: &str) -> Option<Cost> {
    let health = record.health.last().map(|(_, health)| health);
    let slips = health.map_or(0, |health| health.slips);
    let line = |name: &str, max, budget| SlotCost { name: name.to_owned(), max, budget };
    let slots = |worst: &[u32; SLOT_COUNT], budgeted: bool| {
        let budget = |slot: &Slot| budgeted.then_some(slot.budget);
        SCHEDULE.iter().zip(worst).map(|(slot, max)| line(slot.name, *max, budget(slot))).collect()
    };
    if !record.frame_cost_us.is_empty() {
        let worst_us = record.frame_cost_us.iter().copied().fold(0.0, f32::max);
        let frame = line("whole frame", (worst_us * 1e3).round() as u32, None);
        let slots = slots(&record.slot_worst_ns, false);
        return Some(Cost { unit: "ns".into(), frame, slots, slips, stack_high_water_bytes: None });
    }
    let health = health.filter(|health| health.worst_frame > 0)?;
    let unit = if place.starts_with("qemu:") { "instructions" } else { "counts" };
    Some(Cost {
        unit: unit.into(),
        frame: line("whole frame", health.worst_frame, Some(FRAME_BUDGET)),
        slots: slots(&health.worst_cost, true),
        slips,
        stack_high_water_bytes: Some(health.stack_high_water_bytes).filter(|bytes| *bytes > 0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::End;
    use crate::record::tests::facts;
    use crate::recorder::{FlightId, Recorder};
    use fsw_core::link::packet::HealthTlm;
    use fsw_core::probe::{MeasuredCost, SlotId};
    use fsw_core::time::MissionTime;

    fn record(measured: Option<MeasuredCost>, health: HealthTlm) -> FlightRecord {
        let mut recorder = Recorder::new(facts(), FlightId::default(), 1.0);
        if let Some(cost) = measured {
            recorder.frame_cost(&cost);
        }
        let mut record = recorder.finish(End::Interrupted, 0.0);
        record.health.push((MissionTime::ZERO, health));
        record
    }

    #[test]
    fn cost_of_this_process_is_wall_time_without_a_budget() {
        let mut measured = MeasuredCost { whole: 12_345, ..MeasuredCost::NONE };
        measured.slots[SlotId::Guidance as usize] = 7_000;
        let cost = of(&record(Some(measured), HealthTlm { slips: 3, ..HealthTlm::default() }), "in-process").unwrap();
        assert_eq!((cost.unit.as_str(), cost.frame.max, cost.frame.budget, cost.slips), ("ns", 12_345, None, 3));
        assert_eq!((cost.slots[3].name.as_str(), cost.slots[3].max), ("guidance", 7_000));
    }

    #[test]
    fn cost_elsewhere_is_what_the_flight_computer_told_against_its_budgets() {
        let mut health = HealthTlm { worst_frame: 80_000, stack_high_water_bytes: 900, ..HealthTlm::default() };
        health.worst_cost[SlotId::Guidance as usize] = 24_000;
        let cost = of(&record(None, health), "qemu:m7").unwrap();
        assert_eq!(
            (cost.unit.as_str(), cost.frame.max, cost.frame.budget),
            ("instructions", 80_000, Some(FRAME_BUDGET))
        );
        assert_eq!((cost.slots[3].max, cost.slots[3].budget), (24_000, Some(SCHEDULE[3].budget)));
        assert_eq!(cost.stack_high_water_bytes, Some(900));
        assert_eq!(of(&record(None, health), "serial:/dev/x:1").unwrap().unit, "counts");
        assert_eq!(of(&record(None, HealthTlm::default()), "qemu:m7"), None, "nothing was measured");
    }
}
