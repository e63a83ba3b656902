//! The predictor: flies the onboard model to the parachute trigger, a few steps at a time.
//!
//! Planet-fixed Cartesian equations with rotation and J2, classical Runge–Kutta steps. The stop is found
//! inside the last step by cubic interpolation: stopping on the grid costs hundreds of metres even at 1 s.
//!
//! Two ways to steer a prediction. *Held*: a constant bank, as P4 prints it. *Rehearsed*: what the flight will do, see
//! [`Steering`]: reversals, turns of finite rate and acceleration, heading alignment.
//!
//! The range flown is that of the end point along an arc, not the length of the ground track (P4 eq. 2), which is 1.5 to
//! 5.5 km longer from entry.

use crate::frames::{PlanetFixed, Vec3};
use crate::math::fun::{asin, atan2, sin_cos};
use crate::math::num::{clamp, min};
use crate::model::entry::cartesian_rates_and_flow;

use super::air::Adapted;
use super::constraints::{self, Peaks};
use super::course::Course;
use super::steering::{Pilot, Steering};

/// Evaluations of the equations of motion that one [`Prediction::step`] takes.
pub const EVALUATIONS_PER_STEP: u16 = 4;
/// One more where the command changes within the step.
pub const EVALUATIONS_PER_EVENT: u16 = 1;
/// Evaluations that starting a prediction takes.
pub const EVALUATIONS_TO_START: u16 = 1;
/// Newton steps to find the stop inside a step; the cubic is nearly straight, three are enough.
const STOP_ITERATIONS: u32 = 5;

/// Axes of space.
const AXES: usize = 3;

/// Position (m) and planet-relative velocity (m/s), planet-fixed axes.
pub type State = [f64; 6];

/// The model that a prediction flies: the onboard model in the air that was found.
pub type Flown<'a> = Adapted<'a>;

/// Where a prediction ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Planet-relative speed, m/s: the parachute trigger.
    pub speed_mps: f64,
    /// Distance from the planet's centre, m: the altitude floor.
    pub radius_m: f64,
    /// Longest flight, s.
    pub horizon_s: f64,
}

/// What a prediction found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathEnd {
    /// End of the path: position and velocity. Not finite when the path was not.
    pub state: State,
    /// Duration of the predicted flight, s.
    pub duration_s: f64,
    /// Peaks of the loads on the way.
    pub peaks: Peaks,
}

impl PathEnd {
    /// How far to the right of the last course the target (unit vector) lies, as an angle at the planet's centre, rad.
    #[must_use]
    pub fn aside_rad(&self, target_p: &Vec3<PlanetFixed>) -> Option<f64> {
        let [x, y, z, vx, vy, vz] = self.state;
        let course = Course::new(&Vec3::new(x, y, z), &Vec3::new(vx, vy, vz))?;
        Some(asin(clamp(target_p.dot(&course.right), -1.0, 1.0)))
    }

    /// How far beyond the target (unit vector) the path ends, along its last course, as an angle at the planet's centre, rad.
    #[must_use]
    pub fn beyond_rad(&self, target_p: &Vec3<PlanetFixed>) -> Option<f64> {
        let [x, y, z, vx, vy, vz] = self.state;
        let course = Course::new(&Vec3::new(x, y, z), &Vec3::new(vx, vy, vz))?;
        Some(-atan2(target_p.dot(&course.ahead), target_p.dot(&course.up)))
    }

    /// Downrange of the end of a path that began at `start`, along the arc from there to the target (unit vector), less that
    /// of the target, as an angle at the planet's centre, rad.
    #[must_use]
    pub fn beyond_along_arc_rad(&self, start: &State, target_p: &Vec3<PlanetFixed>) -> Option<f64> {
        let ([x, y, z, ..], [ex, ey, ez, ..]) = (*start, self.state);
        let up = Vec3::<PlanetFixed>::new(x, y, z).unit()?;
        let ahead = (*target_p - up * up.dot(target_p)).unit()?;
        let end = Vec3::new(ex, ey, ez);
        Some(atan2(end.dot(&ahead), end.dot(&up)) - atan2(target_p.dot(&ahead), target_p.dot(&up)))
    }
}

/// A point of the path: the state and all that follows from it, found once and used by the steps on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) state: State,
    pub(super) acceleration: [f64; AXES],
    pub(super) radius_m: f64,
    pub(super) speed_mps: f64,
    /// Lift acceleration, m/s².
    pub(super) lift_mps2: f64,
}

impl Node {
    const NONE: Self =
        Self { state: [0.0; 6], acceleration: [0.0; AXES], radius_m: 0.0, speed_mps: 0.0, lift_mps2: 0.0 };

    /// Fills in what follows from the state; the loads there. One evaluation of the equations of motion.
    #[inline(always)]
    fn evaluate(&mut self, model: &Flown<'_>, bank: &Bank) -> [f64; constraints::CONSTRAINTS] {
        let state = &self.state;
        let (rates, flow) = cartesian_rates_and_flow(model, state, bank.cosine, bank.sine);
        let [_, _, _, ax, ay, az] = rates;
        self.acceleration = [ax, ay, az];
        self.radius_m = flow.radius_m;
        self.speed_mps = flow.speed_mps;
        let [drag, loads @ ..] = constraints::loads(model.model, &flow);
        self.lift_mps2 = drag * flow.lift_coefficient / flow.drag_coefficient;
        loads
    }

    fn is_past(&self, stop: &Stop) -> bool {
        self.speed_mps <= stop.speed_mps || self.radius_m <= stop.radius_m
    }
}

/// Cosine and sine of a bank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bank {
    pub(super) cosine: f64,
    pub(super) sine: f64,
}

impl Bank {
    /// Of a bank angle, rad.
    #[must_use]
    #[inline(never)] // in turns only
    pub(super) fn of(bank_rad: f64) -> Self {
        let (sine, cosine) = sin_cos(bank_rad);
        Self { cosine, sine }
    }
}

/// A prediction under way. Fixed size, resumed by [`Prediction::step`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// The last point reached and the one before, in turn: copying them costs a tenth of an evaluation.
    nodes: [Node; 2],
    /// Whether the second is the last one.
    odd: bool,
    bank: Bank,
    /// Who steers; nobody in a held prediction.
    pilot: Option<Pilot>,
    elapsed_s: f64,
    peaks: Peaks,
    /// Evaluations so far.
    evaluations: u16,
}

impl Prediction {
    /// Starts at `state` with a constant bank. One evaluation.
    #[must_use]
    #[inline(always)] // into its place: it is large
    pub fn held(model: &Flown<'_>, state: &State, cos_bank: f64, sin_bank: f64) -> Self {
        Self::start(model, state, Bank { cosine: cos_bank, sine: sin_bank }, None)
    }

    /// Starts at `state` with a pilot. One evaluation.
    #[must_use]
    #[inline(always)] // into its place: it is large
    pub fn rehearsed(model: &Flown<'_>, state: &State, pilot: Pilot) -> Self {
        Self::start(model, state, Bank::of(pilot.bank_rad()), Some(pilot))
    }

    #[inline(always)]
    fn start(model: &Flown<'_>, state: &State, bank: Bank, pilot: Option<Pilot>) -> Self {
        let mut node = Node { state: *state, ..Node::NONE };
        let loads = node.evaluate(model, &bank);
        Self {
            nodes: [node, Node::NONE],
            odd: false,
            bank,
            pilot,
            elapsed_s: 0.0,
            peaks: Peaks::starting(loads),
            evaluations: EVALUATIONS_TO_START,
        }
    }

    /// Flies one step of at most `step_s`, four or five evaluations; true once the end of the path has been reached.
    ///
    /// The path ends at the stop speed or the stop radius, whichever comes first, else at the horizon, or where the state
    /// ceases to be finite.
    // Kept whole: inlined into the frame it would share its sixteen registers with everything around.
    #[inline(never)]
    #[must_use]
    pub fn step(&mut self, model: &Flown<'_>, step_s: f64, stop: &Stop, steering: Option<&Steering<'_>>) -> bool {
        let [even, odd] = &mut self.nodes;
        let (before, after) = if self.odd { (&*odd, even) } else { (&*even, odd) };
        // Later nodes that lie past the stop have ended the path.
        if self.elapsed_s == 0.0 && before.is_past(stop) {
            return true;
        }
        let mut banks = [self.bank; 3];
        let mut step_s = step_s;
        if let (Some(pilot), Some(steering)) = (&mut self.pilot, steering) {
            step_s = pilot.plan(before, step_s, steering, &mut banks);
        }
        stepped(model, &before.state, &before.acceleration, step_s, &banks, &mut after.state);
        let [_, _, bank] = banks;
        let loads = after.evaluate(model, &bank);
        self.evaluations = self.evaluations.saturating_add(EVALUATIONS_PER_STEP);
        self.bank = bank;
        self.odd = !self.odd;
        if after.is_past(stop) {
            let share = share_before_stop([before, after], step_s, stop);
            self.elapsed_s += share * step_s;
            after.state = between(before, after, step_s, share);
            return true;
        }
        self.elapsed_s += step_s;
        if let (Some(pilot), Some(steering)) = (&mut self.pilot, steering)
            && let Some(share) = pilot.arrive([before, after], step_s, steering)
        {
            // Something happens within the step: back to there.
            self.elapsed_s -= (1.0 - share) * step_s;
            after.state = between(before, after, step_s, share);
            self.bank = Bank::of(pilot.bank_rad());
            let _ = after.evaluate(model, &self.bank);
            self.evaluations = self.evaluations.saturating_add(EVALUATIONS_PER_EVENT);
        }
        self.peaks.push(loads);
        // Written so that a state that is not finite ends the path too.
        let goes_on = self.elapsed_s < stop.horizon_s && after.speed_mps.is_finite();
        !goes_on
    }

    /// Evaluations of the equations of motion so far.
    #[must_use]
    pub fn evaluations(&self) -> u16 {
        self.evaluations
    }

    /// Whether the bank turned in the last step, which makes it dearer.
    #[inline(always)]
    #[must_use]
    pub(super) fn is_turning(&self) -> bool {
        self.pilot.is_some_and(|pilot| pilot.is_turning())
    }

    /// The last point reached.
    fn last(&self) -> &Node {
        let [even, odd] = &self.nodes;
        if self.odd { odd } else { even }
    }

    /// What the prediction has found so far; at its end, all.
    #[must_use]
    pub fn end(&self) -> PathEnd {
        PathEnd { state: self.last().state, duration_s: self.elapsed_s, peaks: self.peaks }
    }
}

/// The state at a share of a step: the cubic through state and rates at both its ends.
#[inline(never)] // a few times in a prediction
#[allow(clippy::indexing_slicing)] // constant indices into the six numbers of a state, the three of its axes
fn between(a: &Node, b: &Node, step_s: f64, share: f64) -> State {
    let mut state = [0.0; 6];
    for k in 0..AXES {
        state[k] = cubic([a.state[k], b.state[k]], [a.state[AXES + k], b.state[AXES + k]], step_s, share);
        let rates = [a.acceleration[k], b.acceleration[k]];
        state[AXES + k] = cubic([a.state[AXES + k], b.state[AXES + k]], rates, step_s, share);
    }
    state
}

/// Cubic Hermite interpolation at a share of a step.
#[inline(never)] // a few times in a prediction
fn cubic([y0, y1]: [f64; 2], [rate0, rate1]: [f64; 2], step_s: f64, share: f64) -> f64 {
    let (slope0, slope1, rise) = (rate0 * step_s, rate1 * step_s, y1 - y0);
    let (b, c) = (3.0 * rise - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * rise);
    y0 + share * (slope0 + share * (b + share * c))
}

/// One classical Runge–Kutta step, written for x'' = a(x, x'): with h the step and a₁ … a₄ the accelerations at its four
/// stages, x⁺ = x + h v + h²/6 (a₁ + a₂ + a₃), v⁺ = v + h/6 (a₁ + 2 a₂ + 2 a₃ + a₄). The same as [`rk4`](crate::math::rk4)
/// on all six but for rounding, with half the numbers to carry.
#[inline(never)]
#[allow(clippy::indexing_slicing)] // constant indices into the six numbers of a state, the three of its axes
pub(super) fn stepped(
    model: &Flown<'_>,
    s: &State,
    a1: &[f64; AXES],
    step_s: f64,
    [_, middle, last]: &[Bank; 3],
    after: &mut State,
) {
    let (half_s, half_square) = (0.5 * step_s, 0.5 * step_s * step_s);
    let mut stage = *s;
    for k in 0..AXES {
        stage[k] = s[k] + half_s * s[AXES + k];
        stage[AXES + k] = s[AXES + k] + half_s * a1[k];
    }
    let a2 = acceleration(model, &stage, middle);
    for k in 0..AXES {
        stage[k] += 0.5 * half_square * a1[k];
        stage[AXES + k] = s[AXES + k] + half_s * a2[k];
    }
    let a3 = acceleration(model, &stage, middle);
    let mut straight = [0.0; AXES];
    for k in 0..AXES {
        straight[k] = s[k] + step_s * s[AXES + k];
        stage[k] = straight[k] + half_square * a2[k];
        stage[AXES + k] = s[AXES + k] + step_s * a3[k];
    }
    let a4 = acceleration(model, &stage, last);
    let (sixth_s, sixth_square) = (step_s * (1.0 / 6.0), step_s * step_s * (1.0 / 6.0));
    for k in 0..AXES {
        let inner = a2[k] + a3[k];
        after[k] = straight[k] + sixth_square * (a1[k] + inner);
        after[AXES + k] = s[AXES + k] + sixth_s * (a1[k] + (inner + inner) + a4[k]);
    }
}

/// Acceleration at a state, planet-fixed axes, m/s².
#[inline(never)]
pub(super) fn acceleration(model: &Flown<'_>, state: &State, bank: &Bank) -> [f64; AXES] {
    let ([_, _, _, ax, ay, az], _) = cartesian_rates_and_flow(model, state, bank.cosine, bank.sine);
    [ax, ay, az]
}

/// Share of a step that lies before the stop, from the points at both its ends.
#[inline(never)] // once in a prediction
fn share_before_stop(ends: [&Node; 2], step_s: f64, stop: &Stop) -> f64 {
    let speeds = ends.map(|node| {
        let ([_, _, _, vx, vy, vz], [ax, ay, az]) = (&node.state, &node.acceleration);
        (node.speed_mps, (vx * ax + vy * ay + vz * az) / node.speed_mps)
    });
    let radii = ends.map(|node| {
        let [x, y, z, vx, vy, vz] = &node.state;
        (node.radius_m, (x * vx + y * vy + z * vz) / node.radius_m)
    });
    min(crossing(speeds, step_s, stop.speed_mps), crossing(radii, step_s, stop.radius_m))
}

/// Share of a step at which a falling quantity passes `level`, from its value and rate at both ends of the step by cubic
/// Hermite interpolation; 1 when it does not pass.
pub(super) fn crossing([(y0, rate0), (y1, rate1)]: [(f64, f64); 2], step_s: f64, level: f64) -> f64 {
    if y1 > level {
        return 1.0;
    }
    let (slope0, slope1, rise) = (rate0 * step_s, rate1 * step_s, y1 - y0);
    let (b, c) = (3.0 * rise - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * rise);
    let mut share = clamp((y0 - level) / (y0 - y1), 0.0, 1.0);
    for _ in 0..STOP_ITERATIONS {
        let value = y0 + share * (slope0 + share * (b + share * c));
        let slope = slope0 + share * (2.0 * b + 3.0 * share * c);
        if slope < 0.0 {
            share = clamp(share - (value - level) / slope, 0.0, 1.0);
        }
    }
    share
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::frames::PlanetRelative;
    use crate::guidance::air::AirProfile;
    use crate::model::OnboardModel;
    use crate::units::rad;

    fn model() -> OnboardModel {
        let c = Config::DEFAULT;
        let still = crate::planet::Planet { rotation_radps: 0.0, j2: 0.0, ..c.planet };
        OnboardModel::new(still, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
    }

    /// P4 Table 1.
    fn entry() -> State {
        let (r, v) = PlanetRelative {
            radius_m: 3_397_200.0 + 125.3e3,
            longitude_rad: rad(-90.072),
            latitude_rad: rad(-43.898),
            speed_mps: 5505.0,
            flight_path_angle_rad: rad(-14.15),
            heading_rad: rad(85.01),
        }
        .to_cartesian();
        let ([x, y, z], [vx, vy, vz]) = (r.to_array(), v.to_array());
        [x, y, z, vx, vy, vz]
    }

    const STOP: Stop = Stop { speed_mps: 450.0, radius_m: 3_397_200.0, horizon_s: 600.0 };

    fn fly(bank_deg: f64, step_s: f64, stop: &Stop) -> (Prediction, PathEnd, u32) {
        let model = model();
        let flown = Flown { model: &model, air: &AirProfile::nominal(&model) };
        let mut prediction = Prediction::held(&flown, &entry(), rad(bank_deg).cos(), rad(bank_deg).sin());
        for steps in 1..10_000 {
            if prediction.step(&flown, step_s, stop, None) {
                return (prediction, prediction.end(), steps);
            }
        }
        panic!("no end");
    }

    /// Great circle from entry, m at the reference radius.
    fn range_m([x, y, z, ..]: &State) -> f64 {
        let [x0, y0, z0, ..] = entry();
        let from = Vec3::<PlanetFixed>::new(x0, y0, z0);
        crate::frames::great_circle_rad(&from, &Vec3::new(*x, *y, *z)) * 3_397_200.0
    }

    #[test]
    fn the_papers_target_takes_42_degrees_and_ends_at_8_km_with_8_6_g() {
        // guidance.md §2: 745.737 km great circle, about 42° of constant bank, V = 450 m/s at 8.0 km, peak 8.6 g.
        let (mut low, mut high) = (20.0, 70.0);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            let (prediction, ..) = fly(middle, 0.1, &STOP);
            if range_m(&prediction.end().state) > 745_737.0 { low = middle } else { high = middle }
        }
        let (prediction, end, _) = fly(low, 0.1, &STOP);
        assert!((low - 42.0).abs() < 1.0, "bank {low}");
        let altitude_m = prediction.last().radius_m - 3_397_200.0;
        assert!((altitude_m - 8.0e3).abs() < 250.0, "altitude {altitude_m}");
        assert!((end.peaks.highest()[0] / 9.806_65 - 8.6).abs() < 0.2, "load {}", end.peaks.highest()[0] / 9.806_65);
    }

    #[test]
    fn steps_of_four_seconds_are_accurate_enough() {
        // guidance.md §4: 1.3 m of position at 4 s; the parabola's peaks are good to 1 %.
        for bank in [0.0, 30.0, 60.0, 90.0, 120.0] {
            let (_, fine, _) = fly(bank, 0.1, &STOP);
            let (_, coarse, steps) = fly(bank, 4.0, &STOP);
            let range_error_m = (range_m(&coarse.state) - range_m(&fine.state)).abs();
            assert!(range_error_m < 5.0, "bank {bank}: {range_error_m} m");
            assert!((coarse.duration_s - fine.duration_s).abs() < 0.02);
            for (a, b) in coarse.peaks.highest().iter().zip(fine.peaks.highest()) {
                assert!((a / b - 1.0).abs() < 0.01, "bank {bank}: peak {a} {b}");
            }
            assert!(steps < 110);
        }
    }

    #[test]
    fn the_stop_lies_inside_the_last_step() {
        // With the stop on the grid the durations would differ by up to a step.
        let (_, a, _) = fly(42.0, 4.0, &STOP);
        let (_, b, _) = fly(42.0, 3.7, &STOP);
        assert!((a.duration_s - b.duration_s).abs() < 5e-3);
        let floor = Stop { radius_m: 3_397_200.0 + 20e3, ..STOP };
        let (_, a, _) = fly(90.0, 4.0, &floor);
        let (_, b, _) = fly(90.0, 3.7, &floor);
        assert!((a.duration_s - b.duration_s).abs() < 5e-3);
    }

    #[test]
    fn more_lift_up_flies_further() {
        let ranges = [150.0, 110.0, 80.0, 50.0, 20.0, 0.0].map(|bank| range_m(&fly(bank, 4.0, &STOP).1.state));
        assert!(ranges.is_sorted(), "{ranges:?}");
    }

    #[test]
    fn the_horizon_ends_a_path_that_never_stops() {
        let (_, end, steps) = fly(0.0, 4.0, &Stop { speed_mps: 0.0, radius_m: 0.0, horizon_s: 100.0 });
        assert_eq!((end.duration_s, steps), (100.0, 25));
    }

    #[test]
    fn a_state_that_is_not_finite_ends_at_once() {
        let model = model();
        let flown = Flown { model: &model, air: &AirProfile::nominal(&model) };
        let mut state = entry();
        state[4] = f64::NAN;
        let mut prediction = Prediction::held(&flown, &state, 1.0, 0.0);
        assert!(prediction.step(&flown, 4.0, &STOP, None));
        let end = prediction.end();
        assert!(end.state.iter().any(|x| !x.is_finite()));
    }
}
