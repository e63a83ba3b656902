//! What goes into a guidance cycle and what comes out of it.

use crate::frames::{PlanetFixed, Vec3};
use crate::guidance::air::AirProfile;
use crate::guidance::constraints::Peaks;
use crate::guidance::predictor::{State, Stop};
use crate::guidance::steering::Steering;
use crate::guidance::tables::Segment;
use crate::link::packet::CycleOutcome;
use crate::link::parameters::{ConstraintParameters, ControlParameters, GuidanceParameters};
use crate::model::OnboardModel;

/// What a cycle needs besides its own state; the same in every frame of a flight.
#[derive(Clone, Copy, Debug)]
pub struct CycleContext<'a> {
    /// The model that predictions fly.
    pub model: &'a OnboardModel,
    /// Guidance settings.
    pub guidance: &'a GuidanceParameters,
    /// Limits along the path.
    pub constraints: &'a ConstraintParameters,
    /// Bank control, flown ahead to the instant of effect.
    pub control: &'a ControlParameters,
    /// Where predictions end.
    pub stop: Stop,
    /// Direction of the target, planet-fixed unit vector.
    pub target_p: Vec3<PlanetFixed>,
    /// The air that predictions fly.
    pub air: &'a AirProfile,
    /// What predictions rehearse; without it they hold their bank.
    pub steering: Option<Steering<'a>>,
    /// The table that stands for the flight beyond the stop, where predictions are cut short.
    pub remainder: Option<&'static Segment>,
}

/// Where a cycle starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleStart {
    /// Position and planet-relative velocity now, planet-fixed axes.
    pub state: State,
    /// Bank now, rad.
    pub bank_rad: f64,
    /// Bank rate now, rad/s.
    pub bank_rate_radps: f64,
    /// Commanded bank in force until the instant of effect, rad.
    pub command_rad: f64,
    /// Side to predict on, +1 right or −1 left.
    pub side: f64,
    /// Slope of the downrange error with the cosine of the bank, m, where an earlier cycle found one.
    pub slope_m: Option<f64>,
    /// Minor frames until the result takes effect.
    pub frames_to_effect: u32,
}

/// What a cycle found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleResult {
    /// Bank magnitude, rad.
    pub bank_rad: f64,
    /// Downrange error predicted for it, m, positive beyond the target.
    pub error_m: f64,
    /// How far beyond the end of the path the target lies to the side that the path began on, m.
    pub aside_m: f64,
    /// Peaks of the loads on the predicted path nearest to it.
    pub peaks: Peaks,
    /// How the search ended.
    pub outcome: CycleOutcome,
}
