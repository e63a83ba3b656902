//! One guidance cycle as a resumable computation: propagate to the instant of effect, predict, correct, check constraints.
//!
//! A cycle starts on a whole second, is advanced by a quota of Runge–Kutta steps in each minor frame, and its result acts at the next whole second, converged or best so far. Nothing of it depends on how it was sliced.

mod answer;
mod terms;

pub use terms::{CycleContext, CycleResult, CycleStart};

use crate::control;
use crate::link::parameters::GuidanceParameters;
use crate::math::fun::sqrt;
use crate::math::num::{clamp, wrap_angle};
use crate::model::OnboardModel;
use crate::probe::{Kernel, Probe};
use crate::time::{FRAME, FRAMES_PER_SECOND};

use super::air::Adapted;
use super::constraints::Peaks;
use super::corrector::{Corrector, MAX_PREDICTIONS, Sample, Search, bank_of};
use super::predictor::{
    self, Bank, EVALUATIONS_PER_EVENT, EVALUATIONS_PER_STEP, EVALUATIONS_TO_START, Prediction, acceleration, stepped,
};
use super::steering::Pilot;
use super::turn::BankState;

/// Evaluations of the equations of motion in one cycle, at most, whatever the parameters say.
pub const MAX_EVALUATIONS: u16 = 2400;
/// Work of one predictor step, the unit of quotas being a quarter of it, and of one in which the bank turns.
pub const STEP_WORK: u32 = 4;
const TURNING_STEP_WORK: u32 = 7;
/// Work in one minor frame, at most.
pub const WORK_PER_FRAME: u32 = 50;
/// The same where coefficients go by Mach number, which makes an evaluation cost half as much again: a cycle may then make
/// 1,344 evaluations.
const WORK_PER_FRAME_BY_MACH: u32 = 28;
/// Work that ending a cycle and beginning the next is worth; the frame that does it computes so much less.
pub(super) const BEGINNING_WORK: u32 = 10;
/// Work in one minor frame, at least: before its first step a slice costs as much as a tenth of one.
const SHORTEST_SLICE: u32 = 12;
/// Work of one step of the propagation, which flies the bank control as well.
const PROPAGATION_WORK: u32 = 12;
/// Minor frames that one step of the propagation to the instant of effect covers.
const PROPAGATION_FRAMES: u32 = 10;
/// Minor frames of a cycle in which predictions are made that were not to be expected.
const LATER_FRAMES: u32 = FRAMES_PER_SECOND * 3 / 5;
/// Minor frames of the others in which a cycle may rest, because other work crowds them.
const MAX_RESTS: u32 = 4;
/// Shortest and longest predictor step, s; parameters beyond are brought to the nearer one.
const PREDICTOR_STEP_RANGE_S: (f64, f64) = (0.1, 20.0);

// The frame before the effect must not be needed: 48 frames finish even the longest cycle.
const _: () = assert!(
    WORK_PER_FRAME * (FRAMES_PER_SECOND - 2) * EVALUATIONS_PER_STEP as u32 / STEP_WORK >= MAX_EVALUATIONS as u32
);

/// Work in one minor frame, at most, over this model.
fn most_work(model: &OnboardModel) -> u32 {
    if model.aero.depends_on_mach() { WORK_PER_FRAME_BY_MACH } else { WORK_PER_FRAME }
}

/// One predicted flight.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Flown {
    sample: Sample,
    /// How far the target lies to the side of the end that the path began on, m.
    aside_m: f64,
    peaks: Peaks,
}

/// A guidance cycle under way.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycle {
    start: CycleStart,
    frames_left: u32,
    corrector: Corrector,
    flying: Option<Prediction>,
    /// Cosine of the bank of the prediction under way.
    cos_bank: f64,
    flown: heapless::Vec<Flown, MAX_PREDICTIONS>,
    evaluations: u16,
    /// Work of the prediction under way, and of the longest so far.
    work: u32,
    longest: u32,
    /// Minor frames in which it has rested.
    rests: u32,
    finished: bool,
}

impl Cycle {
    /// A cycle that has not computed anything yet.
    #[must_use]
    pub fn new(start: &CycleStart, guidance: &GuidanceParameters) -> Self {
        let search = Search {
            min_bank_rad: guidance.min_bank_rad,
            max_bank_rad: guidance.max_bank_rad,
            first_bank_rad: start.command_rad,
            increment_rad: guidance.bank_increment_rad,
            tolerance_m: guidance.tolerance_m,
            max_iterations: guidance.max_iterations,
            slope_m: start.slope_m,
        };
        Self {
            start: *start,
            frames_left: start.frames_to_effect,
            corrector: Corrector::new(&search),
            flying: None,
            cos_bank: 0.0,
            flown: heapless::Vec::new(),
            evaluations: 0,
            work: 0,
            longest: 0,
            rests: 0,
            finished: false,
        }
    }

    /// Computes on until so much work is done, but at least one step unless it is none.
    pub fn advance(&mut self, work: u32, context: &CycleContext<'_>, probe: &mut impl Probe) {
        let mut left = work;
        while self.frames_left > 0 && left > 0 {
            self.propagate(context);
            left = left.saturating_sub(PROPAGATION_WORK);
        }
        let (shortest, longest) = PREDICTOR_STEP_RANGE_S;
        let step_s = clamp(context.guidance.predictor_step_s, shortest, longest);
        let model = Self::model(context);
        probe.kernel_done(Kernel::Corrector, 0);
        // Each turn but the last flies a step or more.
        while left > 0 && !self.finished {
            let before = self.evaluations;
            if self.flying.is_none() {
                self.take_off(&model, context, probe);
            }
            let (work, ended) = self.fly_on(left, &model, step_s, context);
            probe.kernel_done(Kernel::Predictor, u32::from(self.evaluations.saturating_sub(before)));
            left = left.saturating_sub(work);
            if ended {
                self.land(context);
            }
            probe.kernel_done(Kernel::Corrector, 0);
        }
    }

    /// The quota that makes the prediction to be expected in the first two fifths of the second, and finishes the cycle just in
    /// time if every prediction allowed is made, each as long as the longest so far, of this cycle or, `longest_before`, of
    /// the one before: so all frames of a second cost about the same. The first two fifths are longer by the frames of rest.
    #[must_use]
    pub fn quota(&self, frames_left: u32, longest_before: u32, model: &OnboardModel) -> u32 {
        // With a slope remembered one prediction is enough, most of the time.
        let soon = self.start.slope_m.is_some() && self.flown.is_empty();
        let later = LATER_FRAMES.saturating_sub(self.rests);
        let (to_make, frames_left) =
            if soon && frames_left > later { (1, frames_left - later) } else { (self.predictions_left(), frames_left) };
        let work = self.work_left(to_make, longest_before);
        work.div_ceil(frames_left.max(1)).clamp(SHORTEST_SLICE, most_work(model))
    }

    /// Whether the cycle rests in a frame that other work crowds, with so many left; counted. Not too often, nor in the later
    /// frames of a second, nor when the others could not make up for it: the cycle has to end in time, and in a second that is
    /// crowded throughout no frame stands out.
    pub fn rests(&mut self, frames_left: u32, longest_before: u32, model: &OnboardModel) -> bool {
        let can_wait = self.work_left(self.predictions_left(), longest_before)
            <= most_work(model).saturating_mul(frames_left.saturating_sub(1));
        let rests = frames_left > LATER_FRAMES && self.rests < MAX_RESTS && can_wait;
        self.rests += u32::from(rests);
        rests
    }

    fn predictions_left(&self) -> usize {
        self.corrector.max_predictions().saturating_sub(self.flown.len())
    }

    /// Work of so many predictions, that under way among them, each as long as the longest so far.
    fn work_left(&self, predictions: usize, longest_before: u32) -> u32 {
        let longest = longest_before.max(self.longest).max(self.work + STEP_WORK);
        let propagation = PROPAGATION_WORK * self.frames_left.div_ceil(PROPAGATION_FRAMES);
        propagation + (longest * u32::try_from(predictions).unwrap_or(0)).saturating_sub(self.work)
    }

    /// Work of the longest prediction, finished or not.
    #[must_use]
    pub fn longest_prediction(&self) -> u32 {
        self.longest
    }

    /// The onboard model in the air that navigation found when the cycle started.
    fn model<'a>(context: &CycleContext<'a>) -> predictor::Flown<'a> {
        Adapted { model: context.model, air: context.air }
    }

    #[inline(never)] // five times a second
    /// One step towards the instant of effect, under the bank that control will fly meanwhile.
    fn propagate(&mut self, context: &CycleContext<'_>) {
        let frames = self.frames_left.min(PROPAGATION_FRAMES);
        let bank_before = self.start.bank_rad;
        let frame_s = FRAME.as_s();
        for _ in 0..frames {
            let s = &mut self.start;
            let demand = control::step(s.bank_rad, s.bank_rate_radps, s.command_rad, context.control);
            s.bank_rad += (s.bank_rate_radps + 0.5 * demand.accel_radps2 * frame_s) * frame_s;
            s.bank_rate_radps = demand.rate_radps;
        }
        let step_s = f64::from(frames) * frame_s;
        let model = Self::model(context);
        let rate = (self.start.bank_rad - bank_before) / step_s;
        let banks = [0.0, 0.5, 1.0].map(|share| Bank::of(wrap_angle(bank_before + rate * share * step_s)));
        let [first, ..] = &banks;
        let acceleration = acceleration(&model, &self.start.state, first);
        let state = self.start.state;
        stepped(&model, &state, &acceleration, step_s, &banks, &mut self.start.state);
        self.evaluations = self.evaluations.saturating_add(EVALUATIONS_PER_STEP);
        self.frames_left -= frames;
    }

    /// So much work at the prediction under way, or a step more: how much, and whether it reaches the end. Finishes the
    /// cycle when there is none or no evaluation is left.
    #[inline]
    fn fly_on(
        &mut self,
        most: u32,
        model: &predictor::Flown<'_>,
        step_s: f64,
        context: &CycleContext<'_>,
    ) -> (u32, bool) {
        let affordable =
            MAX_EVALUATIONS.saturating_sub(self.evaluations) / (EVALUATIONS_PER_STEP + EVALUATIONS_PER_EVENT);
        let (Some(prediction), true) = (&mut self.flying, affordable > 0) else {
            self.finished = true;
            return (0, false);
        };
        let (mut work, mut steps, mut ended) = (0, 0, false);
        let (before, steering) = (prediction.evaluations(), context.steering.as_ref());
        while work < most && steps < affordable && !ended {
            ended = prediction.step(model, step_s, &context.stop, steering);
            work += if prediction.is_turning() { TURNING_STEP_WORK } else { STEP_WORK };
            steps += 1;
        }
        self.evaluations = self.evaluations.saturating_add(prediction.evaluations().saturating_sub(before));
        self.work += work;
        self.longest = self.longest.max(self.work);
        (work, ended)
    }

    /// Starts the next prediction, if there is one to make and evaluations to make it with.
    // Once in a prediction. Inlined, this and `land` would have all their addresses found before the first step of a slice.
    #[inline(never)]
    fn take_off(&mut self, model: &predictor::Flown<'_>, context: &CycleContext<'_>, probe: &mut impl Probe) {
        if self.evaluations.saturating_add(EVALUATIONS_TO_START) > MAX_EVALUATIONS || self.flown.is_full() {
            return;
        }
        let Some(cos_bank) = self.corrector.next().or_else(|| self.relief_to_try(context)) else { return };
        probe.kernel_done(Kernel::Corrector, 0);
        self.evaluations += EVALUATIONS_TO_START;
        self.cos_bank = cos_bank;
        let s = &self.start;
        self.flying = Some(if context.steering.is_some() {
            let bank = BankState { bank_rad: wrap_angle(s.bank_rad), rate_radps: s.bank_rate_radps };
            Prediction::rehearsed(model, &s.state, Pilot::new(bank, bank_of(cos_bank), s.side))
        } else {
            let sin_bank = s.side * sqrt(clamp(1.0 - cos_bank * cos_bank, 0.0, 1.0));
            Prediction::held(model, &s.state, cos_bank, sin_bank)
        });
    }

    /// Notes what a prediction found; a path without a finite length ends the cycle with what there is.
    ///
    /// The downrange error is counted at the reference radius: along the arc from here to the target, or along the last course
    /// of a path that comes to the target.
    #[inline(never)]
    fn land(&mut self, context: &CycleContext<'_>) {
        let cos_bank = self.cos_bank;
        let Some(end) = self.flying.take().map(|prediction| prediction.end()) else { return };
        self.work = 0;
        let beyond_rad = match &context.steering {
            Some(_) => end.beyond_rad(&context.target_p),
            None => end.beyond_along_arc_rad(&self.start.state, &context.target_p),
        };
        let radius_m = context.model.planet.radius_m;
        let model = Self::model(context);
        let remainder_m = context.remainder.map_or(0.0, |segment| segment.remainder_m(&end.state, &model, cos_bank));
        let error_m = beyond_rad.map_or(f64::NAN, |beyond| beyond * radius_m) + remainder_m;
        if !error_m.is_finite() {
            self.finished = true;
            return;
        }
        let sample = Sample { cos_bank, error_m };
        if self.corrector.next().is_some() {
            self.corrector.take(sample);
        }
        // A held prediction banks to one side all the way, or is cut short: where it ends abeam says nothing.
        let aside_rad = context.steering.and_then(|_| end.aside_rad(&context.target_p));
        let aside_m = aside_rad.map_or(0.0, |aside| self.start.side * aside * radius_m);
        let _ = self.flown.push(Flown { sample, aside_m, peaks: end.peaks });
    }

    /// True when nothing is left to compute.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// Evaluations of the equations of motion so far.
    #[must_use]
    pub fn evaluations(&self) -> u16 {
        self.evaluations
    }

    /// Predictions completed.
    #[must_use]
    pub fn predictions(&self) -> usize {
        self.flown.len()
    }

    /// Secant iterations made.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.corrector.iterations()
    }
}
