//! The figures of the report, one family per file. Each takes the [`Story`] and returns a description of a figure.

pub mod bank;
pub mod cost;
pub mod descent;
pub mod guidance;
pub mod innovations;
pub mod loads;
pub mod navigation;
pub mod timeline;
pub mod track;

use fsw_core::frames::{
    Inertial, PlanetFixed, Vec3, along_and_across_rad, planet_relative_from_inertial, surface_point,
};
use fsw_core::link::packet::{EventKind, Mode};
use fsw_core::time::MissionTime;

use super::plot::{Axis, Point};
use crate::record::{FlightRecord, TruthSample};

/// Metres to kilometres, pascals to kilopascals, W to kW.
const KILO: f64 = 1e-3;

/// A flight as the figures look at it.
#[derive(Clone, Copy, Debug)]
pub struct Story<'a> {
    /// The flight.
    pub record: &'a FlightRecord,
}

impl<'a> Story<'a> {
    /// A story of the flight.
    #[must_use]
    pub const fn new(record: &'a FlightRecord) -> Self {
        Self { record }
    }

    /// One quantity of the truth against time.
    #[must_use]
    pub fn truth(&self, quantity: impl Fn(&TruthSample) -> f64) -> Vec<Point> {
        self.record.truth.iter().map(|sample| (sample.time_s, quantity(sample))).collect()
    }

    /// Time of the last thing known, s.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        let truth = self.record.truth.last().map_or(0.0, |sample| sample.time_s);
        let nav = self.record.nav.last().map_or(0.0, |(time, _)| time.as_s());
        if truth.is_finite() { truth.max(nav) } else { nav }
    }

    /// The time axis that all figures share.
    #[must_use]
    pub fn time_axis(&self) -> Axis {
        Axis::fixed("time since entry, s", 0.0, self.end_s().max(1.0))
    }

    /// Times at which the mode changed, with the mode entered.
    #[must_use]
    pub fn modes(&self) -> Vec<(f64, Mode)> {
        let change = |kind: &EventKind| if let EventKind::ModeChanged { to, .. } = kind { Some(*to) } else { None };
        self.record.events.iter().filter_map(|event| Some((event.time.as_s(), change(&event.kind)?))).collect()
    }

    /// Times at which a bank reversal was commanded.
    #[must_use]
    pub fn reversals(&self) -> Vec<f64> {
        let is_reversal = |kind: &EventKind| matches!(kind, EventKind::Reversal { .. });
        self.record.events.iter().filter(|event| is_reversal(&event.kind)).map(|event| event.time.as_s()).collect()
    }

    /// The true state at a time, if it is known to within a frame.
    #[must_use]
    pub fn sample_at(&self, time_s: f64) -> Option<&'a TruthSample> {
        let after = self.record.truth.partition_point(|sample| sample.time_s < time_s - 0.011);
        self.record.truth.get(after).filter(|sample| (sample.time_s - time_s).abs() < 0.021)
    }

    /// Downrange beyond the target and crossrange right of the arc, km, of a direction in planet-fixed axes.
    #[must_use]
    pub fn local_km(&self, direction: &Vec3<PlanetFixed>) -> Option<Point> {
        let facts = &self.record.facts;
        let start = surface_point(facts.entry_longitude_rad, facts.entry_latitude_rad);
        let target = surface_point(facts.target.longitude_rad, facts.target.latitude_rad);
        let (along, across) = along_and_across_rad(&start, &target, direction)?;
        let scale = facts.planet.radius_m * KILO;
        Some((along * scale, across * scale))
    }

    /// The true ground track in local coordinates, km.
    #[must_use]
    pub fn track_km(&self) -> Vec<Point> {
        let lost = (f64::NAN, f64::NAN);
        let local = |s: &TruthSample| self.local_km(&surface_point(s.longitude_rad, s.latitude_rad)).unwrap_or(lost);
        self.record.truth.iter().map(local).collect()
    }

    /// The ground track as navigation believed it, km.
    #[must_use]
    pub fn believed_track_km(&self) -> Vec<Point> {
        let rotation = self.record.facts.planet.rotation_radps;
        let local = |time: MissionTime, position: [f64; 3]| {
            let (r, v) = (Vec3::<Inertial>::from_array(position), Vec3::zero());
            self.local_km(&planet_relative_from_inertial(&r, &v, time, rotation).0)
        };
        let lost = (f64::NAN, f64::NAN);
        self.record.nav.iter().map(|(time, nav)| local(*time, nav.position_m).unwrap_or(lost)).collect()
    }

    /// The deploy point in local coordinates, km.
    #[must_use]
    pub fn deploy_km(&self) -> Option<Point> {
        let deploy = self.record.summary.deploy?;
        self.local_km(&surface_point(deploy.longitude_deg.to_radians(), deploy.latitude_deg.to_radians()))
    }
}

/// Short name of a mode.
#[must_use]
pub const fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Standby => "standby",
        Mode::Coast => "coast",
        Mode::RangeControl => "range control",
        Mode::HeadingAlignment => "heading alignment",
        Mode::Deployed => "parachute",
        Mode::DegradedRangeControl => "range control (degraded)",
        Mode::DegradedHeadingAlignment => "alignment (degraded)",
    }
}
