//! Range control: a cycle of the predictor-corrector, or of terminal-point guidance, once a second.

use super::context::GuidanceContext;
use super::course::Course;
use super::cycle::{BEGINNING_WORK, Cycle, CycleResult, CycleStart};
use super::segments::Segments;
use super::{Guidance, GuidanceInput, GuidanceOutput, apollo, density, felt, lateral, segments, usable_course};
use crate::link::parameters::GuidanceMode;
use crate::math::fun::cos;
use crate::math::num::wrap_angle;
use crate::probe::Probe;
use crate::time::FRAMES_PER_SECOND;

impl Guidance {
    /// Range control: cycles of one second.
    #[inline(never)]
    pub(super) fn range_control(
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
            let (longest, model) = (self.longest_prediction, input.context.model);
            if !(input.crowded && cycle.rests(frames_left, longest, model)) {
                let quota = cycle.quota(frames_left, longest, model);
                let begun = if on_the_second { BEGINNING_WORK } else { 0 };
                cycle.advance(quota.saturating_sub(begun), &context, probe);
            }
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
}
