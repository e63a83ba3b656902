//! [`GuidanceContext`]: what guidance flies with, and what follows from it for steering and prediction.

use super::air::AirProfile;
use super::cycle::CycleContext;
use super::predictor::Stop;
use super::segments::Segments;
use super::steering::Steering;
use super::{tables, trigger};
use crate::frames::{PlanetFixed, Vec3, surface_point};
use crate::link::parameters::{
    ConstraintParameters, ControlParameters, DeployParameters, GuidanceMode, GuidanceParameters, Target, TriggerKind,
};
use crate::model::OnboardModel;

/// Mach number whose lift over drag stands for that of the flight, in the lateral logic.
pub(super) const HYPERSONIC_MACH: f64 = 10.0;

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
pub(super) struct Aim {
    /// Direction of the target, planet-fixed unit vector.
    pub(super) target_p: Vec3<PlanetFixed>,
    /// Planet-relative speed at which the speed trigger is to be expected, m/s; zero before anything has been found.
    pub(super) stop_speed_mps: f64,
    /// Lift over drag at high speed.
    lift_to_drag: f64,
}

impl Aim {
    pub(super) const NONE: Self = Self { target_p: Vec3::zero(), stop_speed_mps: 0.0, lift_to_drag: 0.0 };

    pub(super) fn of(context: &GuidanceContext<'_>) -> Self {
        let (drag, lift) = context.model.aero.coefficients(HYPERSONIC_MACH);
        Self {
            target_p: context.target_p(),
            stop_speed_mps: trigger::expected_speed_mps(context.deploy, context.model),
            lift_to_drag: lift / drag,
        }
    }

    pub(super) fn is_none(&self) -> bool {
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
    pub(super) fn learns(&self) -> bool {
        matches!(self.mode, GuidanceMode::Aeroshell | GuidanceMode::SegmentedTable)
    }

    /// Speed below which the heading is aligned, m/s.
    #[must_use]
    pub fn alignment_speed_mps(&self) -> f64 {
        alignment_speed_mps(self.guidance, self.mode, self.trigger)
    }

    pub(super) fn steering(&self, aim: &Aim) -> Option<Steering<'a>> {
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

    pub(super) fn cycle<'b>(&self, air: &'b AirProfile, segments: &Segments, aim: &Aim) -> CycleContext<'b>
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
