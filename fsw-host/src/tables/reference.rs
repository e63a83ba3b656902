//! The nominal flight of the onboard model at the one constant bank that reaches the target, and how its range depends on where it is.

use fsw_core::config::Config;
use fsw_core::frames::{PlanetFixed, PlanetRelative, Vec3, great_circle_rad, surface_point};
use fsw_core::guidance::air::{Adapted, AirProfile};
use fsw_core::guidance::predictor::{Prediction, State, Stop};
use fsw_core::math::rk4;
use fsw_core::model::OnboardModel;
use fsw_core::model::entry::{Environment, cartesian_rates};
use hil_sim::case::Case;
use hil_sim::scenario::{Scenario, ScenarioError};

use crate::error::HostError;

/// Step of the flights, s, and their longest duration.
const STEP_S: f64 = 0.5;
const HORIZON_S: f64 = 900.0;
/// Step of the nominal flight that is kept, s.
const KEPT_S: f64 = 0.1;
/// Rows of the reference, from the lowest speed to that at which range control begins.
const ROWS: usize = 24;
/// Lowest row, above the speed of the trigger, m/s: there bank no longer changes the range, and heading is aligned.
const LOWEST_ABOVE_TRIGGER_MPS: f64 = 50.0;
/// Points of the flight that are kept, per point that may become a row.
const KEPT_PER_CANDIDATE: usize = 10;
/// Altitudes at which the drag of the model is told, m: those between which the speed is lost.
const DRAG_ALTITUDES_M: [f64; 3] = [10e3, 15e3, 30e3];
/// Mach number whose coefficients stand for those of the flight.
const HYPERSONIC_MACH: f64 = 10.0;
/// Half-widths of the central differences: altitude, m; flight-path angle, rad; cosine of the bank.
const ALTITUDE_STEP_M: f64 = 500.0;
const PATH_ANGLE_STEP_RAD: f64 = 0.003;
const COS_BANK_STEP: f64 = 0.03;

/// The reference flight.
pub struct Reference {
    model: OnboardModel,
    stop_speed_mps: f64,
    range_control_load_mps2: f64,
    /// Cosine of its bank.
    pub cos_bank: f64,
    sine_sign: f64,
    path: Vec<State>,
}

impl Reference {
    /// Of the onboard model of a scenario.
    pub fn new(scenario: &Scenario) -> Result<Self, HostError> {
        let mut config = Config::DEFAULT;
        for block in scenario.parameter_blocks() {
            config.apply(&block).map_err(|_| refused("its parameters are refused by the flight software"))?;
        }
        let c = &config;
        let model = OnboardModel::new(c.planet, &c.vehicle, &c.aero_rows, &c.atmosphere, &c.atmosphere_rows)
            .map_err(|e| refused(&e.to_string()))?;
        let entry = Case::draw(scenario, 1, 0, true).entry.planet_relative(0.0, &c.planet);
        let (r, v) = entry.to_cartesian();
        let start = state(&r, &v);
        let target = surface_point(c.target.longitude_rad, c.target.latitude_rad);
        let mut reference = Self {
            model,
            stop_speed_mps: c.deploy.speed_mps,
            range_control_load_mps2: c.guidance.range_control_load_mps2,
            cos_bank: 0.0,
            sine_sign: if c.control.initial_bank_rad < 0.0 { -1.0 } else { 1.0 },
            path: Vec::new(),
        };
        let wanted_m = great_circle_rad(&r, &target) * c.planet.radius_m;
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..40 {
            reference.cos_bank = 0.5 * (low + high);
            let end = reference.end(&start, reference.cos_bank, 1.0);
            let flown_m = great_circle_rad(&r, &position(&end)) * c.planet.radius_m;
            if flown_m < wanted_m { low = reference.cos_bank } else { high = reference.cos_bank }
        }
        if high > 0.999 || low < -0.999 {
            return Err(refused("no constant bank reaches its target"));
        }
        reference.path = reference.fly(start);
        Ok(reference)
    }

    /// Radius of the reference sphere, m.
    pub fn radius_m(&self) -> f64 {
        self.model.planet.radius_m
    }

    fn fly(&self, start: State) -> Vec<State> {
        let (u, sine) = (self.cos_bank, self.sine());
        let mut path = vec![start];
        let mut now = start;
        while speed(&now) > self.stop_speed_mps && path.len() < 20_000 {
            now = rk4(&now, KEPT_S, |_, s| cartesian_rates(&self.model, s, u, sine));
            path.push(now);
        }
        path
    }

    fn sine(&self) -> f64 {
        self.sine_sign * (1.0 - self.cos_bank * self.cos_bank).sqrt()
    }

    /// End of a flight at constant bank in air of a density ratio.
    fn end(&self, start: &State, cos_bank: f64, density_ratio: f64) -> State {
        let mut air = AirProfile::NONE;
        air.set_constant(&self.model, density_ratio);
        let flown = Adapted { model: &self.model, air: &air };
        let stop = Stop { speed_mps: self.stop_speed_mps, radius_m: self.model.planet.radius_m, horizon_s: HORIZON_S };
        let sine = self.sine_sign * (1.0 - cos_bank * cos_bank).max(0.0).sqrt();
        let mut prediction = Prediction::held(&flown, start, cos_bank, sine);
        while !prediction.step(&flown, STEP_S, &stop, None) {}
        prediction.end().state
    }

    /// Downrange along the initial course, m, of a flight at constant bank.
    pub fn range_m(&self, start: &State, cos_bank: f64, density_ratio: f64) -> f64 {
        let end = position(&self.end(start, cos_bank, density_ratio));
        let (r, v) = (position(start), velocity(start));
        let up = r.unit().unwrap_or(r);
        let level = v - up * up.dot(&v);
        let ahead = level.unit().unwrap_or(level);
        end.dot(&ahead).atan2(end.dot(&up)) * self.model.planet.radius_m
    }

    /// The reference when it is abeam of a point: as far from entry as the point.
    pub fn abeam(&self, longitude_rad: f64, latitude_rad: f64) -> State {
        let from = position(&self.path[0]);
        let wanted = great_circle_rad(&from, &surface_point(longitude_rad, latitude_rad));
        let reached = self.path.iter().find(|s| great_circle_rad(&from, &position(s)) >= wanted);
        *reached.unwrap_or(&self.path[self.path.len() - 1])
    }

    /// What tells this model from another, in source form.
    pub fn made_with(&self) -> String {
        let (drag, lift) = self.model.aero.coefficients(HYPERSONIC_MACH);
        let per_density = self.model.constants().half_area_per_mass_m2pkg * drag;
        let drag =
            DRAG_ALTITUDES_M.map(|h| format!("[{h:.1}, {:.4e}]", per_density * self.model.atmosphere.density(h)));
        format!(
            "/// What the onboard model was that these tables were made with.\n\
             #[derive(Clone, Copy, Debug, PartialEq)]\npub struct MadeWith {{\n    \
             /// Speed at which the parachute fires, m/s.\n    pub trigger_speed_mps: f32,\n    \
             /// Lift over drag.\n    pub lift_to_drag: f32,\n    \
             /// Altitude (m) and drag over the square of the speed (1/m).\n    pub drag: [[f32; 2]; 3],\n}}\n\n\
             /// The onboard model of these tables.\npub const MADE_WITH: MadeWith = MadeWith {{\n    \
             trigger_speed_mps: {:.1},\n    lift_to_drag: {:.4},\n    drag: [{}],\n}};\n\n",
            self.stop_speed_mps,
            lift / per_density * self.model.constants().half_area_per_mass_m2pkg,
            drag.join(", ")
        )
    }

    /// The rows of the table, by increasing speed: its two ends, then again and again the point of the flight where the law
    /// errs most, for its range to go, on the flight itself.
    pub fn rows(&self) -> Vec<[f64; 7]> {
        let lowest_mps = self.stop_speed_mps + LOWEST_ABOVE_TRIGGER_MPS;
        let controlled = |s: &&State| self.drag_mps2(s) >= self.range_control_load_mps2;
        let flight = self.path.iter().skip_while(|s| !controlled(s)).take_while(|s| speed(s) >= lowest_mps);
        let mut candidates: Vec<_> = flight.step_by(KEPT_PER_CANDIDATE).map(|s| self.row(s)).collect();
        candidates.reverse();
        let mut chosen = vec![0, candidates.len() - 1];
        while chosen.len() < ROWS.min(candidates.len()) {
            let error = |at: usize| {
                let above = chosen.partition_point(|row| *row <= at).min(chosen.len() - 1);
                relative_error(&candidates[at], &candidates[chosen[above - 1]], &candidates[chosen[above]])
            };
            let worst = (0..candidates.len()).max_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap_or(0);
            chosen.insert(chosen.partition_point(|row| *row < worst), worst);
        }
        chosen.into_iter().map(|row| candidates[row]).collect()
    }

    fn row(&self, at: &State) -> [f64; 7] {
        let u = self.cos_bank;
        let moved = |altitude_m: f64, path_angle_rad: f64| {
            let s = relative(at);
            let (r, v) = PlanetRelative {
                radius_m: s.radius_m + altitude_m,
                flight_path_angle_rad: s.flight_path_angle_rad + path_angle_rad,
                ..s
            }
            .to_cartesian();
            state(&r, &v)
        };
        let slope = |a: &State, b: &State, measure: &dyn Fn(&State) -> f64| {
            (self.range_m(b, u, 1.0) - self.range_m(a, u, 1.0)) / (measure(b) - measure(a))
        };
        let by_drag = slope(&moved(-ALTITUDE_STEP_M, 0.0), &moved(ALTITUDE_STEP_M, 0.0), &|s| self.drag_mps2(s));
        let by_climb = slope(&moved(0.0, -PATH_ANGLE_STEP_RAD), &moved(0.0, PATH_ANGLE_STEP_RAD), &climb);
        let by_cos_bank = (self.range_m(at, u + COS_BANK_STEP, 1.0) - self.range_m(at, u - COS_BANK_STEP, 1.0))
            / (2.0 * COS_BANK_STEP);
        [speed(at), self.range_m(at, u, 1.0), self.drag_mps2(at), climb(at), by_drag, by_climb, by_cos_bank]
    }

    fn drag_mps2(&self, s: &State) -> f64 {
        let (h, v) = (position(s).norm() - self.model.planet.radius_m, speed(s));
        let (drag, _) = self.model.drag_and_lift_coefficients(h, v);
        let half_area_per_mass = self.model.constants().half_area_per_mass_m2pkg;
        self.model.atmosphere.density(h) * v * v * half_area_per_mass * drag
    }
}

/// What the law makes of the range to go at a point of the reference, from the rows below and above it: error over range.
fn relative_error(at: &[f64; 7], low: &[f64; 7], high: &[f64; 7]) -> f64 {
    let share = (at[0] - low[0]) / (high[0] - low[0]);
    let between: [f64; 7] = std::array::from_fn(|k| low[k] + (high[k] - low[k]) * share);
    let [_, range, drag, climb, by_drag, by_climb, _] = between;
    ((range + by_drag * (at[2] - drag) + by_climb * (at[3] - climb) - at[1]) / at[1]).abs()
}

/// Planet-relative spherical state.
pub fn relative(s: &State) -> PlanetRelative {
    PlanetRelative::from_cartesian(&position(s), &velocity(s))
}

pub fn state(r: &Vec3<PlanetFixed>, v: &Vec3<PlanetFixed>) -> State {
    let ([x, y, z], [vx, vy, vz]) = (r.to_array(), v.to_array());
    [x, y, z, vx, vy, vz]
}

fn position(&[x, y, z, ..]: &State) -> Vec3<PlanetFixed> {
    Vec3::new(x, y, z)
}

fn velocity(&[_, _, _, vx, vy, vz]: &State) -> Vec3<PlanetFixed> {
    Vec3::new(vx, vy, vz)
}

pub fn speed(s: &State) -> f64 {
    velocity(s).norm()
}

fn climb(s: &State) -> f64 {
    position(s).dot(&velocity(s)) / position(s).norm()
}

fn refused(why: &str) -> HostError {
    ScenarioError { message: format!("no guidance tables for this scenario: {why}") }.into()
}
