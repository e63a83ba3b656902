//! One flight without the link: the core as one call per minor frame, its inputs handed over as values.
//!
//! The link carries every value exactly, so the results are those of the whole flight, bit for bit. It serves flights
//! with ideal navigation and without faults: they show what guidance alone can do.

use fsw_core::executive::{EVENTS_PER_BURST, Executive, Outputs};
use fsw_core::link::packet::{Actuator, Downlink, EventKind, Frame, Pace, Severity, Uplink};
use fsw_core::link::parameters::NavigationMode;
use fsw_core::probe::{MeasuredCost, NoProbe};
use fsw_core::sensors::FrameInputs;
use fsw_core::time::MissionTime;
use hil_sim::scenario::Scenario;
use hil_sim::session::{Plan, SessionError};
use hil_sim::truth::Truth;

use super::observer::Observer;
use crate::record::End;

/// Whether a scenario can be flown without the link.
#[must_use]
pub fn is_possible(scenario: &Scenario) -> bool {
    scenario.navigation.filter == NavigationMode::Ideal && scenario.fault.is_empty()
}

/// Flies to the end.
///
/// # Errors
/// The flight software refuses its parameters.
pub fn fly(
    executive: &mut Executive,
    truth: &mut Truth,
    plan: &Plan,
    observer: &mut Observer<'_>,
) -> Result<End, SessionError> {
    start(executive, plan)?;
    // The answer to the start of the flight, of which arming and the first mode are told.
    events(executive, observer, truth);
    let (mut command, mut inputs) = (Actuator::default(), FrameInputs::new());
    loop {
        truth.advance(command.bank_accel_radps2, command.bank_rate_radps);
        observer.frame(truth);
        if truth.altitude_m() <= 0.0 {
            return Ok(End::Ground);
        }
        let now = truth.time();
        if now.as_s() >= plan.time_limit_s {
            return Ok(End::TimeLimit);
        }
        measure(&mut inputs, executive, now, truth);
        let actuator = tick(executive, now, &inputs, observer, truth);
        // As the truth's end of the link: what is not finite is not obeyed.
        if actuator.bank_accel_radps2.is_finite() && actuator.bank_rate_radps.is_finite() {
            command = actuator;
        }
        if observer.deployed() {
            return Ok(End::Deployed);
        }
    }
}

/// Loads the parameters, arms and starts.
fn start(executive: &mut Executive, plan: &Plan) -> Result<(), SessionError> {
    *executive = Executive::new();
    let refused = |reason: String| SessionError::Refused { what: "the parameters".into(), reason };
    for block in &plan.blocks {
        executive.config.apply(block).map_err(|why| refused(format!("{why:?}")))?;
    }
    executive.config.validate().map_err(|why| refused(format!("{why:?}")))?;
    executive.arm().map_err(|why| refused(why.to_string()))?;
    let armed = EventKind::Armed { digest: executive.config.digest() };
    executive.log.record(MissionTime::ZERO, Severity::Activity, armed);
    if executive.go(Pace::LockStep) { Ok(()) } else { Err(refused("it does not start".into())) }
}

/// What the frame brings: every measurement due, and the truth itself.
fn measure(inputs: &mut FrameInputs, executive: &mut Executive, now: MissionTime, truth: &Truth) {
    inputs.clear();
    let packets = truth.frame_packets();
    inputs.pressure = packets.pressure.map(|pressure| (now, pressure));
    for radio in &packets.radio {
        inputs.put(now, &Uplink::Radio(*radio), &mut executive.rejects);
    }
    inputs.imu = Some((now, packets.imu));
    inputs.truth = Some((now, truth.packet()));
}

/// One minor frame, all of which the observer hears in the order in which the flight computer says it.
fn tick(
    executive: &mut Executive,
    now: MissionTime,
    inputs: &FrameInputs,
    observer: &mut Observer<'_>,
    truth: &Truth,
) -> Actuator {
    let Outputs { actuator, navigation, guidance, health } =
        executive.tick(now, inputs, &MeasuredCost::NONE, &mut NoProbe);
    let mut hear = |packet| observer.hear(&Frame { sequence: 0, time: now, packet }, truth);
    navigation.map(Downlink::NavTlm).into_iter().for_each(&mut hear);
    guidance.map(Downlink::GuidanceTlm).into_iter().for_each(&mut hear);
    health.map(Downlink::HealthTlm).into_iter().for_each(&mut hear);
    events(executive, observer, truth);
    observer.hear(&Frame { sequence: 0, time: now, packet: Downlink::Actuator(actuator) }, truth);
    actuator
}

/// As many events as go with one frame.
fn events(executive: &mut Executive, observer: &mut Observer<'_>, truth: &Truth) {
    for event in std::iter::from_fn(|| executive.log.next_pending()).take(EVENTS_PER_BURST) {
        observer.hear(&Frame { sequence: 0, time: event.time, packet: Downlink::Event(event) }, truth);
    }
}
