//! The predictor: flies the onboard model at a constant bank to the parachute trigger, a few steps at a time.
//!
//! Planet-fixed Cartesian equations with rotation and J2, classical Runge–Kutta steps of fixed length. The stop is found
//! inside the last step by cubic interpolation: stopping on the grid costs hundreds of metres even at 1 s.

use crate::frames::{PlanetFixed, Vec3, along_and_across_rad};
use crate::math::fun::sqrt;
use crate::math::num::{clamp, min};
use crate::math::rk4;
use crate::model::OnboardModel;
use crate::model::entry::cartesian_rates;

use super::constraints::{self, Peaks};

/// Evaluations of the equations of motion that one [`Prediction::step`] takes.
pub const EVALUATIONS_PER_STEP: u16 = 4;
/// Evaluations that starting a prediction takes.
pub const EVALUATIONS_TO_START: u16 = 1;
/// Newton steps to find the stop inside a step; the cubic is nearly straight, three are enough.
const STOP_ITERATIONS: u32 = 5;

/// Position (m) and planet-relative velocity (m/s), planet-fixed axes.
pub type State = [f64; 6];

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
    /// Position at the end, planet-fixed, m.
    pub r_p: Vec3<PlanetFixed>,
    /// Duration of the predicted flight, s.
    pub duration_s: f64,
    /// Peaks of the loads on the way.
    pub peaks: Peaks,
}

impl PathEnd {
    /// Downrange error at the reference radius, m, positive beyond the target: how far past the target (unit vector) the
    /// end lies along the great circle from `from_p` through it. `None` when no such arc exists.
    ///
    /// P4 compares the length of the path with the range to go; a path that curves sideways is longer than the
    /// distance it covers, by 1.5 to 5.5 km from entry, so the end point itself is compared instead.
    #[must_use]
    pub fn downrange_error_m(
        &self,
        from_p: &Vec3<PlanetFixed>,
        target_p: &Vec3<PlanetFixed>,
        reference_radius_m: f64,
    ) -> Option<f64> {
        let (along, _) = along_and_across_rad(&from_p.unit()?, target_p, &self.r_p)?;
        Some(along * reference_radius_m).filter(|error| error.is_finite())
    }
}

/// A prediction under way. Fixed size, resumed by [`Prediction::step`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    state: State,
    rates: State,
    cos_bank: f64,
    sin_bank: f64,
    elapsed_s: f64,
    peaks: Peaks,
}

impl Prediction {
    /// Starts at `state` with a constant bank. One evaluation.
    #[must_use]
    pub fn start(model: &OnboardModel, state: &State, cos_bank: f64, sin_bank: f64) -> Self {
        let rates = cartesian_rates(model, state, cos_bank, sin_bank);
        let peaks = Peaks::starting(loads_at(model, state));
        Self { state: *state, rates, cos_bank, sin_bank, elapsed_s: 0.0, peaks }
    }

    /// Flies one step of `step_s`, four evaluations; the end of the path once it has been reached.
    ///
    /// The path ends at the stop speed or the stop radius, whichever comes first, else at the horizon, or where the state
    /// ceases to be finite (its position then is not finite either, and no downrange error follows from it).
    #[must_use]
    pub fn step(&mut self, model: &OnboardModel, step_s: f64, stop: &Stop) -> Option<PathEnd> {
        let (cos_bank, sin_bank) = (self.cos_bank, self.sin_bank);
        let (before, rates_before) = (self.state, self.rates);
        if is_past(&before, stop) {
            return Some(self.end(&before, 0.0));
        }
        let after = rk4(&before, step_s, |offset_s, state| {
            if offset_s > 0.0 { cartesian_rates(model, state, cos_bank, sin_bank) } else { rates_before }
        });
        self.state = after;
        self.rates = cartesian_rates(model, &after, cos_bank, sin_bank);
        if is_past(&after, stop) {
            let fraction = min(
                crossing(
                    speed(&before),
                    speed_rate(&before, &rates_before),
                    speed(&after),
                    self.speed_rate(),
                    step_s,
                    stop.speed_mps,
                ),
                crossing(
                    radius(&before),
                    radius_rate(&before),
                    radius(&after),
                    radius_rate(&after),
                    step_s,
                    stop.radius_m,
                ),
            );
            let last = interpolated(&before, &after, step_s, fraction);
            return Some(self.end(&last, fraction * step_s));
        }
        self.elapsed_s += step_s;
        self.peaks.push(loads_at(model, &after));
        // Written so that a state that is not finite ends the path too.
        let goes_on = self.elapsed_s < stop.horizon_s && radius(&after).is_finite();
        if goes_on { None } else { Some(self.end(&after, 0.0)) }
    }

    fn end(&self, at: &State, since_s: f64) -> PathEnd {
        let [x, y, z, ..] = *at;
        PathEnd { r_p: Vec3::new(x, y, z), duration_s: self.elapsed_s + since_s, peaks: self.peaks }
    }

    fn speed_rate(&self) -> f64 {
        speed_rate(&self.state, &self.rates)
    }
}

/// Loads at a state.
fn loads_at(model: &OnboardModel, state: &State) -> [f64; constraints::CONSTRAINTS] {
    constraints::loads(model, radius(state) - model.planet.radius_m, speed(state))
}

fn is_past(state: &State, stop: &Stop) -> bool {
    speed(state) <= stop.speed_mps || radius(state) <= stop.radius_m
}

fn radius(&[x, y, z, ..]: &State) -> f64 {
    sqrt(x * x + y * y + z * z)
}

fn speed(&[_, _, _, vx, vy, vz]: &State) -> f64 {
    sqrt(vx * vx + vy * vy + vz * vz)
}

fn radius_rate(&[x, y, z, vx, vy, vz]: &State) -> f64 {
    (x * vx + y * vy + z * vz) / sqrt(x * x + y * y + z * z)
}

fn speed_rate(&[_, _, _, vx, vy, vz]: &State, &[_, _, _, ax, ay, az]: &State) -> f64 {
    (vx * ax + vy * ay + vz * az) / sqrt(vx * vx + vy * vy + vz * vz)
}

/// Cubic Hermite interpolation over a step: value and derivative with respect to the fraction of the step.
fn hermite(y0: f64, slope0: f64, y1: f64, slope1: f64, fraction: f64) -> (f64, f64) {
    let rise = y1 - y0;
    let (b, c) = (3.0 * rise - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * rise);
    let value = y0 + fraction * (slope0 + fraction * (b + fraction * c));
    (value, slope0 + fraction * (2.0 * b + 3.0 * fraction * c))
}

/// Fraction of a step at which a falling quantity passes `level`; 1 when it does not pass it within the step.
fn crossing(y0: f64, rate0: f64, y1: f64, rate1: f64, step_s: f64, level: f64) -> f64 {
    if y1 > level {
        return 1.0;
    }
    let mut fraction = clamp((y0 - level) / (y0 - y1), 0.0, 1.0);
    for _ in 0..STOP_ITERATIONS {
        let (value, slope) = hermite(y0, rate0 * step_s, y1, rate1 * step_s, fraction);
        if slope < 0.0 {
            fraction = clamp(fraction - (value - level) / slope, 0.0, 1.0);
        }
    }
    fraction
}

/// The position inside a step, by cubic interpolation from positions and velocities at its ends; the velocity is that at
/// the end of the step.
fn interpolated(before: &State, after: &State, step_s: f64, fraction: f64) -> State {
    let [x0, y0, z0, vx0, vy0, vz0] = *before;
    let [x1, y1, z1, vx1, vy1, vz1] = *after;
    let at = |r0: f64, v0: f64, r1: f64, v1: f64| hermite(r0, v0 * step_s, r1, v1 * step_s, fraction).0;
    [at(x0, vx0, x1, vx1), at(y0, vy0, y1, vy1), at(z0, vz0, z1, vz1), vx1, vy1, vz1]
}
