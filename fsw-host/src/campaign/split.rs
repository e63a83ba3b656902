//! The same run with less to contend with: a flight software that knows the air, and on top of that perfect navigation.
//!
//! What the mean squared miss loses with each step is the share of the atmosphere and of navigation; what is left is that
//! of guidance (with the vehicle's own dispersions, which it is not told). The air comes first because a navigation that
//! measures the density is part of how the flight software copes with an unknown air.

use fsw_core::link::parameters::NavigationMode;
use hil_sim::case::Case;
use hil_sim::scenario::{AtmosphereKind, AtmosphereRow, Scenario};

/// Altitudes of the table that the flight software is told, km: every kilometre where the air steers, every ten above.
/// Between rows of 1 km the shortest wave (10 km, 2 % amplitude) is met to 0.1 % of density.
const FINE_ROWS: u32 = 56;
const COARSE_ROWS: u32 = 8;
const COARSE_KM: f64 = 10.0;

/// The scenario with the air of one case known on board.
#[must_use]
pub fn known_density(scenario: &Scenario, case: &Case) -> Scenario {
    let mut scenario = scenario.clone();
    let air = &case.world.atmosphere;
    let fine = (0..FINE_ROWS).map(f64::from);
    let coarse = (1..=COARSE_ROWS).map(|k| f64::from(FINE_ROWS - 1) + COARSE_KM * f64::from(k));
    let row = |altitude_km: f64| AtmosphereRow {
        altitude_km,
        density_kgpm3: air.density_kgpm3(altitude_km * 1e3),
        temperature_k: Some(air.temperature_k(altitude_km * 1e3)),
        wind_east_mps: 0.0,
        wind_north_mps: 0.0,
    };
    scenario.onboard.atmosphere.kind = AtmosphereKind::Table;
    scenario.onboard.atmosphere.rows = Some(fine.chain(coarse).map(row).collect());
    scenario
}

/// A scenario with ideal navigation.
#[must_use]
pub fn ideal_navigation(mut scenario: Scenario) -> Scenario {
    scenario.navigation.filter = NavigationMode::Ideal;
    scenario
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::link::parameters::MAX_ATMOSPHERE_ROWS;

    #[test]
    fn the_flight_software_is_told_the_air_of_the_case() {
        let scenario = Scenario::builtin("msl").unwrap();
        let case = Case::draw(&scenario, 1, 3, false);
        let told = known_density(&scenario, &case);
        let rows = told.onboard.atmosphere.rows.unwrap();
        assert!(rows.len() <= MAX_ATMOSPHERE_ROWS);
        assert!(rows.windows(2).all(|w| w[1].altitude_km > w[0].altitude_km));
        let row = rows.iter().find(|row| row.altitude_km == 20.0).unwrap();
        assert_eq!(row.density_kgpm3, case.world.atmosphere.density_kgpm3(20e3));
        assert_eq!(told.navigation.filter, NavigationMode::Ekf);
    }
}
