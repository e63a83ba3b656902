//! Guidance: from the navigation estimate to a commanded bank angle. Mode `paper` is the predictor-corrector of P4.
//!
//! * [`cycle`] the resumable 1 Hz computation: [`predictor`] flies the onboard model to the trigger, [`corrector`] finds
//!   the bank that ends at the target, [`constraints`] bounds it. * [`course`], [`lateral`] on which side to bank.
//! * [`reach`] whether the target can be reached. * [`density`] how much of the navigated density is believed. * [`heading`] heading alignment below the switch speed. * [`trigger`] when the parachute fires.
//!
//! ```text
//! frame 50 k        estimate ──► cycle starts: propagated to frame 50 (k+1) under the bank in force
//! 50 k … 50 k + 48  a quota of predictor steps in each frame
//! frame 50 (k+1)    its bank magnitude takes effect, with the side from the estimate of that frame; next cycle starts
//! ```

pub mod adaptation;
pub mod air;
pub mod apollo;
pub mod constraints;
pub mod corrector;
pub mod course;
pub mod cycle;
pub mod density;
pub mod felt;
pub mod heading;
pub mod lateral;
pub mod predictor;
pub mod reach;
pub mod segments;
pub mod steering;
pub mod tables;
pub mod trigger;
pub mod turn;

use crate::frames::{PlanetFixed, Vec3, surface_point};
use crate::link::packet::{CycleOutcome, GuidanceTlm, Mode};
use crate::link::parameters::{
    ConstraintParameters, ControlParameters, DeployParameters, GuidanceMode, GuidanceParameters, Target, TriggerKind,
};
use crate::math::fun::{cos, sin};
use crate::math::num::{clamp, wrap_angle};
use crate::model::OnboardModel;
use crate::nav::Estimate;
use crate::probe::{Kernel, NoProbe, Probe};
use crate::slot::Slot;
use crate::time::{FRAMES_PER_SECOND, MissionTime};

use adaptation::Adaptation;
use air::{Adapted, AirProfile};
use course::Course;
use cycle::{Cycle, CycleContext, CycleResult, CycleStart};
use heading::{Alignment, AlignmentState};
use predictor::Stop;
use reach::Reach;
pub use reach::Verdict;
use segments::Segments;
use steering::{Sight, Steering};
use turn::BankState;

/// Work that the first cycle expects of a prediction: half of what it is allowed. One that takes more is noticed while it
/// is flown, and the quota grows.
const LONGEST_PREDICTION: u32 = cycle::STEP_WORK * cycle::MAX_EVALUATIONS as u32 / 32;

/// Minor frame of a second in which the table of air is begun, and that in which it is put to use: 27 lie between.
const TABLE_BEGINS: u32 = FRAMES_PER_SECOND - 29;
const TABLE_ENDS: u32 = FRAMES_PER_SECOND - 1;

/// Mach number whose lift over drag stands for that of the flight, in the lateral logic.
const HYPERSONIC_MACH: f64 = 10.0;

/// Parameters and model that guidance flies with; the same in every frame of a flight.
#[derive(Clone, Copy, Debug)]
pub struct GuidanceContext<'a> {
    /// The onboard model.
    pub model: &'a OnboardModel,
    /// The target.
    pub target: &'a Target,
    /// Parachute trigger.
    pub deploy: &'a DeployParameters,
    /// Guidance settings.
    pub guidance: &'a GuidanceParameters,
    /// Limits along the path.
    pub constraints: &'a ConstraintParameters,
    /// Bank control.
    pub control: &'a ControlParameters,
    /// Which trigger fires the parachute.
    pub trigger: TriggerKind,
    /// Algorithm.
    pub mode: GuidanceMode,
    /// Error of the inertial unit's force over one minor frame, m/s².
    pub force_noise_mps2: f64,
}

/// What follows from the parameters and costs hundreds of instructions: found once a second.
#[derive(Clone, Copy, Debug)]
struct Aim {
    /// Direction of the target, planet-fixed unit vector.
    target_p: Vec3<PlanetFixed>,
    /// Planet-relative speed at which the speed trigger is to be expected, m/s; zero before anything has been found.
    stop_speed_mps: f64,
    /// Lift over drag at high speed.
    lift_to_drag: f64,
}

impl Aim {
    const NONE: Self = Self { target_p: Vec3::zero(), stop_speed_mps: 0.0, lift_to_drag: 0.0 };

    fn of(context: &GuidanceContext<'_>) -> Self {
        let (drag, lift) = context.model.aero.coefficients(HYPERSONIC_MACH);
        Self {
            target_p: context.target_p(),
            stop_speed_mps: trigger::expected_speed_mps(context.deploy, context.model),
            lift_to_drag: lift / drag,
        }
    }

    fn is_none(&self) -> bool {
        self.stop_speed_mps == 0.0
    }
}

impl<'a> GuidanceContext<'a> {
    /// Direction of the target, planet-fixed unit vector.
    #[must_use]
    pub fn target_p(&self) -> Vec3<PlanetFixed> {
        surface_point(self.target.longitude_rad, self.target.latitude_rad)
    }

    /// The segment flown, in the modes that have any.
    fn segment(&self, segments: &Segments) -> Option<&'static tables::Segment> {
        let segmented = matches!(self.mode, GuidanceMode::Segmented | GuidanceMode::SegmentedTable);
        if segmented { segments.flown() } else { None }
    }

    /// Whether the air is learned; the paper's designs fly the nominal one, or the one that navigation knows, and
    /// terminal-point guidance feels it.
    fn learns(&self) -> bool {
        matches!(self.mode, GuidanceMode::Aeroshell | GuidanceMode::SegmentedTable)
    }

    /// Speed below which the heading is aligned, m/s.
    #[must_use]
    pub fn alignment_speed_mps(&self) -> f64 {
        alignment_speed_mps(self.guidance, self.mode, self.trigger)
    }

    fn steering(&self, aim: &Aim) -> Option<Steering<'a>> {
        (self.mode == GuidanceMode::Aeroshell).then(|| Steering {
            guidance: self.guidance,
            control: self.control,
            target_p: aim.target_p,
            radius_m: self.model.planet.radius_m,
            alignment_speed_mps: self.alignment_speed_mps(),
            stop_speed_mps: aim.stop_speed_mps,
            lift_to_drag: aim.lift_to_drag,
        })
    }

    fn cycle<'b>(&self, air: &'b AirProfile, segments: &Segments, aim: &Aim) -> CycleContext<'b>
    where
        'a: 'b,
    {
        let segment = self.segment(segments);
        let waypoint = segment.filter(|_| self.mode == GuidanceMode::Segmented);
        CycleContext {
            remainder: segment.filter(|_| self.mode == GuidanceMode::SegmentedTable),
            air,
            steering: self.steering(aim),
            model: self.model,
            guidance: self.guidance,
            constraints: self.constraints,
            control: self.control,
            stop: Stop {
                speed_mps: segment.map_or(aim.stop_speed_mps, |segment| f64::from(segment.speed_mps)),
                radius_m: self.model.planet.radius_m + self.deploy.floor_altitude_m,
                horizon_s: self.guidance.prediction_horizon_s,
            },
            target_p: waypoint.map_or(aim.target_p, tables::Segment::direction_p),
        }
    }
}

/// Speed below which the heading is aligned, m/s.
#[must_use]
pub fn alignment_speed_mps(guidance: &GuidanceParameters, mode: GuidanceMode, trigger: TriggerKind) -> f64 {
    match (mode, trigger) {
        (GuidanceMode::Aeroshell, TriggerKind::Range) => guidance.range_alignment_speed_mps,
        (GuidanceMode::Aeroshell, TriggerKind::Speed) => guidance.late_alignment_speed_mps,
        _ => guidance.alignment_speed_mps,
    }
}

/// Inputs of one minor frame.
#[derive(Clone, Copy, Debug)]
pub struct GuidanceInput<'a> {
    /// Mission time of the frame.
    pub now: MissionTime,
    /// Index of the frame.
    pub frame: u32,
    /// Navigation estimate of the frame.
    pub estimate: &'a Estimate,
    /// Mode of the flight software.
    pub mode: Mode,
    /// The frame before took too long: the predictor rests, and a cycle that finds nothing keeps the last command.
    pub shed: bool,
    /// Parameters and model.
    pub context: GuidanceContext<'a>,
}

/// Outputs of one minor frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GuidanceOutput {
    /// Commanded bank in force, rad.
    pub bank_rad: f64,
    /// Report, once a second in range control and heading alignment.
    pub telemetry: Option<GuidanceTlm>,
    /// A bank reversal was commanded: the new bank, rad.
    pub reversal: Option<f64>,
    /// The verdict on reaching the target has just changed; see [`Reach::judge`].
    pub verdict: Option<Verdict>,
}

/// The guidance of one flight. Fixed size, no references; [`Guidance::advance`] is a pure function of it and its input.
#[derive(Clone, Debug)]
pub struct Guidance {
    aim: Aim,
    command_rad: f64,
    /// Side banked to, +1 right, −1 left, 0 before range control.
    side: f64,
    cycle: Slot<Cycle>,
    cycles: u32,
    /// Work of the longest prediction of the cycle before.
    longest_prediction: u32,
    second: u32,
    reversals: u8,
    reach: Reach,
    alignment: Alignment,
    adaptation: Adaptation,
    air: AirProfile,
    /// Slope of the downrange error with the cosine of the bank, m.
    slope_m: Option<f64>,
    segments: Segments,
}

impl Default for Guidance {
    fn default() -> Self {
        Self::new()
    }
}

impl Guidance {
    /// Guidance before a flight.
    #[must_use]
    pub const fn new() -> Self {
        let mut guidance = Self::dormant();
        guidance.wake();
        guidance
    }

    /// All zero bytes, to become [`Self::new`] by [`Self::wake`].
    pub(crate) const fn dormant() -> Self {
        Self {
            aim: Aim::NONE,
            command_rad: 0.0,
            side: 0.0,
            cycle: Slot::Empty,
            cycles: 0,
            longest_prediction: 0,
            second: 0,
            reversals: 0,
            reach: Reach::NEW,
            alignment: Alignment::NEW,
            adaptation: Adaptation::DORMANT,
            air: AirProfile::NONE,
            slope_m: None,
            segments: Segments::NEW,
        }
    }

    /// Becomes [`Self::new`] from [`Self::dormant`], in place.
    pub(crate) const fn wake(&mut self) {
        self.longest_prediction = LONGEST_PREDICTION;
        self.adaptation.wake();
    }

    /// Bank reversals commanded so far.
    #[must_use]
    pub fn reversals(&self) -> u8 {
        self.reversals
    }

    /// One minor frame. The cost is bounded: [`WORK_PER_FRAME`](cycle::WORK_PER_FRAME), a dozen predictor steps, and a little more.
    ///
    /// `Standby` and `Coast` hold the initial bank, `RangeControl` runs cycles, `HeadingAlignment` steers in every frame,
    /// `DegradedRangeControl` keeps the last command, `DegradedHeadingAlignment` flies lift-up, `Deployed` commands zero.
    pub fn advance(&mut self, input: &GuidanceInput<'_>) -> GuidanceOutput {
        self.advance_probed(input, &mut NoProbe)
    }

    /// As [`Self::advance`], telling `probe` when the predictor and the rest are done.
    pub fn advance_probed(&mut self, input: &GuidanceInput<'_>, probe: &mut impl Probe) -> GuidanceOutput {
        // A frame that was skipped must not cost a cycle: the first frame of a new second stands in for it.
        let second = input.frame / FRAMES_PER_SECOND;
        let on_the_second = input.frame.is_multiple_of(FRAMES_PER_SECOND) || second > self.second;
        self.second = second;
        let mut output = GuidanceOutput::default();
        if on_the_second || self.aim.is_none() {
            self.aim = Aim::of(&input.context);
        }
        self.learn(input);
        match input.mode {
            Mode::Standby | Mode::Coast => self.command_rad = wrap_angle(input.context.control.initial_bank_rad),
            Mode::RangeControl => self.range_control(input, on_the_second, &mut output, probe),
            Mode::HeadingAlignment => self.heading_alignment(input, on_the_second, &mut output),
            Mode::DegradedRangeControl => self.cycle.clear(),
            Mode::DegradedHeadingAlignment | Mode::Deployed => self.command_rad = 0.0,
        }
        if !matches!(input.mode, Mode::RangeControl) {
            self.cycle.clear();
        }
        output.bank_rad = self.command_rad;
        probe.kernel_done(Kernel::Corrector, 1);
        output
    }

    /// Learns the air, and tabulates it in the second half of a second for the cycle that begins in the next.
    fn learn(&mut self, input: &GuidanceInput<'_>) {
        let context = &input.context;
        let frame = input.frame % FRAMES_PER_SECOND;
        // Only the alignment that is rehearsed asks for the air.
        let is_aligned_without = input.mode == Mode::HeadingAlignment && context.mode != GuidanceMode::Aeroshell;
        if context.learns() && !is_aligned_without {
            self.adaptation.observe(input.estimate, context.model, context.force_noise_mps2);
            // No cycle needs the air in the last frame.
            match frame {
                TABLE_BEGINS => self.adaptation.begin_table(),
                TABLE_ENDS => self.adaptation.publish(input.context.model, &mut self.air),
                frame if frame > TABLE_BEGINS => self.adaptation.continue_table(),
                _ => {}
            }
        }
    }

    /// Range control: cycles of one second.
    #[inline(never)]
    fn range_control(
        &mut self,
        input: &GuidanceInput<'_>,
        on_the_second: bool,
        output: &mut GuidanceOutput,
        probe: &mut impl Probe,
    ) {
        if on_the_second {
            if self.side == 0.0 {
                self.side = if self.command_rad < 0.0 { -1.0 } else { 1.0 };
            }
            let course = usable_course(input.estimate);
            if let Some(course) = &course {
                if input.context.mode == GuidanceMode::Apollo {
                    let result = self.terminal(course, input);
                    self.take_effect(&result, course, input, output);
                    output.telemetry = Some(self.report(None, Some(&result), course, input));
                } else {
                    self.next_cycle(course, input, output);
                }
            } else {
                self.cycle.clear();
                output.telemetry = Some(self.held(input));
            }
            self.cycles = self.cycles.saturating_add(1);
        }
        if let (Some(cycle), false) = (self.cycle.get_mut(), input.shed) {
            let context = input.context.cycle(&self.air, &self.segments, &self.aim);
            // The last frame of a second is spare.
            let frames_left = FRAMES_PER_SECOND.saturating_sub(1 + input.frame % FRAMES_PER_SECOND);
            let quota = cycle.quota(frames_left, self.longest_prediction, input.context.model);
            cycle.advance(quota, &context, probe);
        }
    }

    /// Puts the cycle that has ended into effect and begins the next.
    fn next_cycle(&mut self, course: &Course, input: &GuidanceInput<'_>, output: &mut GuidanceOutput) {
        let result = self.cycle.get().and_then(|ended| ended.result(input.context.constraints));
        if let Some(result) = &result {
            self.take_effect(result, course, input, output);
        }
        if let Some(ended) = self.cycle.get() {
            output.telemetry = Some(self.report(Some(ended), result.as_ref(), course, input));
            self.longest_prediction = ended.longest_prediction();
            self.slope_m = ended.slope_m();
        }
        if !input.context.learns() {
            self.air.set_constant(input.context.model, density::ratio(input.estimate));
        } else if self.air.is_none() {
            self.air.set_constant(input.context.model, 1.0);
        }
        if input.context.mode != GuidanceMode::Aeroshell {
            self.slope_m = None;
        }
        let start = self.cycle_start(input);
        self.segments.advance(&start.state, input.estimate.speed_mps);
        let GuidanceContext { mode, model, .. } = input.context;
        if mode == GuidanceMode::SegmentedTable && !segments::table_holds(model, self.aim.stop_speed_mps) {
            self.segments = Segments::PASSED;
        }
        self.cycle.put(Cycle::new(&start, input.context.guidance));
    }

    /// The command of terminal-point guidance.
    fn terminal(&self, course: &Course, input: &GuidanceInput<'_>) -> CycleResult {
        let (estimate, context) = (input.estimate, &input.context);
        apollo::Terminal {
            speed_mps: estimate.speed_mps,
            climb_mps: course.up.dot(&estimate.v_p),
            drag_mps2: felt::drag_mps2(estimate, context.model),
            range_to_go_m: course.range_m(&self.aim.target_p, context.model.planet.radius_m),
        }
        .command(cos(context.guidance.max_bank_rad), cos(context.guidance.min_bank_rad))
    }

    fn cycle_start(&self, input: &GuidanceInput<'_>) -> CycleStart {
        let ([x, y, z], [vx, vy, vz]) = (input.estimate.r_p.to_array(), input.estimate.v_p.to_array());
        CycleStart {
            state: [x, y, z, vx, vy, vz],
            bank_rad: wrap_angle(input.estimate.bank_rad),
            bank_rate_radps: input.estimate.bank_rate_radps,
            command_rad: self.command_rad,
            side: self.side,
            slope_m: self.slope_m,
            frames_to_effect: FRAMES_PER_SECOND - input.frame % FRAMES_PER_SECOND,
        }
    }

    /// The command of an ended cycle: its magnitude, on the side that the lateral logic wants now.
    #[inline(never)]
    fn take_effect(
        &mut self,
        result: &CycleResult,
        course: &Course,
        input: &GuidanceInput<'_>,
        output: &mut GuidanceOutput,
    ) {
        let target_p = self.aim.target_p;
        let offset_m = course.heading_offset_m(&target_p, input.context.model.planet.radius_m);
        let threshold_m = self.threshold_m(course, result.bank_rad, input);
        let side = lateral::side(self.side, offset_m, threshold_m);
        self.command_rad = side * result.bank_rad;
        if side != self.side {
            self.side = side;
            self.reversals = self.reversals.saturating_add(1);
            output.reversal = Some(self.command_rad);
        }
        output.verdict = self.reach.judge(result);
    }

    /// Heading alignment: a new command in every frame, a report once a second.
    #[inline(never)]
    fn heading_alignment(&mut self, input: &GuidanceInput<'_>, on_the_second: bool, output: &mut GuidanceOutput) {
        let (estimate, context) = (input.estimate, &input.context);
        let course = usable_course(estimate);
        if let (Some(_), Some(steering)) = (&course, context.steering(&self.aim)) {
            self.command_rad = self.sighted(estimate, context, &steering);
        } else if course.is_some() {
            let state = AlignmentState {
                r_p: &estimate.r_p,
                v_p: &estimate.v_p,
                target_p: &self.aim.target_p,
                density_ratio: density::ratio(estimate),
            };
            if let Some(bank_rad) = self.alignment.command(&state, context.model, context.guidance) {
                self.command_rad = bank_rad;
            }
        }
        if on_the_second {
            self.cycles = self.cycles.saturating_add(1);
            output.telemetry = Some(match &course {
                Some(course) => GuidanceTlm { outcome: CycleOutcome::Alignment, ..self.where_we_are(course, input) },
                None => self.held(input),
            });
        }
    }

    /// The bank of proportional navigation from the estimate.
    #[inline(never)]
    fn sighted(&self, estimate: &Estimate, context: &GuidanceContext<'_>, steering: &Steering<'_>) -> f64 {
        let ([x, y, z], [vx, vy, vz]) = (estimate.r_p.to_array(), estimate.v_p.to_array());
        let state = [x, y, z, vx, vy, vz];
        let model = Adapted { model: context.model, air: &self.air };
        let bank = BankState { bank_rad: 0.0, rate_radps: 0.0 };
        let [ax, ay, az] = predictor::acceleration(&model, &state, &predictor::Bank::of(0.0));
        let lift_mps2 = model.lift_mps2(estimate.altitude_m, estimate.speed_mps);
        Sight::new(&state, estimate.r_p.norm(), steering).command(&[ax, ay, az], &bank, lift_mps2, steering)
    }

    /// The report of an ended cycle; `Held` when it found nothing.
    #[inline(never)]
    fn report(
        &self,
        cycle: Option<&Cycle>,
        result: Option<&CycleResult>,
        course: &Course,
        input: &GuidanceInput<'_>,
    ) -> GuidanceTlm {
        let count = |n: usize| u8::try_from(n).unwrap_or(u8::MAX);
        let common = GuidanceTlm {
            iterations: cycle.map_or(0, |cycle| count(cycle.iterations())),
            predictions: cycle.map_or(0, |cycle| count(cycle.predictions())),
            evaluations: cycle.map_or(0, Cycle::evaluations),
            ..self.where_we_are(course, input)
        };
        let Some(result) = result else { return GuidanceTlm { outcome: CycleOutcome::Held, ..common } };
        GuidanceTlm {
            predicted_downrange_error_m: result.error_m,
            outcome: result.outcome,
            margins: result.peaks.margins(input.context.constraints).map(single),
            ..common
        }
    }

    /// The part of a report that needs no prediction.
    #[inline(never)]
    fn where_we_are(&self, course: &Course, input: &GuidanceInput<'_>) -> GuidanceTlm {
        let (target_p, radius_m) = (self.aim.target_p, input.context.model.planet.radius_m);
        GuidanceTlm {
            range_to_go_m: course.range_m(&target_p, radius_m),
            heading_offset_m: course.heading_offset_m(&target_p, radius_m),
            heading_threshold_m: self.threshold_m(course, self.command_rad, input),
            ..self.held(input)
        }
    }

    /// A report that says only which command is held.
    fn held(&self, input: &GuidanceInput<'_>) -> GuidanceTlm {
        GuidanceTlm {
            cycle: self.cycles,
            effective: input.now,
            bank_rad: self.command_rad,
            outcome: CycleOutcome::Held,
            reversals: self.reversals,
            ..GuidanceTlm::default()
        }
    }

    /// Threshold of the heading offset, m, with a bank.
    #[inline(never)] // twice a second
    fn threshold_m(&self, course: &Course, bank_rad: f64, input: &GuidanceInput<'_>) -> f64 {
        let speed_mps = input.estimate.speed_mps;
        match input.context.steering(&self.aim) {
            Some(steering) => {
                let away = (course.up - self.aim.target_p).norm();
                steering.threshold_m(away, speed_mps, sin(bank_rad))
            }
            None => lateral::threshold_m(speed_mps, input.context.guidance),
        }
    }
}

/// The course of an estimate that may be steered by.
fn usable_course(estimate: &Estimate) -> Option<Course> {
    let finite = estimate.bank_rad.is_finite() && estimate.bank_rate_radps.is_finite();
    if estimate.valid && finite { Course::new(&estimate.r_p, &estimate.v_p) } else { None }
}

/// A margin for the report, brought into a range that single precision holds.
#[allow(clippy::cast_possible_truncation)] // bounded just before
fn single(margin: f64) -> f32 {
    clamp(margin, -1e6, 1.0) as f32
}

#[cfg(test)]
mod tests;
