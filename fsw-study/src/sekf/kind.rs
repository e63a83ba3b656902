//! Which filters the study flies.

use serde::{Deserialize, Serialize};

/// A filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Extended Kalman filter that ignores the input.
    Ekf,
    /// P1's self-calibrating filter in its joint form.
    Sekf,
    /// The equations as they are printed, (12), (14), (16) with the start (19); to teach, not to fly.
    SekfPrinted,
    /// The same with the exact start; to teach as well.
    SekfUnfactored,
    /// P1's filter in its joint form, started after the pull-in.
    SekfLate,
    /// With a share ρ of the gain for the input.
    SekfRho,
    /// Considers the input, does not estimate it.
    Schmidt,
    /// Estimates the input.
    Aekf12,
    /// And density, lift and accelerometer bias.
    Aekf17,
}

impl Kind {
    /// All, the one that the others are set against first.
    pub const ALL: [Self; 9] = [
        Self::Ekf,
        Self::Sekf,
        Self::SekfPrinted,
        Self::SekfUnfactored,
        Self::SekfLate,
        Self::SekfRho,
        Self::Schmidt,
        Self::Aekf12,
        Self::Aekf17,
    ];

    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ekf => "EKF",
            Self::Sekf => "SEKF",
            Self::SekfPrinted => "SEKF as printed",
            Self::SekfUnfactored => "SEKF (12)+(16)",
            Self::SekfLate => "SEKF late",
            Self::SekfRho => "SEKF-ρ",
            Self::Schmidt => "Schmidt",
            Self::Aekf12 => "AEKF-12",
            Self::Aekf17 => "AEKF-17",
        }
    }

    /// Whether [`Settings::input`](super::config::Settings::input) means something to it.
    #[must_use]
    pub const fn has_input_setting(self) -> bool {
        matches!(self, Self::SekfRho | Self::Schmidt | Self::Aekf12 | Self::Aekf17)
    }

    /// Whose tuned settings it flies with: its own, but for the printed forms, which are other ways to write the SEKF.
    #[must_use]
    pub const fn tuned_as(self) -> Self {
        match self {
            Self::SekfPrinted | Self::SekfUnfactored => Self::Sekf,
            kind => kind,
        }
    }

    /// Whether it is shipped: its covariance can never become indefinite.
    #[must_use]
    pub const fn is_shipped(self) -> bool {
        !matches!(self, Self::SekfPrinted | Self::SekfUnfactored)
    }
}
