//! What a run really flies, read back from its truth: entry state, air, winds, vehicle, sensors and knowledge as they
//! differ from the nominal flight, each under the name and in the unit in which it was asked for.
//!
//! Nothing here looks at what was drawn ([`Case::applied`]). The figures come from the objects that the simulator
//! integrates, so a draw that was lost on its way, scaled wrongly or given the wrong sign shows.

use fsw_core::frames::{Body, PlanetRelative, Rot, Vec3};
use fsw_core::planet::STANDARD_GRAVITY_MPS2;
use fsw_core::units::deg;

use crate::case::{Case, exact_knowledge};
use crate::dispersion::track_shift;

/// Altitudes at which the density is read, km.
const DENSITY_KM: [(f64, &str); 4] = [
    (10.0, "density_ratio_10km"),
    (20.0, "density_ratio_20km"),
    (40.0, "density_ratio_40km"),
    (60.0, "density_ratio_60km"),
];
/// Altitudes at which the wind is dispersed, km.
const WIND_KM: [(f64, &str, &str); 4] = [
    (0.0, "wind_east_0km_mps", "wind_north_0km_mps"),
    (15.0, "wind_east_15km_mps", "wind_north_15km_mps"),
    (30.0, "wind_east_30km_mps", "wind_north_30km_mps"),
    (60.0, "wind_east_60km_mps", "wind_north_60km_mps"),
];

/// One quantity of one run.
pub type Input = (&'static str, f64);

/// Every input of a run by name, in a fixed order; `nominal` is the undispersed case of the same scenario.
#[must_use]
pub fn read_back(case: &Case, nominal: &Case) -> Vec<Input> {
    let mut inputs = entry(case, nominal);
    air(&mut inputs, case, nominal);
    vehicle(&mut inputs, case, nominal);
    winds(&mut inputs, case, nominal);
    sensors(&mut inputs, case);
    knowledge(&mut inputs, case);
    inputs
}

/// The entry state against the nominal one. The heading counts from that of the nominal track at the moved point.
fn entry(case: &Case, nominal: &Case) -> Vec<Input> {
    let planet = &case.world.planet;
    let (flown, base) = (case.entry.planet_relative(0.0, planet), nominal.entry.planet_relative(0.0, planet));
    let ((r, _), (r0, v0)) = (flown.to_cartesian(), base.to_cartesian());
    let (mut along_m, mut right_m) = (0.0, 0.0);
    if let (Some(up), Some(left), Some(here)) = (r0.unit(), r0.cross(&v0).unit(), r.unit()) {
        let ahead = left.cross(&up);
        let (x, y) = (here.dot(&ahead), -here.dot(&left));
        let across = (x * x + y * y).sqrt();
        // The arc over its sine: the point moved on a great circle.
        let stretch = if across > 0.0 { libm::atan2(across, here.dot(&up)) / across } else { 1.0 };
        (along_m, right_m) = (base.radius_m * stretch * x, base.radius_m * stretch * y);
    }
    let shift = track_shift(&r0, &v0, along_m, right_m);
    let carried = PlanetRelative::from_cartesian(&shift.apply(&r0), &shift.apply(&v0));
    vec![
        ("flight_path_angle_deg", deg(flown.flight_path_angle_rad - base.flight_path_angle_rad)),
        ("speed_mps", flown.speed_mps - base.speed_mps),
        ("heading_deg", deg(crate::angle::wrap_rad(flown.heading_rad - carried.heading_rad))),
        ("along_track_km", along_m * 1e-3),
        ("cross_track_km", right_m * 1e-3),
        ("altitude_km", (flown.radius_m - base.radius_m) * 1e-3),
    ]
}

fn air(inputs: &mut Vec<Input>, case: &Case, nominal: &Case) {
    let (air, base) = (&case.world.atmosphere, &nominal.world.atmosphere);
    let d = &air.dispersion;
    inputs.extend([
        ("density_bias", d.bias),
        ("density_slope", d.slope),
        ("density_wave_amplitude", d.wave_amplitude),
        ("density_wave_length_km", d.wave_length_m * 1e-3),
        ("density_wave_phase_deg", deg(d.wave_phase_rad)),
    ]);
    let ratio = |km: f64| air.density_kgpm3(km * 1e3) / base.density_kgpm3(km * 1e3);
    inputs.extend(DENSITY_KM.map(|(km, name)| (name, ratio(km))));
}

fn vehicle(inputs: &mut Vec<Input>, case: &Case, nominal: &Case) {
    let (v, base) = (&case.world.vehicle, &nominal.world.vehicle);
    inputs.extend([
        ("drag_coefficient", v.drag_factor / base.drag_factor - 1.0),
        ("lift_coefficient", v.lift_factor / base.lift_factor - 1.0),
        ("mass", v.mass_kg / base.mass_kg - 1.0),
    ]);
}

fn winds(inputs: &mut Vec<Input>, case: &Case, nominal: &Case) {
    let wind = |km: f64| {
        let ((east, north), (east0, north0)) = (case.world.wind.at(km * 1e3), nominal.world.wind.at(km * 1e3));
        (east - east0, north - north0)
    };
    inputs.extend(WIND_KM.map(|(km, east, _)| (east, wind(km).0)));
    inputs.extend(WIND_KM.map(|(km, _, north)| (north, wind(km).1)));
}

fn sensors(inputs: &mut Vec<Input>, case: &Case) {
    let imu = &case.imu;
    let mut three = |names: [&'static str; 3], values: [f64; 3]| inputs.extend(names.into_iter().zip(values));
    three(
        ["accelerometer_bias_x_ug", "accelerometer_bias_y_ug", "accelerometer_bias_z_ug"],
        imu.accelerometer_bias_mps2.map(|b| b / STANDARD_GRAVITY_MPS2 * 1e6),
    );
    three(
        ["accelerometer_scale_x_ppm", "accelerometer_scale_y_ppm", "accelerometer_scale_z_ppm"],
        imu.accelerometer_scale.map(|s| s * 1e6),
    );
    three(
        ["accelerometer_misalignment_x_mrad", "accelerometer_misalignment_y_mrad", "accelerometer_misalignment_z_mrad"],
        imu.accelerometer_misalignment_rad.map(|m| m * 1e3),
    );
    three(
        ["gyro_bias_x_degph", "gyro_bias_y_degph", "gyro_bias_z_degph"],
        imu.gyro_bias_radps.map(|b| deg(b) * 3600.0),
    );
    three(["gyro_scale_x_ppm", "gyro_scale_y_ppm", "gyro_scale_z_ppm"], imu.gyro_scale.map(|s| s * 1e6));
    inputs.extend([("pressure_scale", case.pressure.scale), ("pressure_offset_pa", case.pressure.offset_pa)]);
}

/// Errors of what the navigator was told: against the true state of the epoch, inertial axes.
fn knowledge(inputs: &mut Vec<Input>, case: &Case) {
    let (told, entry) = (&case.knowledge, &case.entry);
    let position = Vec3::from_array(told.position_m) - entry.r_i;
    let velocity = Vec3::from_array(told.velocity_mps) - entry.v_i;
    let truth = exact_knowledge(&case.world, entry, case.bank.angle_rad);
    let attitude = |q| Rot::<Body, fsw_core::frames::Inertial>::from_quaternion(q).unwrap_or_else(Rot::identity);
    let turn = attitude(truth.attitude).inverse().then(&attitude(told.attitude));
    let tilt = Rot::rotation_vector(&turn);
    inputs.extend(["knowledge_x_m", "knowledge_y_m", "knowledge_z_m"].into_iter().zip(position.to_array()));
    inputs.extend(["knowledge_vx_mps", "knowledge_vy_mps", "knowledge_vz_mps"].into_iter().zip(velocity.to_array()));
    let tilt_deg = [deg(tilt[0]), deg(tilt[1]), deg(tilt[2])];
    inputs.extend(["knowledge_tilt_x_deg", "knowledge_tilt_y_deg", "knowledge_tilt_z_deg"].into_iter().zip(tilt_deg));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    fn value(inputs: &[Input], name: &str) -> f64 {
        inputs.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name} is not read back")).1
    }

    #[test]
    fn what_is_read_back_is_what_was_drawn() {
        let scenario = Scenario::resolve("msl", &["dispersions.winds=true".to_owned()]).unwrap();
        let nominal = Case::draw(&scenario, 5, 0, true);
        for run in 0..50 {
            let case = Case::draw(&scenario, 5, run, false);
            let inputs = read_back(&case, &nominal);
            for (name, drawn) in &case.applied {
                let read = value(&inputs, name);
                // Positions of 3.5e6 m keep 1e-9 m; angles from such positions 1e-9 degree.
                assert!((read - drawn).abs() < 1e-8 * (1.0 + drawn.abs()), "{name}: drawn {drawn}, read back {read}");
            }
        }
    }

    #[test]
    fn a_nominal_flight_reads_back_nothing_but_ratios_of_one() {
        let nominal = Case::draw(&Scenario::builtin("msl").unwrap(), 5, 0, true);
        for (name, value) in read_back(&nominal, &nominal) {
            let expected = if name.starts_with("density_ratio") { 1.0 } else { 0.0 };
            assert!((value - expected).abs() < 1e-12, "{name} {value}");
        }
    }

    #[test]
    fn the_density_at_an_altitude_follows_from_the_dispersion_of_the_air() {
        let scenario = Scenario::builtin("msl").unwrap();
        let nominal = Case::draw(&scenario, 5, 0, true);
        let inputs = read_back(&Case::draw(&scenario, 5, 3, false), &nominal);
        let v = |name| value(&inputs, name);
        let phase =
            std::f64::consts::TAU * 40.0 / v("density_wave_length_km") + v("density_wave_phase_deg").to_radians();
        let expected =
            (1.0 + v("density_bias")) * (v("density_slope") * 0.5 + v("density_wave_amplitude") * phase.sin()).exp();
        assert!((v("density_ratio_40km") / expected - 1.0).abs() < 1e-12);
    }
}
