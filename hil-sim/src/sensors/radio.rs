//! Radio ranging to orbiters and beacons.

use fsw_core::link::packet::Radio;
use fsw_core::planet::Planet;

use crate::noise::Stream;
use crate::orbiter::{Source, State, elevation_rad, range_and_rate};

/// Where plasma cuts the radio off: while the vehicle is both faster and lower than this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blackout {
    /// Planet-relative speed, m/s.
    pub above_speed_mps: f64,
    /// Altitude, m.
    pub below_altitude_m: f64,
}

/// Errors and rules of the radio in one flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadioErrors {
    /// White noise of a range, 1σ, m.
    pub range_noise_m: f64,
    /// White noise of a range-rate, 1σ, m/s.
    pub range_rate_noise_mps: f64,
    /// Nothing is received below this elevation, rad.
    pub min_elevation_rad: f64,
    /// Plasma blackout.
    pub blackout: Option<Blackout>,
}

/// The receiver and the sources it hears, in the slots of the link.
#[derive(Clone, Debug)]
pub struct RadioSensor {
    errors: RadioErrors,
    noise: Vec<Stream>,
    sources: Vec<Source>,
    known: Vec<Option<(f64, State)>>,
}

impl RadioSensor {
    /// A receiver with one noise stream per source.
    #[must_use]
    pub fn new(errors: RadioErrors, sources: &[Source], noise: impl Fn(usize) -> Stream) -> Self {
        Self {
            errors,
            noise: (0..sources.len()).map(noise).collect(),
            sources: sources.to_vec(),
            known: vec![None; sources.len()],
        }
    }

    /// Measurements at a time after the epoch, from every source that is heard. Noise is drawn for every source at every
    /// call, heard or not, so that an outage does not change what comes after it.
    pub fn measure(
        &mut self,
        t_s: f64,
        vehicle: &State,
        speed_mps: f64,
        altitude_m: f64,
        planet: &Planet,
    ) -> Vec<Radio> {
        let e = self.errors;
        let cut = e.blackout.is_some_and(|b| speed_mps > b.above_speed_mps && altitude_m < b.below_altitude_m);
        let mut heard = Vec::new();
        for (slot, source) in self.sources.iter().enumerate() {
            let state = source.state_at(t_s, self.known[slot], planet);
            self.known[slot] = Some((t_s, state));
            let (range_noise, rate_noise) = (self.noise[slot].normal(), self.noise[slot].normal());
            if cut || elevation_rad(&vehicle.r_i, &state.r_i) < e.min_elevation_rad {
                continue;
            }
            let (range, rate) = range_and_rate(vehicle, &state);
            heard.push(Radio {
                source: slot as u8,
                range_m: range + e.range_noise_m * range_noise,
                range_rate_mps: rate + e.range_rate_noise_mps * rate_noise,
                quality: u8::MAX,
            });
        }
        heard
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::frames::Vec3;
    use fsw_core::planet::MARS;
    use fsw_core::units::rad;

    const QUIET: RadioErrors =
        RadioErrors { range_noise_m: 0.0, range_rate_noise_mps: 0.0, min_elevation_rad: 0.087, blackout: None };

    fn sensor(errors: RadioErrors) -> RadioSensor {
        let beacon =
            |longitude: f64| Source::Beacon { longitude_rad: rad(longitude), latitude_rad: 0.0, altitude_m: 0.0 };
        RadioSensor::new(errors, &[beacon(0.0), beacon(40.0)], |k| Stream::new(1, 1, ["a", "b"][k]))
    }

    fn vehicle() -> State {
        State { r_i: Vec3::new(MARS.radius_m + 50e3, 0.0, 0.0), v_i: Vec3::new(-100.0, 0.0, 0.0) }
    }

    #[test]
    fn a_source_below_the_mask_is_not_heard() {
        let heard = sensor(QUIET).measure(0.0, &vehicle(), 1000.0, 50e3, &MARS);
        assert_eq!(heard.len(), 1);
        assert_eq!((heard[0].source, heard[0].range_m), (0, 50e3));
        assert!((heard[0].range_rate_mps - -100.0).abs() < 1e-9);
    }

    #[test]
    fn plasma_cuts_off_only_fast_and_low() {
        let blackout = Some(Blackout { above_speed_mps: 4200.0, below_altitude_m: 70e3 });
        let count = |speed, altitude| {
            sensor(RadioErrors { blackout, ..QUIET }).measure(0.0, &vehicle(), speed, altitude, &MARS).len()
        };
        assert_eq!((count(4300.0, 60e3), count(4100.0, 60e3), count(4300.0, 80e3)), (0, 1, 1));
    }

    #[test]
    fn an_outage_does_not_change_the_noise_after_it() {
        let noisy = RadioErrors { range_noise_m: 100.0, ..QUIET };
        let blackout = Some(Blackout { above_speed_mps: 4200.0, below_altitude_m: 70e3 });
        let (mut a, mut b) = (sensor(noisy), sensor(RadioErrors { blackout, ..noisy }));
        for speed in [5000.0, 5000.0, 4000.0] {
            let (x, y) =
                (a.measure(0.0, &vehicle(), speed, 50e3, &MARS), b.measure(0.0, &vehicle(), speed, 50e3, &MARS));
            assert!(y.is_empty() || x == y);
        }
        assert_eq!(b.measure(0.0, &vehicle(), 4000.0, 50e3, &MARS).len(), 1);
    }
}
