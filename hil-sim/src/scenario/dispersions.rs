//! What differs from run to run, and what goes wrong on purpose.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Distribution of one quantity about its nominal value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "DispersionFields", into = "DispersionFields")]
pub enum Dispersion {
    /// Always nominal.
    None,
    /// Zero-mean normal.
    Normal {
        /// Three standard deviations, in the unit of the quantity.
        three_sigma: f64,
    },
    /// Uniform between bounds.
    Uniform {
        /// [lowest, highest], in the unit of the quantity.
        bounds: [f64; 2],
    },
}

/// A dispersion as written.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DispersionFields {
    distribution: Distribution,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    three_sigma: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bounds: Option<[f64; 2]>,
}

/// Name of a distribution in a file.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Distribution {
    None,
    Normal,
    Uniform,
}

impl TryFrom<DispersionFields> for Dispersion {
    type Error = &'static str;

    fn try_from(f: DispersionFields) -> Result<Self, Self::Error> {
        match (f.distribution, f.three_sigma, f.bounds) {
            (Distribution::None, None, None) => Ok(Self::None),
            (Distribution::Normal, Some(three_sigma), None) => Ok(Self::Normal { three_sigma }),
            (Distribution::Uniform, None, Some(bounds)) => Ok(Self::Uniform { bounds }),
            (Distribution::None, ..) => Err("distribution \"none\" takes neither `three_sigma` nor `bounds`"),
            (Distribution::Normal, ..) => Err("distribution \"normal\" takes `three_sigma` and nothing else"),
            (Distribution::Uniform, ..) => {
                Err("distribution \"uniform\" takes `bounds = [lowest, highest]` and nothing else")
            }
        }
    }
}

impl From<Dispersion> for DispersionFields {
    fn from(dispersion: Dispersion) -> Self {
        match dispersion {
            Dispersion::None => Self { distribution: Distribution::None, three_sigma: None, bounds: None },
            Dispersion::Normal { three_sigma } => {
                Self { distribution: Distribution::Normal, three_sigma: Some(three_sigma), bounds: None }
            }
            Dispersion::Uniform { bounds } => {
                Self { distribution: Distribution::Uniform, three_sigma: None, bounds: Some(bounds) }
            }
        }
    }
}

/// Declares [`Dispersions`] together with the list of its names, so that neither can miss one.
macro_rules! dispersions {
    ($($(#[$doc:meta])* $field:ident),+ $(,)?) => {
        /// Every dispersed quantity. Sensor errors and the initial navigation errors are drawn besides, from the
        /// standard deviations of `[sensors]` and `[navigation]`.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Dispersions {
            /// Whether the eight winds below are drawn.
            pub winds: bool,
            $($(#[$doc])* pub $field: Dispersion,)+
        }

        impl Dispersions {
            /// Every dispersed quantity with its name, in a fixed order. Winds are [`Dispersion::None`] when off.
            #[must_use]
            pub fn all(&self) -> Vec<(&'static str, Dispersion)> {
                let drawn = |name: &str, d: Dispersion| if !self.winds && name.starts_with("wind_") { Dispersion::None } else { d };
                vec![$((stringify!($field), drawn(stringify!($field), self.$field))),+]
            }
        }
    };
}

dispersions! {
    /// Entry flight-path angle, deg, added.
    flight_path_angle_deg,
    /// Entry speed, m/s, added.
    speed_mps,
    /// Entry heading, deg, added.
    heading_deg,
    /// Entry position along the track (positive ahead), km, added.
    along_track_km,
    /// Entry position across the track (positive right), km, added.
    cross_track_km,
    /// Entry altitude, km, added.
    altitude_km,
    /// Density bias b of (1 + b), fraction.
    density_bias,
    /// Density slope sl of exp(sl·z), z = clamp((h − 20 km)/40 km, −0.5, 1.5).
    density_slope,
    /// Density wave amplitude wa of exp(wa·sin(2πh/wl + wp)).
    density_wave_amplitude,
    /// Density wave length wl, km.
    density_wave_length_km,
    /// Density wave phase wp, deg.
    density_wave_phase_deg,
    /// Drag coefficient, fraction.
    drag_coefficient,
    /// Lift coefficient, fraction.
    lift_coefficient,
    /// Mass, fraction.
    mass,
    /// Wind towards east at 0 km, m/s; linear in altitude between the four.
    wind_east_0km_mps,
    /// Wind towards east at 15 km, m/s.
    wind_east_15km_mps,
    /// Wind towards east at 30 km, m/s.
    wind_east_30km_mps,
    /// Wind towards east at 60 km and above, m/s.
    wind_east_60km_mps,
    /// Wind towards north at 0 km, m/s.
    wind_north_0km_mps,
    /// Wind towards north at 15 km, m/s.
    wind_north_15km_mps,
    /// Wind towards north at 30 km, m/s.
    wind_north_30km_mps,
    /// Wind towards north at 60 km and above, m/s.
    wind_north_60km_mps,
}

/// A fault of a sensor, of the link or of the flight computer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What happens.
    pub kind: FaultKind,
    /// To what.
    pub target: FaultTarget,
    /// From this time on.
    pub start_s: f64,
    /// For this long.
    pub duration_s: f64,
    /// Numbers that the kind needs, by name: `bias` takes `value` (m/s², deg/s, Pa or m), `scale` takes `factor`,
    /// `bit-flips` takes `per_packet` (probability), `duplicate` takes `copies`, `garbage` takes `bytes` (a minor frame)
    /// and `piece` (bytes between two delimiters); none comes down a line that is held back.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, f64>,
}

impl Fault {
    /// Whether the fault acts at this time.
    #[must_use]
    pub fn acts_at(&self, time_s: f64) -> bool {
        time_s >= self.start_s && time_s < self.start_s + self.duration_s
    }
}

/// Kinds of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// No data.
    Dropout,
    /// A constant is added (all axes of an inertial sensor).
    Bias,
    /// The reading is multiplied.
    Scale,
    /// The last reading before the fault is repeated.
    Stuck,
    /// The unit reports itself failed.
    Failed,
    /// Packets are corrupted: link only.
    BitFlips,
    /// Packets come several times, as far as the line has room: link only.
    Duplicate,
    /// Packets are held back until the fault is over, and then come as fast as the line goes: link only.
    Hold,
    /// Bytes that are no packets, before those of each minor frame, as far as the line has room: link only.
    Garbage,
    /// Guidance takes twice its budget, as the flight computer is told to believe: flight computer only.
    Overrun,
}

/// What a fault strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultTarget {
    /// Accelerometers.
    Accelerometer,
    /// Gyros.
    Gyro,
    /// The whole inertial unit.
    Imu,
    /// Stagnation pressure.
    Pressure,
    /// Radio.
    Radio,
    /// Bytes to the flight computer.
    Uplink,
    /// The flight computer.
    Computer,
}
