//! The default parameters: the default entry (P4 Table 1) on rotating, oblate Mars with the default sensors.
//!
//! They let the flight software run before anything is loaded; a session loads every block anyway.

use super::Config;
use crate::link::parameters::{
    AtmosphereParameters, ConstraintParameters, ControlParameters, DeployParameters, EstimatorParameters, GuidanceMode,
    GuidanceParameters, InitialKnowledge, Modes, NavigationMode, NavigationParameters, RadioSource, Target,
    TriggerKind, VehicleParameters,
};
use crate::planet::{MARS, MARS_GAS_CONSTANT_JPKGK, MARS_HEAT_RATIO, STANDARD_GRAVITY_MPS2};
use crate::units::rad;

/// Density scale height of the default atmosphere, m.
const SCALE_HEIGHT_M: f64 = 9_354.0;
/// Gravity at the reference radius, m/s².
const SURFACE_GRAVITY_MPS2: f64 = MARS.mu_m3ps2 / (MARS.radius_m * MARS.radius_m);
/// One millionth of standard gravity, m/s².
const MICRO_G_MPS2: f64 = 1e-6 * STANDARD_GRAVITY_MPS2;
/// Seconds per hour.
const HOUR_S: f64 = 3_600.0;
/// √(seconds per hour).
const ROOT_HOUR_S: f64 = 60.0;

impl Config {
    /// The default entry.
    pub const DEFAULT: Self = {
        let mut config = Self::DORMANT;
        config.wake();
        config
    };

    /// Becomes [`Config::DEFAULT`] from [`Config::DORMANT`], block by block: what is zero in both is left alone.
    pub(crate) const fn wake(&mut self) {
        self.modes = MODES;
        self.planet = MARS;
        self.vehicle = VEHICLE;
        self.atmosphere = ATMOSPHERE;
        self.target = TARGET;
        self.deploy = DEPLOY;
        self.sources = [ORBITER, RadioSource::None, RadioSource::None, RadioSource::None];
        self.initial_knowledge = INITIAL_KNOWLEDGE;
        self.navigation = NAVIGATION;
        self.guidance = GUIDANCE;
        self.constraints = CONSTRAINTS;
        self.control = CONTROL;
        self.estimators = ESTIMATORS;
    }
}

/// Filter, best guidance and the trigger of P4.
const MODES: Modes =
    Modes { navigation: NavigationMode::Ekf, guidance: GuidanceMode::Aeroshell, trigger: TriggerKind::Speed };

/// P4's capsule: ballistic coefficient 121.6 kg/m². Nose radius of the 4.5 m, 70° sphere-cone family.
const VEHICLE: VehicleParameters = VehicleParameters {
    mass_kg: 2_804.0,
    reference_area_m2: 15.9,
    nose_radius_m: 1.125,
    drag_coefficient: 1.45,
    lift_to_drag: 0.24,
    trim_angle_of_attack_rad: rad(-16.0),
};

const TARGET: Target = Target { longitude_rad: rad(-73.260), latitude_rad: rad(-41.450) };

/// Exponential air; the temperature is the hydrostatic one, g·H/R.
const ATMOSPHERE: AtmosphereParameters = AtmosphereParameters {
    reference_density_kgpm3: 0.0158,
    reference_altitude_m: 0.0,
    scale_height_m: SCALE_HEIGHT_M,
    temperature_k: SURFACE_GRAVITY_MPS2 * SCALE_HEIGHT_M / MARS_GAS_CONSTANT_JPKGK,
    gas_constant_jpkgk: MARS_GAS_CONSTANT_JPKGK,
    heat_ratio: MARS_HEAT_RATIO,
};

const DEPLOY: DeployParameters = DeployParameters {
    speed_mps: 450.0,
    window_min_speed_mps: 400.0,
    window_max_speed_mps: 500.0,
    floor_altitude_m: 4_000.0,
    min_altitude_m: 5_000.0,
    max_altitude_m: 13_000.0,
    min_mach: 1.1,
    max_mach: 2.2,
    min_dynamic_pressure_pa: 300.0,
    max_dynamic_pressure_pa: 900.0,
};

/// Circular orbit of 3700 km, inclination 80.4°, node 96.8°, argument of latitude −145.9° at t = 0.
const ORBITER: RadioSource = RadioSource::Orbiter {
    position_m: [706_274.454_756, -3_001_310.232_447, -2_045_314.959_406],
    velocity_mps: [240.678_586_798, 1_949.638_716_491, -2_777.804_692_420],
};

/// The nominal entry state: 90.072° W, 43.898° S, 125.3 km, 5505 m/s planet-relative, flight path −14.15°, heading
/// 85.01°, trimmed at the initial bank.
const INITIAL_KNOWLEDGE: InitialKnowledge = InitialKnowledge {
    position_m: [-3_189.628_712, -2_538_224.544_856, -2_442_419.340_769],
    velocity_mps: [5_498.466_315_195, 640.872_373_009, 1_267.686_274_737],
    attitude: [0.684_652_730_948, -0.691_992_499_722, -0.221_524_528_322, 0.057_653_288_594],
    position_sigma_m: 500.0,
    velocity_sigma_mps: 0.3,
    attitude_sigma_rad: rad(0.03),
};

const NAVIGATION: NavigationParameters = NavigationParameters {
    accelerometer_bias_sigma_mps2: 100.0 * MICRO_G_MPS2,
    accelerometer_scale_sigma: 150e-6,
    accelerometer_misalignment_sigma_rad: 0.2e-3,
    accelerometer_noise: 50.0 * MICRO_G_MPS2,
    gyro_bias_sigma_radps: rad(1.0) / HOUR_S,
    gyro_scale_sigma: 100e-6,
    gyro_noise: rad(0.07) / ROOT_HOUR_S,
    log_density_sigma: 0.08,
    log_density_length_m: 150e3,
    pressure_scale_sigma: 0.02,
    pressure_offset_sigma_pa: 15.0,
    pressure_noise: 0.005,
    pressure_min_dynamic_pa: 850.0,
    range_noise_m: 100.0,
    range_rate_noise_mps: 0.1,
    min_elevation_rad: rad(5.0),
    gate_sigma: 5.0,
};

/// What an entry vehicle's model is wrong by; P1's, P2's and P3's own settings where they have any (E9 to E11 of the equations).
const ESTIMATORS: EstimatorParameters = EstimatorParameters {
    unmodelled_share: 0.08,
    calibrated_share: 0.02,
    spacing_share: 0.015,
    modelled_share: 0.004,
    error_correlation_s: 20.0,
    lift_sigma: 0.10,
    input_growth_mps2: 0.3,
    calibration_start_s: 20.0,
    calibration_s: 1.0,
    calibration_share: 0.3,
    calibration_fade_s: 10.0,
    gating_rate: 0.01,
    switching_stay: 0.999,
    weight_floor: 1e-3,
    rank_threshold: 5e-3,
    free_threshold: 2e-5,
};

const GUIDANCE: GuidanceParameters = GuidanceParameters {
    predictor_step_s: 4.0,
    prediction_horizon_s: 600.0,
    tolerance_m: 100.0,
    bank_increment_rad: rad(30.0),
    max_iterations: 2,
    min_bank_rad: rad(10.0),
    max_bank_rad: rad(130.0),
    threshold_constant_m: 0.0,
    threshold_linear_s: 1.0,
    threshold_quadratic_s2pm: 1e-3,
    range_control_load_mps2: 0.2 * STANDARD_GRAVITY_MPS2,
    alignment_speed_mps: 600.0,
    alignment_gain_ps: 0.05,
    alignment_max_bank_rad: rad(60.0),
    alignment_freeze_range_m: 3_000.0,
    late_alignment_speed_mps: 600.0,
    range_alignment_speed_mps: 1_000.0,
    reversal_share: 0.25,
};

/// Above the nominal peaks of about 9 g, 0.5 MW/m² and 10 kPa with margin for steep and dense entries.
const CONSTRAINTS: ConstraintParameters =
    ConstraintParameters { load_mps2: 15.0 * STANDARD_GRAVITY_MPS2, heat_flux_wpm2: 1.0e6, dynamic_pressure_pa: 18e3 };

/// The target lies to the left of the entry heading, so the first bank is to the left.
const CONTROL: ControlParameters = ControlParameters {
    initial_bank_rad: rad(-42.0),
    max_rate_radps: rad(20.0),
    max_accel_radps2: rad(5.0),
    lag_s: 0.05,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{
        Body, Inertial, PlanetFixed, PlanetRelative, Rot, Vec3, bank_from_attitude, inertial_from_planet_relative,
    };
    use crate::link::parameters::RadioSource;
    use crate::math::fun::{cos, sin, sqrt};
    use crate::time::MissionTime;

    fn nominal_entry() -> (Vec3<PlanetFixed>, Vec3<PlanetFixed>) {
        PlanetRelative {
            radius_m: MARS.radius_m + 125_300.0,
            longitude_rad: rad(-90.072),
            latitude_rad: rad(-43.898),
            speed_mps: 5_505.0,
            flight_path_angle_rad: rad(-14.15),
            heading_rad: rad(85.01),
        }
        .to_cartesian()
    }

    /// Attitude at the trim angle of attack about the planet-relative velocity.
    fn trimmed_attitude(r_p: &Vec3<PlanetFixed>, v_p: &Vec3<PlanetFixed>, bank_rad: f64) -> Rot<Body, PlanetFixed> {
        let alpha = VEHICLE.trim_angle_of_attack_rad;
        let forward = v_p.unit().unwrap();
        let up = (*r_p - forward * forward.dot(r_p)).unit().unwrap();
        let lift = up * cos(bank_rad) + forward.cross(&up) * sin(bank_rad);
        let x = forward * cos(alpha) + lift * sin(alpha);
        let z = forward * sin(alpha) - lift * cos(alpha);
        Rot::from_columns(&x, &z.cross(&x), &z).unwrap()
    }

    fn assert_near<const N: usize>(got: [f64; N], expected: [f64; N], tolerance: f64) {
        for (g, e) in got.iter().zip(expected) {
            assert!((g - e).abs() <= tolerance, "got {got:?}\nexpected {expected:?}");
        }
    }

    #[test]
    fn the_default_knowledge_is_the_nominal_entry_state() {
        let (r_p, v_p) = nominal_entry();
        let (r_i, v_i) = inertial_from_planet_relative(&r_p, &v_p, MissionTime::ZERO, MARS.rotation_radps);
        // The constants are rounded to a micrometre and a nanometre per second.
        assert_near(INITIAL_KNOWLEDGE.position_m, r_i.to_array(), 1e-6);
        assert_near(INITIAL_KNOWLEDGE.velocity_mps, v_i.to_array(), 1e-9);
    }

    #[test]
    fn the_default_attitude_is_trimmed_at_the_initial_bank() {
        let (r_p, v_p) = nominal_entry();
        let attitude = trimmed_attitude(&r_p, &v_p, CONTROL.initial_bank_rad);
        let bank = bank_from_attitude(&attitude, &r_p, &v_p).unwrap();
        assert!((bank - CONTROL.initial_bank_rad).abs() < 1e-12);
        // At t = 0 the planet-fixed axes are the inertial ones. Twelve digits are written down.
        assert_near(INITIAL_KNOWLEDGE.attitude, attitude.quaternion(), 1e-12);
        let held = Rot::<Body, Inertial>::from_quaternion(INITIAL_KNOWLEDGE.attitude);
        assert!(held.is_some());
    }

    #[test]
    fn the_default_orbiter_flies_the_orbit_its_elements_say() {
        let (radius, inclination, node, latitude_argument) = (3.7e6, rad(80.4), rad(96.8), rad(-145.9));
        let to_node = [cos(node), sin(node), 0.0];
        let across = [-sin(node) * cos(inclination), cos(node) * cos(inclination), sin(inclination)];
        let (s, c) = (sin(latitude_argument), cos(latitude_argument));
        let speed = sqrt(MARS.mu_m3ps2 / radius);
        let position = core::array::from_fn(|k| radius * (c * to_node[k] + s * across[k]));
        let velocity = core::array::from_fn(|k| speed * (c * across[k] - s * to_node[k]));
        let RadioSource::Orbiter { position_m, velocity_mps } = ORBITER else { panic!("not an orbiter") };
        assert_near(position_m, position, 1e-6);
        assert_near(velocity_mps, velocity, 1e-9);
    }

    #[test]
    fn the_default_air_is_hydrostatic() {
        // g·H/R of Mars at the reference radius, worked out by hand: 3.71097 · 9354 / 188.92.
        assert!((ATMOSPHERE.temperature_k - 183.74).abs() < 0.01, "{}", ATMOSPHERE.temperature_k);
    }
}
