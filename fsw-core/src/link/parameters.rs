//! Parameter blocks: everything the flight software is told before it is armed. They are the flight software's own
//! belief of planet, air and vehicle, and the settings of every algorithm. SI units and radians.
//!
//! The same structs make the [`crate::config::Config`] tree; each has flight defaults and a range check there.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

pub use crate::model::parameters::{
    AeroRow, AtmosphereParameters, AtmosphereRow, MAX_AERO_ROWS, MAX_ATMOSPHERE_ROWS, RadioSource, VehicleParameters,
};
use crate::planet::Planet;

/// Table rows in one block.
pub const ROWS_PER_BLOCK: usize = 4;

/// One parameter block as it travels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParameterBlock {
    /// Algorithms to run.
    Modes(Modes),
    /// Planet.
    Planet(Planet),
    /// Vehicle.
    Vehicle(VehicleParameters),
    /// Rows of the Mach table.
    AeroRows(AeroRows),
    /// Atmosphere.
    Atmosphere(AtmosphereParameters),
    /// Rows of the atmosphere table.
    AtmosphereRows(AtmosphereRows),
    /// Target.
    Target(Target),
    /// Parachute trigger.
    Deploy(DeployParameters),
    /// One radio source.
    Source {
        /// Slot, 0 to `MAX_SOURCES` − 1.
        slot: u8,
        /// What it is.
        source: RadioSource,
    },
    /// Initial knowledge.
    InitialKnowledge(InitialKnowledge),
    /// Filter settings.
    Navigation(NavigationParameters),
    /// Guidance settings.
    Guidance(GuidanceParameters),
    /// Limits of load, heat flux and dynamic pressure.
    Constraints(ConstraintParameters),
    /// Bank control.
    Control(ControlParameters),
    /// Settings of the filters over the onboard model.
    Estimators(EstimatorParameters),
}

/// Names one block, for read-back and refusals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BlockId {
    /// [`ParameterBlock::Modes`]
    Modes,
    /// [`ParameterBlock::Planet`]
    Planet,
    /// [`ParameterBlock::Vehicle`]
    Vehicle,
    /// [`ParameterBlock::AeroRows`], the block that starts at this row.
    AeroRows(u8),
    /// [`ParameterBlock::Atmosphere`]
    Atmosphere,
    /// [`ParameterBlock::AtmosphereRows`], the block that starts at this row.
    AtmosphereRows(u8),
    /// [`ParameterBlock::Target`]
    Target,
    /// [`ParameterBlock::Deploy`]
    Deploy,
    /// [`ParameterBlock::Source`], by slot.
    Source(u8),
    /// [`ParameterBlock::InitialKnowledge`]
    InitialKnowledge,
    /// [`ParameterBlock::Navigation`]
    Navigation,
    /// [`ParameterBlock::Guidance`]
    Guidance,
    /// [`ParameterBlock::Constraints`]
    Constraints,
    /// [`ParameterBlock::Control`]
    Control,
    /// [`ParameterBlock::Estimators`]
    Estimators,
}

/// Which algorithm of each kind flies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Modes {
    /// Navigation.
    pub navigation: NavigationMode,
    /// Guidance.
    pub guidance: GuidanceMode,
    /// Parachute trigger.
    pub trigger: TriggerKind,
}

/// Declares the navigation algorithms with the name that each has in files and on the command line, and a title; so that a new
/// one is named in one place.
macro_rules! navigation_modes {
    ($($(#[$attribute:meta])* $variant:ident = $name:literal, $title:literal;)+) => {
        /// Navigation algorithms.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum NavigationMode {
            $(#[doc = $title] $(#[$attribute])* $variant,)+
        }

        impl NavigationMode {
            /// All, in the order of their numbers on the link.
            pub const ALL: &[Self] = &[$(Self::$variant,)+];

            /// Its name in scenario files and on the command line.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ }
            }

            /// What it is, in a few words.
            #[must_use]
            pub const fn title(self) -> &'static str {
                match self { $(Self::$variant => $title,)+ }
            }
        }
    };
}

navigation_modes! {
    #[default]
    Ekf = "ekf", "Error-state EKF around the strapdown solution";
    DeadReckoning = "dead-reckoning", "Strapdown alone";
    Ideal = "ideal", "The truth packet, simulation only";
    ModelEkf = "model-ekf", "EKF over the onboard model: position and velocity alone";
    Sekf = "sekf", "Self-calibrating EKF of P1 over the onboard model";
    SekfRho = "sekf-rho", "Self-calibrating EKF with a share of the gain, fading";
    AugmentedInput = "augmented-input", "EKF over the onboard model that estimates an unknown input";
    Augmented = "augmented", "EKF over the onboard model that estimates density, lift and accelerometer bias";
    Schmidt = "schmidt", "Schmidt's filter: considers density, lift and accelerometer bias";
    Ddf1 = "ddf1", "Divided-difference filter of first order";
    Ddf2 = "ddf2", "Divided-difference filter of second order";
    Rddf1 = "rddf1", "Desensitized divided-difference filter of first order (P2)";
    Rddf2 = "rddf2", "Desensitized divided-difference filter of second order (P2)";
    Rddf2Lite = "rddf2-lite", "The same with sensitivities of first order";
    Arddf = "arddf", "Desensitized filter whose order follows rank-sampled nonlinearity (P2)";
    ArddfFree = "arddf-free", "Desensitized filter whose order follows its own points' nonlinearity";
    Mmae = "mmae", "Seven density models weighed by a mixture-of-experts gating (P3)";
    MmaeBare = "mmae-bare", "The same without normalised readings; a teaching baseline that fails";
    MmaeProduct = "mmae-product", "Seven density models, plain product of densities; a teaching baseline that fails";
    MmaeBayes = "mmae-bayes", "Seven density models, Bayes' rule in logarithms";
    MmaeAugmented = "mmae-augmented", "Seven experts that estimate density and lift, Bayes' rule";
    Imm = "imm", "Interacting multiple model of seven densities";
}

/// Guidance algorithms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GuidanceMode {
    /// The predictor-corrector of P4.
    #[default]
    Paper,
    /// The predictor rehearses the flight, in the air that it has learned.
    Aeroshell,
    /// P4's predictor-corrector from waypoint to waypoint.
    Segmented,
    /// Predictions cut short at the waypoints' speeds; the rest of the range by table.
    SegmentedTable,
    /// Terminal-point guidance derived from that of Apollo.
    Apollo,
}

/// What fires the parachute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TriggerKind {
    /// Planet-relative speed.
    #[default]
    Speed,
    /// Range: the target lies abeam.
    Range,
}

/// Up to four rows of the Mach table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AeroRows {
    /// Index of the first row here; a multiple of [`ROWS_PER_BLOCK`].
    pub start: u8,
    /// Rows of the whole table.
    pub total: u8,
    /// The rows; those beyond `total` are ignored.
    pub rows: [AeroRow; ROWS_PER_BLOCK],
}

/// Up to four rows of the atmosphere table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AtmosphereRows {
    /// Index of the first row here; a multiple of [`ROWS_PER_BLOCK`].
    pub start: u8,
    /// Rows of the whole table.
    pub total: u8,
    /// The rows; those beyond `total` are ignored.
    pub rows: [AtmosphereRow; ROWS_PER_BLOCK],
}

/// Where the parachute should open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Target {
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Planetocentric latitude, rad.
    pub latitude_rad: f64,
}

/// Parachute trigger, deploy limits and the last-chance floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DeployParameters {
    /// Trigger speed of the speed trigger, planet-relative, m/s; also where the predictor stops.
    pub speed_mps: f64,
    /// Range trigger: lowest speed; below it the parachute fires at once, m/s.
    pub window_min_speed_mps: f64,
    /// Range trigger: highest speed, m/s.
    pub window_max_speed_mps: f64,
    /// Below this altitude the parachute fires whatever the trigger says, m.
    pub floor_altitude_m: f64,
    /// Lowest altitude of the deploy box, m.
    pub min_altitude_m: f64,
    /// Highest altitude of the deploy box, m.
    pub max_altitude_m: f64,
    /// Lowest Mach number of the deploy box.
    pub min_mach: f64,
    /// Highest Mach number of the deploy box.
    pub max_mach: f64,
    /// Lowest dynamic pressure of the deploy box, Pa.
    pub min_dynamic_pressure_pa: f64,
    /// Highest dynamic pressure of the deploy box, Pa.
    pub max_dynamic_pressure_pa: f64,
}

/// What the navigator knows at the entry epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InitialKnowledge {
    /// Inertial position, m.
    pub position_m: [f64; 3],
    /// Inertial velocity, m/s.
    pub velocity_mps: [f64; 3],
    /// Attitude body → inertial, quaternion (w, x, y, z).
    pub attitude: [f64; 4],
    /// Standard deviation of the position per axis, m.
    pub position_sigma_m: f64,
    /// Standard deviation of the velocity per axis, m/s.
    pub velocity_sigma_mps: f64,
    /// Standard deviation of the attitude per axis, rad.
    pub attitude_sigma_rad: f64,
}

/// Settings of the error-state filter: what it believes of its sensors and of the air.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NavigationParameters {
    /// Accelerometer bias, 1σ, m/s².
    pub accelerometer_bias_sigma_mps2: f64,
    /// Accelerometer scale factor, 1σ.
    pub accelerometer_scale_sigma: f64,
    /// Accelerometer misalignment, 1σ, rad.
    pub accelerometer_misalignment_sigma_rad: f64,
    /// Accelerometer white noise, (m/s²)/√Hz.
    pub accelerometer_noise: f64,
    /// Gyro bias, 1σ, rad/s.
    pub gyro_bias_sigma_radps: f64,
    /// Gyro scale factor, 1σ.
    pub gyro_scale_sigma: f64,
    /// Angle random walk, rad/√s.
    pub gyro_noise: f64,
    /// Density against the onboard model: 1σ of its logarithm.
    pub log_density_sigma: f64,
    /// Correlation length of the density error in altitude, m.
    pub log_density_length_m: f64,
    /// Pressure: scale error, 1σ; estimated with the rest.
    pub pressure_scale_sigma: f64,
    /// Pressure: offset, 1σ, Pa; estimated with the rest.
    pub pressure_offset_sigma_pa: f64,
    /// Pressure: white noise, 1σ, as a fraction of the reading.
    pub pressure_noise: f64,
    /// Pressure is used above this dynamic pressure, Pa.
    pub pressure_min_dynamic_pa: f64,
    /// Range: white noise, 1σ, m.
    pub range_noise_m: f64,
    /// Range-rate: white noise, 1σ, m/s.
    pub range_rate_noise_mps: f64,
    /// Radio sources below this elevation are not used, rad.
    pub min_elevation_rad: f64,
    /// A measurement whose innovation exceeds this many standard deviations is gated.
    pub gate_sigma: f64,
}

/// Settings of the filters over the onboard model, of all of them together; each mode takes what belongs to it. The error-state
/// filter and dead reckoning need none of these.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EstimatorParameters {
    /// Share of the specific force that the model's errors make where nothing stands for them, 1σ.
    pub unmodelled_share: f64,
    /// The same where an unknown input is calibrated.
    pub calibrated_share: f64,
    /// The same where the best of several densities is a part of a spacing away.
    pub spacing_share: f64,
    /// The same where density and lift are estimated or considered.
    pub modelled_share: f64,
    /// How long an error of the model keeps its sign, s.
    pub error_correlation_s: f64,
    /// Relative error of the lift, 1σ.
    pub lift_sigma: f64,
    /// Unknown input: 1σ of its growth over a second, m/s².
    pub input_growth_mps2: f64,
    /// Self-calibrating filters: their input works from this time on, s.
    pub calibration_start_s: f64,
    /// The same: a correction is what the model missed in so long, s.
    pub calibration_s: f64,
    /// The same, `sekf-rho`: share ρ of the state's gain.
    pub calibration_share: f64,
    /// The same, `sekf-rho`: the input fades in so long, s.
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

/// Settings of the guidance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GuidanceParameters {
    /// Step of the predictor, s.
    pub predictor_step_s: f64,
    /// Longest predicted flight, s.
    pub prediction_horizon_s: f64,
    /// Predicted miss at which the corrector stops, m.
    pub tolerance_m: f64,
    /// Second point of the secant, added to the first bank, rad (P4: 30–50°).
    pub bank_increment_rad: f64,
    /// Corrector iterations of a cycle, at most; predictor calls are bounded by `MAX_PREDICTIONS` besides.
    pub max_iterations: u8,
    /// Smallest commanded bank magnitude in range control, rad.
    pub min_bank_rad: f64,
    /// Largest commanded bank magnitude in range control, rad.
    pub max_bank_rad: f64,
    /// Heading-offset threshold, constant part, m.
    pub threshold_constant_m: f64,
    /// Heading-offset threshold, part linear in speed, m per m/s.
    pub threshold_linear_s: f64,
    /// Heading-offset threshold, part quadratic in speed, m per (m/s)².
    pub threshold_quadratic_s2pm: f64,
    /// Sensed load at which range control begins, m/s².
    pub range_control_load_mps2: f64,
    /// Heading alignment begins below this planet-relative speed, m/s.
    pub alignment_speed_mps: f64,
    /// Gain of the heading alignment, 1/s.
    pub alignment_gain_ps: f64,
    /// Largest bank in heading alignment, rad.
    pub alignment_max_bank_rad: f64,
    /// The desired heading is frozen inside this range to the target, m.
    pub alignment_freeze_range_m: f64,
    /// Mode `aeroshell`, speed trigger: heading alignment begins below this planet-relative speed, m/s.
    pub late_alignment_speed_mps: f64,
    /// Mode `aeroshell`, range trigger: the same, m/s.
    pub range_alignment_speed_mps: f64,
    /// Mode `aeroshell`: a bank reversal when the heading offset exceeds this share of the crossrange that can be recovered.
    pub reversal_share: f64,
}

/// Limits along the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ConstraintParameters {
    /// Sensed load, m/s².
    pub load_mps2: f64,
    /// Convective heat flux at the stagnation point, W/m².
    pub heat_flux_wpm2: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
}

/// Settings of the bank control.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ControlParameters {
    /// Bank held until range control begins, rad.
    pub initial_bank_rad: f64,
    /// Largest bank rate, rad/s.
    pub max_rate_radps: f64,
    /// Largest bank acceleration, rad/s².
    pub max_accel_radps2: f64,
    /// Lag of the actuator as the flight software believes it, s.
    pub lag_s: f64,
}
