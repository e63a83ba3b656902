//! What navigation is told: which algorithm, where it begins, what it may believe of sensors, air and model.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

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
