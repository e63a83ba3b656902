//! Conditions at deployment, largest values along the paths, and the runs beyond a limit.

use std::io;

use serde::{Deserialize, Serialize};

use super::distribution::Spread;
use crate::campaign::runs::Runs;
use crate::record::ScenarioFacts;

/// Conditions at deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deploy {
    /// Time, s.
    pub time_s: Option<Spread>,
    /// Altitude, m.
    pub altitude_m: Option<Spread>,
    /// Planet-relative speed, m/s.
    pub speed_mps: Option<Spread>,
    /// Air-relative Mach number.
    pub mach: Option<Spread>,
    /// Air-relative dynamic pressure, Pa.
    pub dynamic_pressure_pa: Option<Spread>,
}

/// Largest values along the paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Peaks {
    /// Sensed load, g.
    pub load_g: Option<Spread>,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: Option<Spread>,
    /// Heat flux, W/m².
    pub heat_flux_wpm2: Option<Spread>,
}

/// Runs beyond a limit of the scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Violations {
    /// Sensed load.
    pub load: u64,
    /// Dynamic pressure.
    pub dynamic_pressure: u64,
    /// Heat flux.
    pub heat_flux: u64,
    /// Deployed outside the altitudes of the box.
    pub deploy_altitude: u64,
    /// Deployed outside its Mach numbers.
    pub deploy_mach: u64,
    /// Deployed outside its dynamic pressures.
    pub deploy_dynamic_pressure: u64,
}

impl Deploy {
    /// Of a table.
    pub(super) fn of(runs: &Runs) -> io::Result<Self> {
        Ok(Self {
            time_s: spread(runs, "deploy_time_s")?,
            altitude_m: spread(runs, "deploy_altitude_m")?,
            speed_mps: spread(runs, "deploy_speed_mps")?,
            mach: spread(runs, "deploy_mach")?,
            dynamic_pressure_pa: spread(runs, "deploy_dynamic_pressure_pa")?,
        })
    }
}

impl Peaks {
    /// Of a table.
    pub(super) fn of(runs: &Runs) -> io::Result<Self> {
        Ok(Self {
            load_g: spread(runs, "peak_load_g")?,
            dynamic_pressure_pa: spread(runs, "peak_dynamic_pressure_pa")?,
            heat_flux_wpm2: spread(runs, "peak_heat_flux_wpm2")?,
        })
    }
}

/// Range of a column.
pub(super) fn spread(runs: &Runs, name: &str) -> io::Result<Option<Spread>> {
    Ok(Spread::of(&runs.numbers(name)?))
}

impl Violations {
    /// Of a table, by the limits of its scenario.
    pub(super) fn of(runs: &Runs, facts: &ScenarioFacts) -> io::Result<Self> {
        let (limits, deploy) = (&facts.constraints, &facts.deploy);
        let beyond = |name: &str, low: f64, high: f64| {
            let values = runs.numbers(name)?;
            io::Result::Ok(values.iter().filter(|v| v.is_finite() && !(low..=high).contains(*v)).count() as u64)
        };
        Ok(Self {
            load: beyond("peak_load_g", 0.0, limits.load_mps2 / fsw_core::planet::STANDARD_GRAVITY_MPS2)?,
            dynamic_pressure: beyond("peak_dynamic_pressure_pa", 0.0, limits.dynamic_pressure_pa)?,
            heat_flux: beyond("peak_heat_flux_wpm2", 0.0, limits.heat_flux_wpm2)?,
            deploy_altitude: beyond("deploy_altitude_m", deploy.min_altitude_m, deploy.max_altitude_m)?,
            deploy_mach: beyond("deploy_mach", deploy.min_mach, deploy.max_mach)?,
            deploy_dynamic_pressure: beyond(
                "deploy_dynamic_pressure_pa",
                deploy.min_dynamic_pressure_pa,
                deploy.max_dynamic_pressure_pa,
            )?,
        })
    }
}
