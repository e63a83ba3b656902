//! [`Executive`]: all mutable state of the flight software, and `tick`, one minor frame of it.

use super::cost::CostLedger;
use super::modes::{self, Facts, Thresholds};
use super::schedule::{
    CROWDED_BYTES, CROWDED_UPDATES, GUIDANCE_TELEMETRY_FRAMES, GUIDANCE_TELEMETRY_OFFSET, HEALTH_FRAMES, HEALTH_OFFSET,
    NAV_TELEMETRY_FRAMES, NAV_TELEMETRY_OFFSET, due, navigation_allowance,
};
use crate::config::Config;
use crate::control::{self, BankDemand};
use crate::fault::{EventLog, FrameReport, Monitor};
use crate::guidance::{
    Guidance, GuidanceContext, GuidanceInput, GuidanceOutput, Verdict, alignment_speed_mps, trigger,
};
use crate::link::packet::{
    Actuator, DeployCause, EventKind, GuidanceTlm, HealthTlm, Mode, NavTlm, Pace, RejectCounters, Severity,
};
use crate::model::{ModelError, OnboardModel};
use crate::nav::{Estimate, NavContext, Navigator};
use crate::probe::{MeasuredCost, Probe, SlotId};
use crate::sensors::{self, FrameInputs, StuckMonitor};
use crate::slot::Slot;
use crate::time::MissionTime;

/// Everything the flight software remembers. Fixed size; copying it is a snapshot.
#[derive(Clone, Debug)]
pub struct Executive {
    /// Parameters; frozen when armed.
    pub config: Config,
    /// Counters of rejected packets, shared by link and validation.
    pub rejects: RejectCounters,
    /// Event log.
    pub log: EventLog,
    /// Execution cost so far.
    pub cost: CostLedger,
    /// Bytes received since the last minor frame was run.
    pub(super) received: usize,
    mode: Mode,
    frame: u32,
    go: bool,
    pace: Pace,
    /// Built from the parameters when armed.
    model: OnboardModel,
    armed: bool,
    navigator: Navigator,
    guidance: Guidance,
    monitor: Monitor,
    stuck: StuckMonitor,
    /// Bank demand of the frame before, which acts over this one.
    demand: BankDemand,
    /// Report of guidance that waits for its frame.
    report: Slot<GuidanceTlm>,
}

/// What the slots of a minor frame up to control have found.
struct Flown {
    estimate: Estimate,
    imu_present: bool,
    command: GuidanceOutput,
    cause: Option<DeployCause>,
}

/// What one minor frame gives out; events are in the log's queue.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    /// Bank command and discretes, every frame.
    pub actuator: Actuator,
    /// Navigation telemetry, 10 Hz.
    pub navigation: Option<NavTlm>,
    /// Guidance telemetry, a few frames after a cycle's command took effect.
    pub guidance: Option<GuidanceTlm>,
    /// Health, 1 Hz.
    pub health: Option<HealthTlm>,
}

impl Executive {
    /// Flight software in `Standby` with the default parameters.
    #[must_use]
    pub const fn new() -> Self {
        let mut executive = Self::dormant();
        executive.wake();
        executive
    }

    /// All zero bytes, to become [`Self::new`] by [`Self::wake`].
    pub(super) const fn dormant() -> Self {
        Self {
            config: Config::DORMANT,
            rejects: RejectCounters::NONE,
            log: EventLog::new(),
            cost: CostLedger::new(),
            received: 0,
            mode: Mode::Standby,
            frame: 0,
            go: false,
            pace: Pace::LockStep,
            model: OnboardModel::none(),
            armed: false,
            navigator: Navigator::new(),
            guidance: Guidance::dormant(),
            monitor: Monitor::new(),
            stuck: StuckMonitor::new(),
            demand: BankDemand::NONE,
            report: Slot::Empty,
        }
    }

    /// Becomes [`Self::new`] from [`Self::dormant`], in place.
    pub(super) const fn wake(&mut self) {
        self.config.wake();
        self.guidance.wake();
    }

    /// Present mode.
    #[must_use]
    pub const fn mode(&self) -> Mode {
        self.mode
    }

    /// Index of the last minor frame run.
    #[must_use]
    pub const fn frame(&self) -> u32 {
        self.frame
    }

    /// The last navigation estimate.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        self.navigator.estimate()
    }

    /// True once the parameters are frozen.
    #[must_use]
    pub const fn is_armed(&self) -> bool {
        self.armed
    }

    /// Freezes the parameters and builds the onboard model from them; tables that make none are refused.
    pub fn arm(&mut self) -> Result<(), ModelError> {
        let c = &self.config;
        self.armed = false;
        self.model.set(c.planet, &c.vehicle, &c.aero_rows, &c.atmosphere, &c.atmosphere_rows)?;
        self.armed = true;
        Ok(())
    }

    /// What paces the minor frames.
    #[must_use]
    pub const fn pace(&self) -> Pace {
        self.pace
    }

    /// Starts the flight at the entry epoch; `false` unless armed and in `Standby`.
    pub fn go(&mut self, pace: Pace) -> bool {
        let Self { armed: true, model, config, navigator, monitor, rejects, mode: Mode::Standby, go: false, .. } = self
        else {
            return false;
        };
        monitor.begin(rejects);
        navigator.start(&config.initial_knowledge, &nav_context(config, model, &BankDemand::default()));
        self.go = true;
        self.pace = pace;
        self.change_mode(MissionTime::ZERO, &Estimate::default(), true, false);
        true
    }

    /// One minor frame, ending at `now`. Does nothing but count before the flight has started.
    pub fn tick(
        &mut self,
        now: MissionTime,
        inputs: &FrameInputs,
        cost: &MeasuredCost,
        probe: &mut impl Probe,
    ) -> Outputs {
        self.frame = now.frame_index();
        let received = core::mem::take(&mut self.received);
        let allowance = navigation_allowance(self.config.modes.navigation);
        let shed = self.cost.enter(now, self.pace, cost, allowance, &mut self.log);
        if !self.armed {
            return Outputs::default();
        }
        let (estimate, imu_present) = self.navigate(now, inputs, probe);
        probe.slot_done(SlotId::Navigation);

        let context = guidance_context(&self.config, &self.model);
        let crowded = received > CROWDED_BYTES || self.navigator.scalar_updates() > CROWDED_UPDATES;
        let (frame, mode) = (self.frame, self.mode);
        let input = GuidanceInput { now, frame, estimate: &estimate, mode, shed, crowded, context };
        let command = self.guidance.advance_probed(&input, probe);
        probe.slot_done(SlotId::Guidance);

        self.demand =
            control::step(estimate.bank_rad, estimate.bank_rate_radps, command.bank_rad, &self.config.control);
        let cause = self.parachute(&estimate, &context);
        probe.slot_done(SlotId::Control);

        self.close(now, &Flown { estimate, imu_present, command, cause }, probe)
    }

    /// Validation of the measurements and navigation. Out of line, as is [`Self::close`]: neither has to find room on the stack
    /// for both.
    #[inline(never)]
    fn navigate(&mut self, now: MissionTime, inputs: &FrameInputs, probe: &mut impl Probe) -> (Estimate, bool) {
        let mut batch = sensors::accept(now, inputs, &mut self.rejects);
        self.stuck.step(&mut batch, &self.config.navigation, &mut self.rejects);
        probe.slot_done(SlotId::Sensors);
        let context = nav_context(&self.config, &self.model, &self.demand);
        (self.navigator.step_probed(now, &batch, &context, probe), batch.imu.is_some())
    }

    /// Fault protection and telemetry of a frame that has been flown.
    #[inline(never)]
    fn close(&mut self, now: MissionTime, flown: &Flown, probe: &mut impl Probe) -> Outputs {
        let navigation =
            due(self.frame, NAV_TELEMETRY_FRAMES, NAV_TELEMETRY_OFFSET).then(|| self.navigator.telemetry());
        let counters = self.navigator.counters();
        let report = FrameReport {
            time: now,
            frame: self.frame,
            imu_present: flown.imu_present,
            navigation_valid: flown.estimate.valid,
            rejects: &self.rejects,
            innovations: navigation.as_ref().map(|tlm| &tlm.innovations),
            covariance_restored: counters.covariance_restored,
            filter_given_up: counters.given_up,
        };
        let verdict = self.monitor.step(&report, &mut self.log);
        self.log_guidance(now, &flown.command);
        self.log_parachute(now, &flown.estimate, flown.cause);
        self.change_mode(now, &flown.estimate, verdict.navigation_usable, flown.cause.is_some());
        probe.slot_done(SlotId::Fault);

        let outputs = Outputs {
            actuator: self.actuator(&self.demand),
            navigation,
            guidance: self.guidance_report(flown.command.telemetry),
            health: due(self.frame, HEALTH_FRAMES, HEALTH_OFFSET).then(|| self.health()),
        };
        probe.slot_done(SlotId::Telemetry);
        outputs
    }

    /// The only caller of [`modes::next`].
    fn change_mode(&mut self, now: MissionTime, estimate: &Estimate, navigation_usable: bool, fired: bool) {
        let facts = Facts {
            go: self.go,
            load_mps2: estimate.specific_force_b.norm(),
            speed_mps: estimate.speed_mps,
            navigation_usable,
            fired,
        };
        let thresholds = Thresholds {
            range_control_load_mps2: self.config.guidance.range_control_load_mps2,
            alignment_speed_mps: alignment_speed_mps(
                &self.config.guidance,
                self.config.modes.guidance,
                self.config.modes.trigger,
            ),
        };
        let next = modes::next(self.mode, &facts, &thresholds);
        if next != self.mode {
            self.log.record(now, Severity::Activity, EventKind::ModeChanged { from: self.mode, to: next });
            self.mode = next;
        }
    }

    fn parachute(&self, estimate: &Estimate, context: &GuidanceContext<'_>) -> Option<DeployCause> {
        if matches!(self.mode, Mode::Standby | Mode::Deployed) {
            return None;
        }
        trigger::evaluate(estimate, context)
    }

    fn actuator(&self, demand: &BankDemand) -> Actuator {
        let discretes = match self.mode {
            Mode::Deployed => Actuator::MORTAR_ARM | Actuator::MORTAR_FIRE,
            Mode::HeadingAlignment | Mode::DegradedHeadingAlignment => Actuator::MORTAR_ARM,
            _ => 0,
        };
        Actuator {
            frame: self.frame,
            bank_accel_radps2: demand.accel_radps2,
            bank_rate_radps: demand.rate_radps,
            discretes,
            mode: self.mode,
        }
    }

    /// The report of guidance when it is its turn to go down; kept until then, and not in the frame that made it.
    fn guidance_report(&mut self, new: Option<GuidanceTlm>) -> Option<GuidanceTlm> {
        if let Some(new) = new {
            self.report.put(new);
            return None;
        }
        let turn = due(self.frame, GUIDANCE_TELEMETRY_FRAMES, GUIDANCE_TELEMETRY_OFFSET);
        if turn { self.report.take() } else { None }
    }

    fn health(&self) -> HealthTlm {
        HealthTlm {
            rejects: self.rejects,
            worst_cost: self.cost.worst,
            worst_frame: self.cost.worst_frame,
            slips: self.cost.slips,
            stack_high_water_bytes: self.cost.stack_high_water_bytes,
            frames: self.frame,
            events_lost: self.log.lost(),
        }
    }

    fn log_guidance(&mut self, now: MissionTime, command: &GuidanceOutput) {
        if let Some(bank_rad) = command.reversal {
            let kind = EventKind::Reversal { bank_rad: bank_rad as f32 };
            self.log.record(now, Severity::Activity, kind);
        }
        match command.verdict {
            Some(Verdict::Unreachable(miss_m)) => {
                let kind = EventKind::TargetUnreachable { miss_m: miss_m as f32 };
                self.log.record(now, Severity::Warning, kind);
            }
            Some(Verdict::Reachable) => self.log.record(now, Severity::Activity, EventKind::TargetReachable),
            None => {}
        }
    }

    fn log_parachute(&mut self, now: MissionTime, estimate: &Estimate, cause: Option<DeployCause>) {
        if let Some(cause) = cause {
            let (altitude_m, speed_mps) = (estimate.altitude_m as f32, estimate.speed_mps as f32);
            let kind = EventKind::ParachuteFired { cause, altitude_m, speed_mps };
            self.log.record(now, Severity::Activity, kind);
        }
    }
}

impl Default for Executive {
    fn default() -> Self {
        Self::new()
    }
}

fn nav_context<'a>(config: &'a Config, model: &'a OnboardModel, demand: &BankDemand) -> NavContext<'a> {
    NavContext {
        model,
        parameters: &config.navigation,
        estimators: &config.estimators,
        sources: &config.sources,
        mode: config.modes.navigation,
        bank_accel_radps2: demand.accel_radps2,
    }
}

/// √(minor frames per second): white noise of a rate over one frame.
const ROOT_FRAMES_PER_SECOND: f64 = 7.071_067_811_865_475;

fn guidance_context<'a>(config: &'a Config, model: &'a OnboardModel) -> GuidanceContext<'a> {
    GuidanceContext {
        model,
        target: &config.target,
        deploy: &config.deploy,
        guidance: &config.guidance,
        constraints: &config.constraints,
        control: &config.control,
        trigger: config.modes.trigger,
        mode: config.modes.guidance,
        force_noise_mps2: config.navigation.accelerometer_noise * ROOT_FRAMES_PER_SECOND,
    }
}
