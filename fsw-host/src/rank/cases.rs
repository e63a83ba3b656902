//! The cases of a ranking: the scenario as it is, and what may go wrong that the flight software is not told of.

use clap::ValueEnum;
use fsw_core::units::deg;
use hil_sim::scenario::{Beacon, Blackout, Dispersion, Orbiter, Scenario, Target};

/// Of the polar orbiter.
const POLAR_ALTITUDE_KM: f64 = 302.8;
/// From the target to the only beacon, along the sphere.
const BEACON_DISTANCE_KM: f64 = 25.0;

/// A case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CaseName {
    /// The scenario as it is.
    Plain,
    /// A sine of 0.1 % in the density over the altitude, and no other dispersion of the air.
    DensitySine01,
    /// One of 1 %.
    DensitySine1,
    /// One of 5 %.
    DensitySine5,
    /// The air 30 % thicker than the onboard model.
    DensityPlus30,
    /// 30 % thinner.
    DensityMinus30,
    /// Accelerometer bias of 1000 µg (1σ) where the flight software expects the scenario's.
    AccelerometerBias1000,
    /// 3000 µg.
    AccelerometerBias3000,
    /// Initial errors three times as large.
    InitialErrors3,
    /// No radio above 700 m/s.
    RadioBlackout,
    /// No pressure.
    PressureLost,
    /// One orbiter in a polar orbit, close to the plane of the entry.
    PolarOrbiter,
    /// No orbiter: one beacon 25 km north of the target.
    BeaconsOnly,
}

impl CaseName {
    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// Changes a scenario, whichever it is. What the flight software believes stays as it is, but for the initial errors, which
    /// it is told.
    pub fn apply(self, scenario: &mut Scenario) {
        match self {
            Self::Plain => {}
            Self::DensitySine01 => sine(scenario, 0.001),
            Self::DensitySine1 => sine(scenario, 0.01),
            Self::DensitySine5 => sine(scenario, 0.05),
            Self::DensityPlus30 => scenario.atmosphere.density_scale *= 1.3,
            Self::DensityMinus30 => scenario.atmosphere.density_scale *= 0.7,
            Self::AccelerometerBias1000 => scenario.sensors.imu.accelerometer_bias_ug = 1000.0,
            Self::AccelerometerBias3000 => scenario.sensors.imu.accelerometer_bias_ug = 3000.0,
            Self::InitialErrors3 => {
                let n = &mut scenario.navigation;
                for sigma in [&mut n.position_sigma_m, &mut n.velocity_sigma_mps, &mut n.attitude_sigma_deg] {
                    *sigma *= 3.0;
                }
            }
            Self::RadioBlackout => {
                scenario.sensors.radio.blackout = Blackout { above_speed_mps: 700.0, below_altitude_km: 1000.0 };
            }
            Self::PressureLost => scenario.sensors.pressure.enabled = false,
            Self::PolarOrbiter => scenario.orbiter = vec![polar_orbiter(scenario)],
            Self::BeaconsOnly => {
                scenario.orbiter.clear();
                scenario.beacon = vec![northern_beacon(scenario)];
            }
        }
    }
}

/// No dispersion of the air but a sine of this amplitude.
fn sine(scenario: &mut Scenario, amplitude: f64) {
    let d = &mut scenario.dispersions;
    (d.density_bias, d.density_slope) = (Dispersion::None, Dispersion::None);
    d.density_wave_amplitude = Dispersion::Uniform { bounds: [amplitude; 2] };
}

/// A circular orbit over both poles that passes the entry 7° to the east, 10° north of it at t = 0.
fn polar_orbiter(scenario: &Scenario) -> Orbiter {
    let entry = scenario.entry.planet_relative(&scenario.planet.si());
    let within_a_turn = |degrees: f64| (degrees + 180.0).rem_euclid(360.0) - 180.0;
    Orbiter {
        name: "polar".into(),
        semi_major_axis_km: scenario.planet.radius_km + POLAR_ALTITUDE_KM,
        eccentricity: 0.0,
        inclination_deg: 90.0,
        // Of a descending pass: the node is on the other side of the planet.
        raan_deg: within_a_turn(deg(entry.longitude_rad) + 180.0 + 7.0),
        arg_periapsis_deg: 0.0,
        true_anomaly_deg: within_a_turn(180.0 - (deg(entry.latitude_rad) + 10.0)),
    }
}

/// A beacon north of the target; at a pole, south of it.
fn northern_beacon(scenario: &Scenario) -> Beacon {
    let Target { longitude_deg, latitude_deg } = scenario.target;
    let away_deg = deg(BEACON_DISTANCE_KM / scenario.planet.radius_km);
    let north_deg = latitude_deg + away_deg;
    let latitude_deg = if north_deg <= 90.0 { north_deg } else { latitude_deg - away_deg };
    Beacon { name: "north".into(), longitude_deg, latitude_deg, altitude_km: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(name: &str, case: CaseName) -> Scenario {
        let mut scenario = Scenario::builtin(name).unwrap();
        case.apply(&mut scenario);
        scenario
    }

    #[test]
    fn every_case_of_every_scenario_can_be_flown_and_no_belief_changes() {
        for name in Scenario::builtin_names() {
            let plain = Scenario::builtin(name).unwrap();
            for case in CaseName::value_variants() {
                let scenario = applied(name, *case);
                scenario.check_reach().unwrap_or_else(|e| panic!("{name}, {}: {e}", case.name()));
                assert_eq!(scenario.onboard, plain.onboard, "{name}, {}", case.name());
                assert_eq!(scenario == plain, *case == CaseName::Plain, "{name}, {}", case.name());
            }
        }
    }

    #[test]
    fn the_only_beacon_stands_25_km_from_the_target_wherever_that_is() {
        for name in Scenario::builtin_names() {
            let scenario = applied(name, CaseName::BeaconsOnly);
            let [beacon] = &scenario.beacon[..] else { panic!("one beacon") };
            let [from, to] = [scenario.target.latitude_deg, beacon.latitude_deg].map(f64::to_radians);
            assert!((scenario.planet.radius_km * (to - from).abs() - 25.0).abs() < 1e-9, "{name}");
            assert!(scenario.orbiter.is_empty());
        }
        let mut scenario = Scenario::builtin("msl").unwrap();
        scenario.target.latitude_deg = 89.9;
        assert!(northern_beacon(&scenario).latitude_deg < 89.9);
    }

    #[test]
    fn the_polar_orbiter_is_over_the_poles_and_in_sight_of_the_entry() {
        for name in Scenario::builtin_names() {
            let scenario = applied(name, CaseName::PolarOrbiter);
            let planet = scenario.planet.si();
            let (r, v) = scenario.orbiter[0].inertial_state(&planet);
            let momentum_z = r[0] * v[1] - r[1] * v[0];
            assert!(momentum_z.abs() < 1e-6 * 3.7e6 * 3.4e3, "{name}: {momentum_z}");
            // At t = 0 inertial axes are the planet's.
            let (p, _) = scenario.entry.planet_relative(&planet).to_cartesian();
            let p = p.to_array();
            let cosine = (0..3).map(|k| p[k] * r[k]).sum::<f64>() / (norm(&p) * norm(&r));
            assert!(cosine > 12.5f64.to_radians().cos(), "{name}: {cosine}");
        }
    }

    fn norm(v: &[f64; 3]) -> f64 {
        v.iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}
