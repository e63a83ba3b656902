//! The flight itself, minor frame by minor frame.

use fsw_core::link::framing::{FrameBytes, MAX_FRAME, encode_frame};
use fsw_core::link::packet::{Actuator, Command, Frame, Injection, Uplink};
use fsw_core::link::parameters::NavigationMode;
use fsw_core::time::{FRAMES_PER_SECOND, MissionTime};

use super::{Conductor, End};
use crate::scenario::{Fault, FaultKind};
use crate::session::plant::Plant;
use crate::truth::FramePackets;

impl<P: Plant> Conductor<P> {
    pub(super) fn begin_flight(&mut self) {
        self.send_truth();
        self.go_on = true;
    }

    /// Takes the command of a frame; the parachute ends the flight.
    pub(super) fn commanded(&mut self, actuator: &Actuator) {
        self.silent_frames = 0;
        // Not finite is not obeyed: the truth must survive any flight software.
        if actuator.bank_accel_radps2.is_finite() && actuator.bank_rate_radps.is_finite() {
            self.command = *actuator;
        }
        if actuator.discretes & Actuator::MORTAR_FIRE != 0 {
            self.finish(End::Deployed);
        } else if actuator.frame >= self.frame {
            self.go_on = true;
        }
    }

    pub(super) fn fly_one_frame(&mut self) {
        if self.plant.altitude_m() <= 0.0 {
            return self.finish(End::Ground);
        }
        if self.now().as_s() >= self.plan.time_limit_s {
            return self.finish(End::TimeLimit);
        }
        self.plant.advance(self.command.bank_accel_radps2, self.command.bank_rate_radps);
        self.frame += 1;
        self.go_on = false;
        self.send_truth();
        self.inject_overruns();
        let mut packets = self.plant.packets().clone();
        self.sensor_faults.strike(self.now().as_s(), &mut packets);
        let FramePackets { pressure, radio, imu } = packets;
        let measurements = pressure.map(Uplink::Pressure).into_iter().chain(radio.into_iter().map(Uplink::Radio));
        self.line.begin_frame(self.now().as_s(), &mut self.pending);
        for packet in measurements.chain([Uplink::Imu(imu)]) {
            let mut room: FrameBytes = [0; MAX_FRAME];
            // Every packet fits its own maximum size.
            if let Ok(bytes) = self.sender.encode(self.now(), &packet, &mut room) {
                self.line.send(bytes, &mut self.pending);
            }
        }
        if !self.line.end_frame(&mut self.pending) {
            // The flight computer will not see this frame end: no use to wait for its answer.
            self.go_on = true;
        }
    }

    /// Tells the flight computer of the overruns that begin with this frame; its reply is not waited for.
    fn inject_overruns(&mut self) {
        let (now_s, before_s) = (self.now().as_s(), MissionTime::of_frame(self.frame.saturating_sub(1)).as_s());
        let begins = |f: &&Fault| f.acts_at(now_s) && (self.frame == 1 || !f.acts_at(before_s));
        let overruns = self.plan.faults.iter().filter(|f| f.kind == FaultKind::Overrun).filter(begins);
        // Beyond the range of an integer the cast stays at its end.
        let frames = overruns.map(|f| (f.duration_s * f64::from(FRAMES_PER_SECOND)).round() as u16).max();
        if let Some(frames) = frames {
            self.send(Uplink::Command(Command::Inject(Injection::Overrun { frames })));
        }
    }

    /// The true state: part of the link for ideal navigation, else a tap outside the numbering.
    fn send_truth(&mut self) {
        let truth = Uplink::Truth(self.plant.truth());
        if self.config.modes.navigation == NavigationMode::Ideal {
            self.send(truth);
        } else if self.plan.truth_tap {
            let mut room: FrameBytes = [0; MAX_FRAME];
            // Every packet fits its own maximum size.
            if let Ok(bytes) = encode_frame(&Frame { sequence: 0, time: self.now(), packet: truth }, &mut room) {
                self.pending.extend_from_slice(bytes);
            }
        }
    }
}
