//! The cases of a ranking: the scenario as it is, and what may go wrong that the flight software is not told of.

use clap::ValueEnum;

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

    /// What it changes in the scenario.
    #[must_use]
    pub fn sets(self) -> Vec<String> {
        let owned = |sets: &[&str]| sets.iter().map(|set| (*set).to_owned()).collect();
        let sine = |amplitude: f64| {
            let mut sets: Vec<String> = owned(&[
                "dispersions.density_bias={ distribution = \"none\" }",
                "dispersions.density_slope={ distribution = \"none\" }",
            ]);
            sets.push(format!(
                "dispersions.density_wave_amplitude={{ distribution = \"uniform\", bounds = [{amplitude:?}, {amplitude:?}] }}"
            ));
            sets
        };
        match self {
            Self::Plain => Vec::new(),
            Self::DensitySine01 => sine(0.001),
            Self::DensitySine1 => sine(0.01),
            Self::DensitySine5 => sine(0.05),
            Self::DensityPlus30 => owned(&["atmosphere.density_scale=1.3"]),
            Self::DensityMinus30 => owned(&["atmosphere.density_scale=0.7"]),
            Self::AccelerometerBias1000 => bias(1000.0),
            Self::AccelerometerBias3000 => bias(3000.0),
            Self::InitialErrors3 => owned(&[
                "navigation.position_sigma_m=1500.0",
                "navigation.velocity_sigma_mps=0.9",
                "navigation.attitude_sigma_deg=0.09",
            ]),
            Self::RadioBlackout => {
                owned(&["sensors.radio.blackout={ above_speed_mps = 700.0, below_altitude_km = 130.0 }"])
            }
            Self::PressureLost => owned(&["sensors.pressure.enabled=false"]),
            Self::PolarOrbiter => owned(&[
                "orbiter=[{ name = \"polar\", semi_major_axis_km = 3700.0, eccentricity = 0.0, inclination_deg = 90.0, raan_deg = 96.8, arg_periapsis_deg = 0.0, true_anomaly_deg = -145.9 }]",
            ]),
            Self::BeaconsOnly => owned(&[
                "orbiter=[]",
                "beacon=[{ name = \"north\", longitude_deg = -73.260, latitude_deg = -41.02836, altitude_km = 0.0 }]",
            ]),
        }
    }
}

/// The true unit has this bias; the flight software believes in the scenario's.
fn bias(micro_g: f64) -> Vec<String> {
    vec![
        format!("sensors.imu.accelerometer_bias_ug={micro_g:?}"),
        "onboard.sensors.imu.accelerometer_bias_ug=100.0".to_owned(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim::scenario::Scenario;

    #[test]
    fn every_case_is_a_scenario_that_can_be_flown() {
        for case in CaseName::value_variants() {
            let scenario = Scenario::resolve("msl", &case.sets()).unwrap_or_else(|e| panic!("{}: {e}", case.name()));
            scenario.check_reach().unwrap_or_else(|e| panic!("{}: {e}", case.name()));
        }
    }
}
