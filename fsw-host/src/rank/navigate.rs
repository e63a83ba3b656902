//! A filter over a recorded flight, open loop: the same bytes for all; and the physical limit on them.

use fsw_core::link::packet::{GivenUpCause, MAX_SOURCES, RejectCounters, Truth};
use fsw_core::link::parameters::NavigationMode;
use fsw_core::model::orbiter::SourceState;
use fsw_core::nav::{NavContext, Navigator};
use fsw_core::sensors::{self, Batch, FrameInputs, StuckMonitor};
use fsw_core::time::MissionTime;
use fsw_study::inertial::{InertialBound, Instant, Row};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::log::Recorded;
use crate::measure::{NEES_BAND_95, consistency};

/// Minor frames from one comparison with the truth to the next: ten a second.
const STRIDE: usize = 5;

/// What a filter did on a recorded flight.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Squared error of position (m²) and velocity ((m/s)²), ten a second.
    pub errors: Vec<[f64; 2]>,
    /// Normalised error squared where there is a covariance.
    pub nees: Vec<f64>,
    /// Shares of those within the central 95 %.
    pub inside: usize,
    /// Epochs whose covariance was not positive definite.
    pub indefinite: usize,
    /// Estimates with a number that is not finite.
    pub not_finite: usize,
    /// When the filter was given up, s, and why.
    pub given_up: Option<(f64, GivenUpCause)>,
}

/// Measurements of a frame as the flight software accepts them, in the order of the recorded flight.
fn batches(flight: &Recorded) -> impl Iterator<Item = (MissionTime, Batch)> + '_ {
    let (mut rejects, mut stuck) = (RejectCounters::NONE, StuckMonitor::default());
    flight.frames.iter().enumerate().map(move |(k, inputs): (usize, &FrameInputs)| {
        let now = MissionTime::of_frame(u32::try_from(k + 1).unwrap_or(u32::MAX));
        let mut batch = sensors::accept(now, inputs, &mut rejects);
        stuck.step(&mut batch, &flight.config.navigation, &mut rejects);
        (now, batch)
    })
}

/// Flies a filter over a recorded flight, up to the opening of the parachute.
#[must_use]
pub fn navigate(flight: &Recorded, mode: NavigationMode) -> Track {
    let config = &flight.config;
    let context = |bank_accel_radps2| NavContext {
        model: &flight.model,
        parameters: &config.navigation,
        sources: &config.sources,
        mode,
        bank_accel_radps2,
    };
    let mut navigator = Box::new(Navigator::new());
    navigator.start(&config.initial_knowledge, &context(0.0));
    let mut track = Track::default();
    let mut bank_accel = 0.0;
    for ((now, batch), (k, truth)) in batches(flight).zip(flight.truth.iter().enumerate().skip(1)) {
        let estimate = navigator.step(now, &batch, &context(bank_accel));
        bank_accel = flight.bank_accel_radps2.get(k - 1).copied().unwrap_or(0.0);
        track.not_finite += usize::from(!(estimate.r_i.is_finite() && estimate.v_i.is_finite()));
        if track.given_up.is_none() {
            track.given_up = navigator.counters().given_up.map(|cause| (now.as_s(), cause));
        }
        if k % STRIDE == 0 {
            let told = consistency(now.as_s(), &navigator.telemetry(), truth);
            let square = |error: [f64; 3]| error.iter().map(|e| e * e).sum::<f64>();
            track.errors.push([square(told.position_error_m), square(told.velocity_error_mps)]);
            match told.nees {
                Some(nees) => {
                    track.inside += usize::from((NEES_BAND_95[0]..=NEES_BAND_95[1]).contains(&nees));
                    track.nees.push(nees);
                }
                None => track.indefinite += 1,
            }
        }
    }
    track
}

/// Least variances of position and velocity, ten a second: see [`InertialBound`].
#[must_use]
pub fn bound(flight: &Recorded) -> Vec<[f64; 2]> {
    let config = &flight.config;
    let (planet, parameters) = (&config.planet, &config.navigation);
    let mut bound = InertialBound::new(&config.initial_knowledge, parameters, planet);
    let mut sources = config.sources.map(|source| SourceState::new(&source, planet));
    let instant = |k: usize, truth: &Truth| {
        let [w, x, y, z] = truth.attitude;
        Instant {
            time_s: MissionTime::of_frame(u32::try_from(k).unwrap_or(u32::MAX)).as_s(),
            position_m: Vector3::from(truth.position_m),
            velocity_mps: Vector3::from(truth.velocity_mps),
            attitude: UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
        }
    };
    let mut least = Vec::new();
    let Some(first) = flight.truth.first() else { return least };
    let mut before = instant(0, first);
    for ((now, batch), (k, truth)) in batches(flight).zip(flight.truth.iter().enumerate().skip(1)) {
        let reads = batch.pressure.is_some() || batch.radio.iter().any(Option::is_some);
        if reads || k % STRIDE == 0 {
            let after = instant(k, truth);
            bound.advance(&before, &after);
            before = after;
            pressure(&mut bound, flight, &batch, truth);
            radio(&mut bound, flight, &batch, &before, &mut sources, now);
        }
        if k % STRIDE == 0 {
            least.push(bound.variances());
        }
    }
    least
}

/// A stagnation pressure at the true state; hypersonic coefficient of the flow in its derivatives.
fn pressure(bound: &mut InertialBound, flight: &Recorded, batch: &Batch, truth: &Truth) {
    let p = &flight.config.navigation;
    let Some(read) = &batch.pressure else { return };
    if truth.dynamic_pressure_pa < p.pressure_min_dynamic_pa {
        return;
    }
    let (r, v) = (Vector3::from(truth.position_m), Vector3::from(truth.velocity_mps));
    let relative = v - Vector3::new(0.0, 0.0, flight.config.planet.rotation_radps).cross(&r);
    let slope = flight.model.atmosphere.log_density_slope_pm(r.norm() - flight.config.planet.radius_m);
    let position = r.normalize() * (read.stagnation_pa * slope);
    let velocity = relative * (2.0 * read.stagnation_pa / relative.norm_squared());
    let row = Row { position: position.into(), velocity: velocity.into(), pressure: read.stagnation_pa };
    bound.inform(&row, (p.pressure_noise * read.stagnation_pa).powi(2));
}

/// Range and range-rate to the sources that were heard above the smallest elevation.
fn radio(
    bound: &mut InertialBound,
    flight: &Recorded,
    batch: &Batch,
    now: &Instant,
    sources: &mut [SourceState; MAX_SOURCES],
    time: MissionTime,
) {
    let p = &flight.config.navigation;
    for (_, source) in batch.radio.iter().zip(sources).filter(|(read, _)| read.is_some()) {
        let Ok((r_s, v_s)) = source.at(&flight.config.planet, time) else { continue };
        let (r_s, v_s) = (Vector3::from(r_s.to_array()), Vector3::from(v_s.to_array()));
        let (d, w) = (now.position_m - r_s, now.velocity_mps - v_s);
        let u = d.normalize();
        let elevation = match source {
            SourceState::Beacon(_) => r_s.normalize().dot(&u),
            _ => -now.position_m.normalize().dot(&u),
        };
        if elevation < p.min_elevation_rad.sin() {
            continue;
        }
        bound.inform(&Row { position: u.into(), ..Row::default() }, p.range_noise_m.powi(2));
        let turning = (w - u * u.dot(&w)) / d.norm();
        bound.inform(
            &Row { position: turning.into(), velocity: u.into(), ..Row::default() },
            p.range_rate_noise_mps.powi(2),
        );
    }
}
