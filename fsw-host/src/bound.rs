//! The physical limit of a flight's navigation: the posterior Cramér–Rao bound on what the flight software was sent, for who
//! knows the statistics of the sensors that flew, whatever the flight software was told of them.
//!
//! `rank` sets it beside every filter, `fly` beside the one that flew.

use fsw_core::link::packet::{MAX_SOURCES, Truth};
use fsw_core::link::parameters::NavigationMode;
use fsw_core::model::orbiter::SourceState;
use fsw_core::sensors::Batch;
use fsw_core::time::MissionTime;
use fsw_study::inertial::{InertialBound, Instant, Row};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::error::HostError;
use crate::linklog::LinkLog;
use crate::record::FlightRecord;
use crate::recorded::Recorded;

/// Minor frames in a tenth of a second.
pub const STRIDE: usize = 5;

/// Least covariances at an instant, inertial axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Least {
    /// Time, s.
    pub time_s: f64,
    /// Of the position, m².
    pub position: Matrix3<f64>,
    /// Of the velocity, (m/s)².
    pub velocity: Matrix3<f64>,
}

impl Least {
    /// Variances of position, m², and velocity, (m/s)², summed over the axes.
    #[must_use]
    pub fn variances(&self) -> [f64; 2] {
        [self.position.trace(), self.velocity.trace()]
    }

    /// Least root mean square errors of position, m, and velocity, m/s.
    #[must_use]
    pub fn rms(&self) -> [f64; 2] {
        self.variances().map(f64::sqrt)
    }
}

/// The bound of a flight that is over at the epochs of its navigation; empty for ideal navigation, which measures nothing.
///
/// # Errors
/// The log brings no parameters that the flight software takes.
pub fn of(log: &LinkLog, record: &FlightRecord) -> Result<Vec<Least>, HostError> {
    if record.facts.navigation == NavigationMode::Ideal {
        return Ok(Vec::new());
    }
    let flight = Recorded::of(log, record)?;
    let mut is_epoch = vec![false; flight.truth.len()];
    for (time, _) in &record.nav {
        is_epoch.iter_mut().skip(time.frame_index() as usize).take(1).for_each(|epoch| *epoch = true);
    }
    // Where telemetry is missing the bound goes on in steps of its own.
    let mut least = along(&flight, |k| is_epoch.get(k).is_some_and(|epoch| *epoch) || k.is_multiple_of(STRIDE));
    least.retain(|at| at.variances().iter().all(|variance| variance.is_finite() && *variance >= 0.0));
    Ok(least)
}

/// The least covariances on a recorded flight after the frames that are asked for, a tenth of a second apart at most: see
/// [`InertialBound`].
#[must_use]
pub fn along(flight: &Recorded, is_asked: impl Fn(usize) -> bool) -> Vec<Least> {
    let config = &flight.config;
    let planet = &config.planet;
    let mut bound = InertialBound::new(&config.initial_knowledge, &flight.sensors, planet);
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
    for (k, now, batch, truth) in flight.accepted() {
        let reads = batch.pressure.is_some() || batch.radio.iter().any(Option::is_some);
        if reads || is_asked(k) {
            let after = instant(k, truth);
            bound.advance(&before, &after);
            before = after;
            pressure(&mut bound, flight, &batch, truth);
            radio(&mut bound, flight, &batch, &before, &mut sources, now);
        }
        if is_asked(k) {
            let [position, velocity] = bound.covariances();
            least.push(Least { time_s: now.as_s(), position, velocity });
        }
    }
    least
}

/// A stagnation pressure at the true state; hypersonic coefficient of the flow in its derivatives.
fn pressure(bound: &mut InertialBound, flight: &Recorded, batch: &Batch, truth: &Truth) {
    let p = &flight.sensors;
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
    let p = &flight.sensors;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recorded::fly_kept;
    use hil_sim::scenario::Scenario;

    fn flown(sets: &[&str]) -> (LinkLog, FlightRecord) {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let scenario = Scenario::resolve("msl", &sets).unwrap();
        fly_kept(&scenario, 1, 0).unwrap()
    }

    #[test]
    fn a_sensor_that_is_worse_than_the_flight_software_was_told_has_the_bound_of_what_it_is() {
        let at_the_end = |sets: &[&str]| {
            let (log, record) = flown(sets);
            of(&log, &record).unwrap().last().unwrap().rms()[0]
        };
        let belief = "onboard.sensors.imu.accelerometer_bias_ug=100.0";
        let (worse, told) = ("sensors.imu.accelerometer_bias_ug=3000.0", "sensors.imu.accelerometer_bias_ug=100.0");
        let (secret, known) = (at_the_end(&[worse, belief]), at_the_end(&[worse]));
        assert!(at_the_end(&[told, belief]) < 0.9 * secret, "{secret}");
        // The path differs with what the flight software knew; the limit hardly.
        assert!((secret / known - 1.0).abs() < 0.05, "{secret} {known}");
    }

    #[test]
    fn a_flight_has_its_bound_at_every_epoch_and_aborted_as_far_as_its_path_is_known() {
        let (log, mut record) = flown(&[]);
        let whole = of(&log, &record).unwrap();
        record.set_bound(whole.clone());
        assert!(record.nees.iter().all(|epoch| record.least_at(epoch.time_s).is_some()));
        let navigation = &record.summary.navigation;
        let [least_m, least_mps] = record.least_at(record.nees.last().unwrap().time_s).unwrap().rms();
        assert_eq!((navigation.position_bound_m, navigation.velocity_bound_mps), (Some(least_m), Some(least_mps)));
        // The filter that flew carries no more than the bound knows.
        assert!(least_m < navigation.position_sigma_m.unwrap() && least_mps < navigation.velocity_sigma_mps.unwrap());
        record.truth.truncate(5_000);
        let cut = of(&log, &record).unwrap();
        assert!(cut.len() < whole.len() && cut.last().unwrap().time_s < 100.0);
        assert_eq!(cut, whole[..cut.len()]);
    }

    #[test]
    fn true_states_that_are_lost_hardly_change_the_bound() {
        let (log, mut record) = flown(&[]);
        let whole = of(&log, &record).unwrap();
        // All but the last: the bound goes as far as the path is known.
        let end_s = record.truth.last().unwrap().time_s;
        record.truth.retain(|sample| (sample.time_s * 7.3).fract() < 0.7 || sample.time_s >= end_s);
        let patched = of(&log, &record).unwrap();
        assert_eq!(patched.len(), whole.len());
        for (patched, whole) in patched.iter().zip(&whole) {
            // Between states 0.04 s apart the path is within 0.02 m of a straight line, the velocity within 2 cm/s.
            assert!(patched.rms().iter().zip(whole.rms()).all(|(a, b)| (a / b - 1.0).abs() < 1e-3));
        }
    }

    #[test]
    fn ideal_navigation_has_none() {
        let (log, record) = flown(&["navigation.filter=ideal"]);
        assert_eq!(of(&log, &record).unwrap(), []);
    }

    #[test]
    fn it_does_not_depend_on_where_it_is_asked_for() {
        let (log, record) = flown(&[]);
        let flight = Recorded::of(&log, &record).unwrap();
        let (seldom, often) = (along(&flight, |k| k % 5 == 0), along(&flight, |k| k % 2 == 0 || k % 5 == 0));
        for seldom in &seldom {
            let often = often.iter().find(|often| often.time_s == seldom.time_s).unwrap();
            // Steps of 0.1 s and of 0.02 s: attitude and force turn by a thousandth between them.
            assert!(often.rms().iter().zip(seldom.rms()).all(|(a, b)| (a / b - 1.0).abs() < 2e-3));
        }
    }
}
