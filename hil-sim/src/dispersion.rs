//! Makes one flight out of a scenario: draws every dispersed quantity, sensor error and error of initial knowledge.
//!
//! Each quantity has a stream of its own, keyed by (seed, run, name): the same run of the same seed is always the same, and
//! turning one dispersion on, off or to another width never changes what another draws. A normal draw is its standard
//! deviation times a fixed number, so a width only scales it.
//!
//! A nominal flight draws nothing at all: no dispersions, no sensor errors, no white noise, exact initial knowledge. Limits
//! of the sensors (range, blackout, elevation) and the scenario's own `density_scale` and winds by table remain.

use fsw_core::frames::{Body, Inertial, PlanetFixed, PlanetRelative, Rot, Vec3};
use fsw_core::planet::{Planet, STANDARD_GRAVITY_MPS2};
use fsw_core::units::rad;

use crate::actuator::{Bank, Limits};
use crate::aero::{self, Coefficients, MachTable, Vehicle};
use crate::atmosphere::{self, Atmosphere, DensityDispersion, Perturbation, Profile, Table};
use crate::case::{Case, NoiseKey, exact_knowledge};
use crate::dynamics::{Motion, World};
use crate::orbiter::{Elements, Source};
use crate::scenario::{self, Dispersion, Scenario};
use crate::sensors::{Blackout, ImuErrors, PressureErrors, RadioErrors};
use crate::wind::{self, Wind};

/// Draws by name and remembers what it drew.
struct Draw {
    key: NoiseKey,
    nominal: bool,
    applied: Vec<(&'static str, f64)>,
}

impl Draw {
    /// A normal of standard deviation `sigma`.
    fn normal(&mut self, name: &'static str, sigma: f64) -> f64 {
        let value = if self.nominal { 0.0 } else { sigma * self.key.stream(name).normal() };
        self.applied.push((name, value));
        value
    }

    fn normal3(&mut self, names: [&'static str; 3], sigma: f64) -> [f64; 3] {
        names.map(|name| self.normal(name, sigma))
    }

    /// A quantity of `[dispersions]`; zero when it is not dispersed.
    fn dispersed(&mut self, name: &'static str, dispersion: Dispersion) -> f64 {
        match dispersion {
            Dispersion::Normal { three_sigma } => self.normal(name, three_sigma / 3.0),
            Dispersion::Uniform { bounds: [low, high] } if !self.nominal => {
                let value = low + (high - low) * self.key.stream(name).uniform();
                self.applied.push((name, value));
                value
            }
            Dispersion::Uniform { .. } | Dispersion::None => {
                self.applied.push((name, 0.0));
                0.0
            }
        }
    }
}

/// The values of `[dispersions]`, by name.
struct Values(Vec<(&'static str, f64)>);

impl Values {
    fn get(&self, name: &str) -> f64 {
        let found = self.0.iter().find(|(n, _)| *n == name).map(|(_, value)| *value);
        debug_assert!(found.is_some(), "no dispersion is called {name}");
        found.unwrap_or(0.0)
    }
}

impl Case {
    /// Run `run` of seed `seed` of a scenario, or its nominal flight.
    ///
    /// The scenario is taken as checked (see [`Scenario`]): a table that is none is left out.
    #[must_use]
    pub fn draw(scenario: &Scenario, seed: u64, run: u64, nominal: bool) -> Self {
        let key = NoiseKey { seed, run };
        let mut draw = Draw { key, nominal, applied: Vec::new() };
        let values = scenario.dispersions.all().into_iter().map(|(name, d)| (name, draw.dispersed(name, d)));
        let values = Values(values.collect());
        let planet = scenario.planet.si();
        let world = World {
            planet,
            atmosphere: air(scenario, &planet, &values, &draw),
            wind: winds(scenario, &values),
            vehicle: vehicle(&scenario.vehicle, &values),
        };
        let entry = Motion::at_epoch(&entry(scenario, &planet, &values), &planet);
        let initial_bank_rad = rad(scenario.control.initial_bank_deg);
        let mut case = Self {
            actuator: actuator(&scenario.control),
            bank: Bank { angle_rad: initial_bank_rad, ..Bank::default() },
            imu: imu(&scenario.sensors.imu, &mut draw),
            pressure: pressure(&scenario.sensors.pressure, &mut draw),
            pressure_rate_hz: if scenario.sensors.pressure.enabled { scenario.sensors.pressure.rate_hz } else { 0.0 },
            radio: radio(&scenario.sensors.radio, nominal),
            radio_rate_hz: scenario.sensors.radio.rate_hz,
            sources: sources(scenario, &planet),
            knowledge: exact_knowledge(&world, &entry, initial_bank_rad),
            noise: key,
            applied: Vec::new(),
            world,
            entry,
        };
        misinform(&mut case, &scenario.navigation, &mut draw);
        case.applied = draw.applied;
        case
    }
}

/// The entry state: the point moves along and across the track with its velocity carried along, then altitude, speed,
/// path angle and heading are added.
fn entry(scenario: &Scenario, planet: &Planet, values: &Values) -> PlanetRelative {
    let nominal = scenario.entry.planet_relative(planet);
    let (r_p, v_p) = nominal.to_cartesian();
    let shift = track_shift(&r_p, &v_p, values.get("along_track_km") * 1e3, values.get("cross_track_km") * 1e3);
    let moved = PlanetRelative::from_cartesian(&shift.apply(&r_p), &shift.apply(&v_p));
    PlanetRelative {
        radius_m: nominal.radius_m + values.get("altitude_km") * 1e3,
        speed_mps: nominal.speed_mps + values.get("speed_mps"),
        flight_path_angle_rad: nominal.flight_path_angle_rad + rad(values.get("flight_path_angle_deg")),
        heading_rad: moved.heading_rad + rad(values.get("heading_deg")),
        ..moved
    }
}

/// The turn about the planet's centre that moves a point ahead along its track and to the right of it, m on its own sphere.
pub(crate) fn track_shift(
    r_p: &Vec3<PlanetFixed>,
    v_p: &Vec3<PlanetFixed>,
    along_m: f64,
    right_m: f64,
) -> Rot<PlanetFixed, PlanetFixed> {
    let radius = r_p.norm();
    match (r_p.unit(), r_p.cross(v_p).unit()) {
        // `left` is the pole of the track: a turn about it moves the point ahead; a turn about "ahead" moves it right.
        (Some(up), Some(left)) => {
            let ahead = left.cross(&up);
            let turn = left * (along_m / radius) + ahead * (right_m / radius);
            Rot::from_rotation_vector(turn.components())
        }
        _ => Rot::identity(),
    }
}

fn air(scenario: &Scenario, planet: &Planet, values: &Values, draw: &Draw) -> Atmosphere {
    let a = &scenario.atmosphere;
    let law = a.parameters(planet);
    let rows: Vec<atmosphere::Row> = a
        .rows
        .iter()
        .flatten()
        .map(|row| atmosphere::Row {
            altitude_m: row.altitude_km * 1e3,
            density_kgpm3: row.density_kgpm3,
            temperature_k: row.temperature_k.unwrap_or(law.temperature_k),
        })
        .collect();
    let table = Table::new(&rows).ok().filter(|_| a.kind == scenario::AtmosphereKind::Table);
    let exponential = Profile::Exponential {
        reference_density_kgpm3: law.reference_density_kgpm3,
        reference_altitude_m: law.reference_altitude_m,
        scale_height_m: law.scale_height_m,
        temperature_k: law.temperature_k,
    };
    let random = a.perturbation;
    let perturbation = (random.sigma > 0.0 && !draw.nominal)
        .then(|| Perturbation::draw(random.sigma, random.correlation_km * 1e3, &mut draw.key.stream("perturbation")));
    Atmosphere {
        profile: table.map_or(exponential, Profile::Table),
        density_scale: a.density_scale,
        dispersion: DensityDispersion {
            bias: values.get("density_bias"),
            slope: values.get("density_slope"),
            wave_amplitude: values.get("density_wave_amplitude"),
            wave_length_m: values.get("density_wave_length_km") * 1e3,
            wave_phase_rad: rad(values.get("density_wave_phase_deg")),
            perturbation,
        },
        gas_constant_jpkgk: law.gas_constant_jpkgk,
        heat_ratio: law.heat_ratio,
    }
}

/// Winds of the atmosphere's table, and on top of them the dispersed ones when they are drawn.
fn winds(scenario: &Scenario, values: &Values) -> Wind {
    let table: Vec<wind::Row> = match (scenario.atmosphere.kind, &scenario.atmosphere.rows) {
        (scenario::AtmosphereKind::Table, Some(rows)) => rows
            .iter()
            .map(|r| wind::Row {
                altitude_m: r.altitude_km * 1e3,
                east_mps: r.wind_east_mps,
                north_mps: r.wind_north_mps,
            })
            .collect(),
        _ => Vec::new(),
    };
    let node = |km: f64, east: &str, north: &str| wind::Row {
        altitude_m: km * 1e3,
        east_mps: values.get(east),
        north_mps: values.get(north),
    };
    let drawn = [
        node(0.0, "wind_east_0km_mps", "wind_north_0km_mps"),
        node(15.0, "wind_east_15km_mps", "wind_north_15km_mps"),
        node(30.0, "wind_east_30km_mps", "wind_north_30km_mps"),
        node(60.0, "wind_east_60km_mps", "wind_north_60km_mps"),
    ];
    let blows = |rows: &[wind::Row]| rows.iter().any(|r| r.east_mps != 0.0 || r.north_mps != 0.0);
    [&table[..], &drawn[..]].into_iter().filter(|rows| blows(rows)).fold(Wind::default(), Wind::with)
}

fn vehicle(nominal: &scenario::Vehicle, values: &Values) -> Vehicle {
    let rows: Vec<aero::Row> = nominal
        .aero_table
        .iter()
        .flatten()
        .map(|row| aero::Row { mach: row.mach, drag: row.drag_coefficient, lift: row.lift_coefficient })
        .collect();
    let drag = nominal.drag_coefficient;
    let constant = Coefficients::Constant { drag, lift: drag * nominal.lift_to_drag };
    Vehicle {
        mass_kg: nominal.mass_kg * (1.0 + values.get("mass")),
        reference_area_m2: nominal.reference_area_m2,
        nose_radius_m: nominal.nose_radius_m,
        trim_angle_of_attack_rad: rad(nominal.trim_angle_of_attack_deg),
        coefficients: MachTable::new(&rows).map_or(constant, Coefficients::ByMach),
        drag_factor: 1.0 + values.get("drag_coefficient"),
        lift_factor: 1.0 + values.get("lift_coefficient"),
    }
}

fn actuator(control: &scenario::Control) -> Limits {
    Limits {
        max_rate_radps: rad(control.max_rate_degps),
        max_accel_radps2: rad(control.max_accel_degps2),
        lag_s: control.lag_s,
    }
}

fn imu(unit: &scenario::Imu, draw: &mut Draw) -> ImuErrors {
    let bias_ug = draw.normal3(ACCELEROMETER_BIAS, unit.accelerometer_bias_ug);
    let scale_ppm = draw.normal3(ACCELEROMETER_SCALE, unit.accelerometer_scale_ppm);
    let misalignment_mrad = draw.normal3(ACCELEROMETER_MISALIGNMENT, unit.accelerometer_misalignment_mrad);
    let gyro_degph = draw.normal3(GYRO_BIAS, unit.gyro_bias_degph);
    let gyro_ppm = draw.normal3(GYRO_SCALE, unit.gyro_scale_ppm);
    let noise = if draw.nominal { 0.0 } else { 1.0 };
    ImuErrors {
        accelerometer_bias_mps2: bias_ug.map(|ug| ug * 1e-6 * STANDARD_GRAVITY_MPS2),
        accelerometer_scale: scale_ppm.map(|ppm| ppm * 1e-6),
        accelerometer_misalignment_rad: misalignment_mrad.map(|mrad| mrad * 1e-3),
        accelerometer_noise: noise * unit.accelerometer_noise_ugprthz * 1e-6 * STANDARD_GRAVITY_MPS2,
        accelerometer_limit_mps2: unit.accelerometer_range_g * STANDARD_GRAVITY_MPS2,
        gyro_bias_radps: gyro_degph.map(|degph| rad(degph) / 3600.0),
        gyro_scale: gyro_ppm.map(|ppm| ppm * 1e-6),
        // One √h is 60 √s.
        gyro_noise: noise * rad(unit.gyro_noise_degprth) / 60.0,
        gyro_limit_radps: rad(unit.gyro_range_degps),
    }
}

const ACCELEROMETER_BIAS: [&str; 3] = ["accelerometer_bias_x_ug", "accelerometer_bias_y_ug", "accelerometer_bias_z_ug"];
const ACCELEROMETER_SCALE: [&str; 3] =
    ["accelerometer_scale_x_ppm", "accelerometer_scale_y_ppm", "accelerometer_scale_z_ppm"];
const ACCELEROMETER_MISALIGNMENT: [&str; 3] =
    ["accelerometer_misalignment_x_mrad", "accelerometer_misalignment_y_mrad", "accelerometer_misalignment_z_mrad"];
const GYRO_BIAS: [&str; 3] = ["gyro_bias_x_degph", "gyro_bias_y_degph", "gyro_bias_z_degph"];
const GYRO_SCALE: [&str; 3] = ["gyro_scale_x_ppm", "gyro_scale_y_ppm", "gyro_scale_z_ppm"];

fn pressure(port: &scenario::Pressure, draw: &mut Draw) -> PressureErrors {
    PressureErrors {
        scale: draw.normal("pressure_scale", port.scale_sigma),
        offset_pa: draw.normal("pressure_offset_pa", port.offset_sigma_pa),
        noise: if draw.nominal { 0.0 } else { port.noise_sigma },
    }
}

fn radio(radio: &scenario::Radio, nominal: bool) -> RadioErrors {
    let noise = if nominal { 0.0 } else { 1.0 };
    RadioErrors {
        range_noise_m: noise * radio.range_noise_m,
        range_rate_noise_mps: noise * radio.range_rate_noise_mps,
        min_elevation_rad: rad(radio.min_elevation_deg),
        blackout: Some(Blackout {
            above_speed_mps: radio.blackout.above_speed_mps,
            below_altitude_m: radio.blackout.below_altitude_km * 1e3,
        }),
    }
}

/// Orbiters take the first slots, beacons those after them.
fn sources(scenario: &Scenario, planet: &Planet) -> Vec<Source> {
    let orbiters = scenario.orbiter.iter().map(|o| {
        let elements = Elements {
            semi_major_axis_m: o.semi_major_axis_km * 1e3,
            eccentricity: o.eccentricity,
            inclination_rad: rad(o.inclination_deg),
            raan_rad: rad(o.raan_deg),
            arg_periapsis_rad: rad(o.arg_periapsis_deg),
            true_anomaly_rad: rad(o.true_anomaly_deg),
        };
        Source::Orbiter(elements.state(planet))
    });
    let beacons = scenario.beacon.iter().map(|b| Source::Beacon {
        longitude_rad: rad(b.longitude_deg),
        latitude_rad: rad(b.latitude_deg),
        altitude_m: b.altitude_km * 1e3,
    });
    orbiters.chain(beacons).collect()
}

/// Gives the navigator its errors of knowledge, added to the dispersed truth, and the deviations it is told.
fn misinform(case: &mut Case, navigation: &scenario::Navigation, draw: &mut Draw) {
    let position = draw.normal3(["knowledge_x_m", "knowledge_y_m", "knowledge_z_m"], navigation.position_sigma_m);
    let velocity =
        draw.normal3(["knowledge_vx_mps", "knowledge_vy_mps", "knowledge_vz_mps"], navigation.velocity_sigma_mps);
    let tilt = draw.normal3(
        ["knowledge_tilt_x_deg", "knowledge_tilt_y_deg", "knowledge_tilt_z_deg"],
        navigation.attitude_sigma_deg,
    );
    let k = &mut case.knowledge;
    for axis in 0..3 {
        k.position_m[axis] += position[axis];
        k.velocity_mps[axis] += velocity[axis];
    }
    // A small turn in inertial axes on top of the true attitude.
    let error =
        Rot::<Inertial, Inertial>::from_rotation_vector(Vec3::<Inertial>::from_array(tilt.map(rad)).components());
    let true_attitude = Rot::<Body, Inertial>::from_quaternion(k.attitude).unwrap_or_else(Rot::identity);
    k.attitude = true_attitude.then(&error).quaternion();
    k.position_sigma_m = navigation.position_sigma_m;
    k.velocity_sigma_mps = navigation.velocity_sigma_mps;
    k.attitude_sigma_rad = rad(navigation.attitude_sigma_deg);
}

#[cfg(test)]
mod tests;
