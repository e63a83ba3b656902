//! The inertial measurements are honest and the strapdown is exact: with perfect sensors and exact knowledge of the
//! epoch, dead reckoning flies a whole entry, bank reversals and all, and ends on the truth.

use hil_sim::scenario::Scenario;

fn closure(changes: &[&str], seed: u64, nominal: bool) -> (f64, f64, u32) {
    let changes: Vec<String> = changes.iter().map(|c| (*c).to_owned()).collect();
    let scenario = Scenario::resolve("msl", &changes).unwrap_or_else(|e| panic!("{e}"));
    let record = fsw_host::fly::fly_in_process(&scenario, seed, 0, nominal).unwrap_or_else(|e| panic!("{e}"));
    let navigation = &record.summary.navigation;
    let error = |value: Option<f64>| value.expect("the flight has an end");
    (error(navigation.position_error_m), error(navigation.velocity_error_mps), record.summary.frames)
}

#[test]
fn dead_reckoning_with_perfect_sensors_ends_on_the_truth() {
    let (metres, metres_per_s, frames) = closure(&["navigation.filter=dead-reckoning"], 1, true);
    println!("{metres:.4} m, {:.4} mm/s after {frames} frames", 1e3 * metres_per_s);
    assert!(frames > 10_000, "the flight ended after {frames} frames");
    assert!(metres < 1.0 && metres_per_s < 5e-3, "{metres} m, {metres_per_s} m/s");
}

#[test]
fn a_dispersed_entry_through_winds_closes_as_well() {
    let perfect = [
        "navigation.filter=dead-reckoning",
        "navigation.position_sigma_m=1e-6",
        "navigation.velocity_sigma_mps=1e-9",
        "navigation.attitude_sigma_deg=1e-10",
        "sensors.imu.accelerometer_bias_ug=0",
        "sensors.imu.accelerometer_scale_ppm=0",
        "sensors.imu.accelerometer_misalignment_mrad=0",
        "sensors.imu.accelerometer_noise_ugprthz=0",
        "sensors.imu.gyro_bias_degph=0",
        "sensors.imu.gyro_scale_ppm=0",
        "sensors.imu.gyro_noise_degprth=0",
        "dispersions.winds=true",
    ];
    for seed in [3, 4] {
        let (metres, metres_per_s, frames) = closure(&perfect, seed, false);
        println!("seed {seed}: {metres:.4} m, {:.4} mm/s after {frames} frames", 1e3 * metres_per_s);
        assert!(frames > 10_000, "the flight ended after {frames} frames");
        assert!(metres < 1.0 && metres_per_s < 5e-3, "seed {seed}: {metres} m, {metres_per_s} m/s");
    }
}
