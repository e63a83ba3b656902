//! Table 1 of P1: where the vehicle really starts and what it is, and what the filters are told.

use fsw_core::nav::estimators::models::Spherical;
use fsw_core::units::rad;
use serde::{Deserialize, Serialize};

use super::STATES;

/// A column of P1's Table 1: state and vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table1 {
    /// Altitude over 3397.2 km, km.
    pub altitude_km: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Flight-path angle, deg.
    pub path_angle_deg: f64,
    /// Longitude, deg.
    pub longitude_deg: f64,
    /// Latitude, deg.
    pub latitude_deg: f64,
    /// Heading, deg.
    pub heading_deg: f64,
    /// B = C_D S/m, m²/kg.
    pub drag_area_m2pkg: f64,
    /// Density at 40 km, kg/m³.
    pub density_kgpm3: f64,
    /// Lift over drag.
    pub lift_to_drag: f64,
}

impl Table1 {
    /// Column "true".
    pub const TRUE: Self = Self {
        altitude_km: 125.0,
        speed_mps: 6_900.0,
        path_angle_deg: -12.0,
        longitude_deg: 0.0,
        latitude_deg: 1.0,
        heading_deg: 89.0,
        drag_area_m2pkg: 0.016,
        density_kgpm3: 2e-4,
        lift_to_drag: 0.156,
    };

    /// Column "initial".
    pub const INITIAL: Self = Self {
        altitude_km: 126.0,
        speed_mps: 7_000.0,
        path_angle_deg: -13.0,
        longitude_deg: 0.02,
        latitude_deg: 1.02,
        heading_deg: 90.0,
        drag_area_m2pkg: 0.0176,
        density_kgpm3: 2.2e-4,
        lift_to_drag: 0.172,
    };
}

/// Radius from which P1 counts altitude, m.
pub(super) const SURFACE_M: f64 = 3_397_200.0;

impl Table1 {
    /// x = [r, v, γ, θ, λ, ψ].
    #[must_use]
    pub fn state(&self) -> [f64; STATES] {
        let angle = |deg: f64| rad(deg);
        [
            SURFACE_M + 1e3 * self.altitude_km,
            self.speed_mps,
            angle(self.path_angle_deg),
            angle(self.longitude_deg),
            angle(self.latitude_deg),
            angle(self.heading_deg),
        ]
    }

    /// P1's world with this vehicle and density.
    #[must_use]
    pub fn model(&self, bank_deg: f64) -> Spherical {
        let mut model = Spherical::MARS;
        model.drag_area_m2pkg = self.drag_area_m2pkg;
        model.density_kgpm3 = self.density_kgpm3;
        model.lift_to_drag = self.lift_to_drag;
        model.banked(rad(bank_deg))
    }
}
