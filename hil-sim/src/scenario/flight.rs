//! Settings of the flight software: parachute, navigation, guidance, control, and what it believes of the world.

use fsw_core::link::parameters::{AtmosphereParameters, GuidanceMode, NavigationMode, TriggerKind};
use fsw_core::planet::Planet as PlanetSi;
use serde::{Deserialize, Serialize};

use super::air::{AtmosphereKind, AtmosphereRow};
use super::sensors::Sensors;
use super::world::{Planet, Vehicle};

/// Parachute: (trigger and limits) or altitude below the floor; the box defines success.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deploy {
    /// What fires the parachute.
    #[serde(with = "names::trigger")]
    pub trigger: TriggerKind,
    /// Trigger speed of the speed trigger, planet-relative.
    pub speed_mps: f64,
    /// Range trigger: lowest and highest planet-relative speed.
    pub speed_window_mps: [f64; 2],
    /// Below this altitude the parachute fires whatever the trigger says.
    pub floor_altitude_km: f64,
    /// A deploy inside is a success.
    #[serde(rename = "box")]
    pub limits: DeployBox,
}

/// Deploy box, each as [lowest, highest].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeployBox {
    /// Altitude.
    pub altitude_km: [f64; 2],
    /// Air-relative Mach number.
    pub mach: [f64; 2],
    /// Air-relative dynamic pressure.
    pub dynamic_pressure_pa: [f64; 2],
}

impl DeployBox {
    /// Whether a deploy at these conditions is a success.
    #[must_use]
    pub fn contains(&self, altitude_m: f64, mach: f64, dynamic_pressure_pa: f64) -> bool {
        let within = |[low, high]: [f64; 2], x: f64| x >= low && x <= high;
        within(self.altitude_km, altitude_m * 1e-3)
            && within(self.mach, mach)
            && within(self.dynamic_pressure_pa, dynamic_pressure_pa)
    }
}

/// The flight software's own belief; every field defaults to the nominal one above it in the scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Onboard {
    /// Vehicle.
    pub vehicle: Vehicle,
    /// Planet.
    pub planet: Planet,
    /// Air.
    pub atmosphere: OnboardAtmosphere,
    /// Sensors.
    pub sensors: Sensors,
}

/// The air as the flight software believes it: no winds, no perturbation, no `density_scale` unless told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OnboardAtmosphere {
    /// Exponential or table.
    pub kind: AtmosphereKind,
    /// Density at the reference altitude (exponential).
    pub reference_density_kgpm3: f64,
    /// Reference altitude (exponential).
    pub reference_altitude_km: f64,
    /// Scale height (exponential; also gives the default temperature).
    pub scale_height_km: f64,
    /// Rows of the table; winds are ignored on board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<Vec<AtmosphereRow>>,
    /// Temperature; where missing the hydrostatic one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<f64>,
    /// Specific gas constant.
    pub gas_constant_jpkgk: f64,
    /// Ratio of specific heats.
    pub heat_ratio: f64,
}

impl OnboardAtmosphere {
    /// The exponential law in SI units.
    #[must_use]
    pub fn parameters(&self, planet: &PlanetSi) -> AtmosphereParameters {
        AtmosphereParameters {
            reference_density_kgpm3: self.reference_density_kgpm3,
            reference_altitude_m: self.reference_altitude_km * 1e3,
            scale_height_m: self.scale_height_km * 1e3,
            temperature_k: self.temperature_k.unwrap_or_else(|| {
                super::air::hydrostatic_temperature_k(planet, self.scale_height_km * 1e3, self.gas_constant_jpkgk)
            }),
            gas_constant_jpkgk: self.gas_constant_jpkgk,
            heat_ratio: self.heat_ratio,
        }
    }
}

/// Navigation: the algorithm, the errors it starts with (drawn per run, and told to the filter), the filter's settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Navigation {
    /// Algorithm: `ekf`, `dead-reckoning`, `ideal`, or a filter over the onboard model ([`NavigationMode`]).
    #[serde(with = "names::navigation")]
    pub filter: NavigationMode,
    /// Initial position error per axis, 1σ.
    pub position_sigma_m: f64,
    /// Initial velocity error per axis, 1σ.
    pub velocity_sigma_mps: f64,
    /// Initial attitude error per axis, 1σ.
    pub attitude_sigma_deg: f64,
    /// Density against the onboard model: 1σ of its logarithm.
    pub log_density_sigma: f64,
    /// Correlation length of the density error in altitude.
    pub log_density_length_km: f64,
    /// A measurement whose innovation exceeds this many standard deviations is not used.
    pub gate_sigma: f64,
    /// Settings of the filters over the onboard model.
    pub estimators: Estimators,
}

/// Settings of the filters over the onboard model, of all of them together; each mode takes what belongs to it. Units and names are
/// those of [`fsw_core::link::parameters::EstimatorParameters`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimators {
    /// Share of the specific force that the model's errors make where nothing stands for them, 1σ.
    pub unmodelled_share: f64,
    /// The same where an unknown input is calibrated.
    pub calibrated_share: f64,
    /// The same where the best of several densities is a part of a spacing away.
    pub spacing_share: f64,
    /// The same where density and lift are estimated or considered.
    pub modelled_share: f64,
    /// How long an error of the model keeps its sign.
    pub error_correlation_s: f64,
    /// Relative error of the lift, 1σ.
    pub lift_sigma: f64,
    /// Unknown input: 1σ of its growth over a second.
    pub input_growth_mps2: f64,
    /// Self-calibrating filters: their input works from this time on.
    pub calibration_start_s: f64,
    /// A correction is what the model missed in so long.
    pub calibration_s: f64,
    /// `sekf-rho`: share ρ of the state's gain.
    pub calibration_share: f64,
    /// `sekf-rho`: the input fades in so long.
    pub calibration_fade_s: f64,
    /// Gating: learning rate η at ten instants a second.
    pub gating_rate: f64,
    /// Interacting multiple model: probability of no switch in a tenth of a second.
    pub switching_stay: f64,
    /// Bayes' weights: the smallest.
    pub weight_floor: f64,
    /// `arddf`: degree of nonlinearity above which second differences count.
    pub rank_threshold: f64,
    /// `arddf-free`: the same.
    pub free_threshold: f64,
}

/// Guidance settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Guidance {
    /// Algorithm: `aeroshell`, `paper`, `segmented`, `segmented-table` or `apollo`.
    #[serde(with = "names::guidance")]
    pub mode: GuidanceMode,
    /// Step of the predictor.
    pub predictor_step_s: f64,
    /// Longest predicted flight.
    pub prediction_horizon_s: f64,
    /// Predicted miss at which the corrector stops.
    pub tolerance_m: f64,
    /// Second point of the secant, added to the first bank.
    pub bank_increment_deg: f64,
    /// Corrector iterations of a cycle, at most.
    pub max_iterations: u8,
    /// Smallest commanded bank magnitude in range control.
    pub min_bank_deg: f64,
    /// Largest commanded bank magnitude in range control.
    pub max_bank_deg: f64,
    /// Heading-offset threshold of the reversal logic, constant part.
    pub threshold_constant_m: f64,
    /// Part linear in speed, m per m/s.
    pub threshold_linear_s: f64,
    /// Part quadratic in speed, m per (m/s)².
    pub threshold_quadratic_s2pm: f64,
    /// Sensed load at which range control begins.
    pub range_control_load_g: f64,
    /// Heading alignment begins below this planet-relative speed.
    pub alignment_speed_mps: f64,
    /// Gain of the heading alignment, 1/s.
    pub alignment_gain_ps: f64,
    /// Largest bank in heading alignment.
    pub alignment_max_bank_deg: f64,
    /// The desired heading is frozen inside this range to the target.
    pub alignment_freeze_range_km: f64,
    /// Mode `aeroshell`, speed trigger: heading alignment begins below this planet-relative speed.
    pub late_alignment_speed_mps: f64,
    /// Mode `aeroshell`, range trigger: the same.
    pub range_alignment_speed_mps: f64,
    /// Mode `aeroshell`: a bank reversal when the heading offset exceeds this share of the crossrange still recoverable.
    pub reversal_share: f64,
    /// Limits along the path.
    pub limits: Limits,
}

/// Limits along the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Sensed load.
    pub load_g: f64,
    /// Convective heat flux at the stagnation point.
    pub heat_flux_wpm2: f64,
    /// Dynamic pressure.
    pub dynamic_pressure_pa: f64,
}

/// Bank control and its actuator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// Bank held until range control begins; also the true bank at t = 0.
    pub initial_bank_deg: f64,
    /// Largest bank rate.
    pub max_rate_degps: f64,
    /// Largest bank acceleration.
    pub max_accel_degps2: f64,
    /// First-order lag of the actuator; 0 is none.
    pub lag_s: f64,
}

/// Names of the algorithms in scenario files.
mod names {
    /// A serde module for an enum of the link whose names in files are given here.
    macro_rules! named {
        ($module:ident, $type:ty, $($name:literal => $value:path),+) => {
            pub mod $module {
                use serde::de::Error;
                use serde::{Deserialize, Deserializer, Serializer};

                const NAMES: &[&str] = &[$($name),+];

                pub fn serialize<S: Serializer>(value: &$type, s: S) -> Result<S::Ok, S::Error> {
                    s.serialize_str(match value { $($value => $name),+ })
                }

                pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<$type, D::Error> {
                    let name = String::deserialize(d)?;
                    match name.as_str() {
                        $($name => Ok($value),)+
                        other => Err(D::Error::unknown_variant(other, NAMES)),
                    }
                }
            }
        };
    }

    named!(trigger, fsw_core::link::parameters::TriggerKind,
        "speed" => fsw_core::link::parameters::TriggerKind::Speed,
        "range" => fsw_core::link::parameters::TriggerKind::Range);
    pub mod navigation {
        use fsw_core::link::parameters::NavigationMode;
        use serde::de::Error;
        use serde::{Deserialize, Deserializer, Serializer};

        pub fn serialize<S: Serializer>(mode: &NavigationMode, s: S) -> Result<S::Ok, S::Error> {
            s.serialize_str(mode.name())
        }

        pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<NavigationMode, D::Error> {
            const NAMES: [&str; NavigationMode::ALL.len()] = names();
            let name = String::deserialize(d)?;
            let found = NavigationMode::ALL.iter().find(|mode| mode.name() == name);
            found.copied().ok_or_else(|| D::Error::unknown_variant(&name, &NAMES))
        }

        const fn names() -> [&'static str; NavigationMode::ALL.len()] {
            let mut names = [""; NavigationMode::ALL.len()];
            let mut i = 0;
            while i < names.len() {
                names[i] = NavigationMode::ALL[i].name();
                i += 1;
            }
            names
        }
    }

    named!(guidance, fsw_core::link::parameters::GuidanceMode,
        "paper" => fsw_core::link::parameters::GuidanceMode::Paper,
        "aeroshell" => fsw_core::link::parameters::GuidanceMode::Aeroshell,
        "segmented" => fsw_core::link::parameters::GuidanceMode::Segmented,
        "segmented-table" => fsw_core::link::parameters::GuidanceMode::SegmentedTable,
        "apollo" => fsw_core::link::parameters::GuidanceMode::Apollo);
}
