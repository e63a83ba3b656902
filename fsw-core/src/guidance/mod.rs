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
mod context;
pub mod corrector;
pub mod course;
pub mod cycle;
pub mod density;
pub mod felt;
pub mod heading;
pub mod lateral;
pub mod predictor;
mod ranging;
pub mod reach;
mod report;
pub mod segments;
pub mod steering;
pub mod tables;
pub mod trigger;
pub mod turn;

use crate::link::packet::{CycleOutcome, GuidanceTlm, Mode};
use crate::link::parameters::GuidanceMode;
use crate::math::fun::sin;
use crate::math::num::wrap_angle;
use crate::nav::Estimate;
use crate::probe::{Kernel, NoProbe, Probe};
use crate::slot::Slot;
use crate::time::{FRAMES_PER_SECOND, MissionTime};

use adaptation::Adaptation;
use air::{Adapted, AirProfile};
use context::Aim;
pub use context::{GuidanceContext, alignment_speed_mps};
use course::Course;
use cycle::Cycle;
use heading::{Alignment, AlignmentState};
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
    /// Other work of this frame is much: the predictor rests if it can make up for it. What it finds does not depend on that.
    pub crowded: bool,
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

#[cfg(test)]
mod tests;
