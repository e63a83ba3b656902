use super::*;
use crate::aero::Coefficients;
use crate::atmosphere::{DensityDispersion, Profile};
use crate::wind;
use fsw_core::planet::MARS;
use fsw_core::units::rad;

/// The default entry: model C of the specification.
fn world() -> World {
    World {
        planet: MARS,
        atmosphere: Atmosphere {
            profile: Profile::Exponential {
                reference_density_kgpm3: 0.0158,
                reference_altitude_m: 0.0,
                scale_height_m: 9354.0,
                temperature_k: 184.0,
            },
            density_scale: 1.0,
            dispersion: DensityDispersion::default(),
            gas_constant_jpkgk: 188.92,
            heat_ratio: 1.3,
        },
        wind: Wind::default(),
        vehicle: Vehicle {
            mass_kg: 2804.0,
            reference_area_m2: 15.9,
            nose_radius_m: 1.125,
            trim_angle_of_attack_rad: rad(-16.0),
            coefficients: Coefficients::Constant { drag: 1.45, lift: 0.348 },
            drag_factor: 1.0,
            lift_factor: 1.0,
        },
    }
}

fn entry() -> Motion {
    let state = PlanetRelative {
        radius_m: MARS.radius_m + 125.3e3,
        longitude_rad: rad(-90.072),
        latitude_rad: rad(-43.898),
        speed_mps: 5505.0,
        flight_path_angle_rad: rad(-14.15),
        heading_rad: rad(85.01),
    };
    Motion::at_epoch(&state, &MARS)
}

fn fly(world: &World, step_s: f64, seconds: f64, bank: impl Fn(f64) -> f64) -> Motion {
    (0..(seconds / step_s).round() as u32).fold(entry(), |motion, k| {
        let t0 = f64::from(k) * step_s;
        world.step(&motion, step_s, |t| bank(t0 + t))
    })
}

#[test]
fn without_air_energy_and_axial_angular_momentum_are_kept() {
    let mut world = world();
    world.atmosphere.density_scale = 0.0;
    let energy = |m: &Motion| {
        let (r2, z) = (m.r_i.dot(&m.r_i), m.r_i.z());
        let oblate = 0.5 * MARS.j2 * MARS.radius_m * MARS.radius_m / r2 * (3.0 * z * z / r2 - 1.0);
        0.5 * m.v_i.dot(&m.v_i) - MARS.mu_m3ps2 / r2.sqrt() * (1.0 - oblate)
    };
    let momentum = |m: &Motion| m.r_i.cross(&m.v_i).z();
    let (start, end) = (entry(), fly(&world, 0.02, 100.0, |_| 0.7));
    assert!((energy(&end) / energy(&start) - 1.0).abs() < 1e-12);
    assert!((momentum(&end) / momentum(&start) - 1.0).abs() < 1e-12);
    assert_eq!((end.drag_sum_mps, end.lift_sum_mps), (0.0, 0.0));
}

#[test]
fn gravity_is_the_gradient_of_its_potential() {
    let potential = |r: &Vec3<Inertial>| {
        let (r2, z) = (r.dot(r), r.z());
        let oblate = 0.5 * MARS.j2 * MARS.radius_m * MARS.radius_m / r2 * (3.0 * z * z / r2 - 1.0);
        MARS.mu_m3ps2 / r2.sqrt() * (1.0 - oblate)
    };
    let r = Vec3::<Inertial>::new(1.9e6, -2.1e6, 1.7e6);
    let g = gravity(&r, &MARS).to_array();
    for (axis, g) in g.into_iter().enumerate() {
        let mut h = [0.0; 3];
        h[axis] = 100.0;
        let h = Vec3::from_array(h);
        // Central difference over ±100 m: truncation 1e-9 relative, rounding 1e-11 of 1e7 over 200 m, 1e-6 m/s².
        assert!((((potential(&(r + h)) - potential(&(r - h))) / 200.0) - g).abs() < 1e-6);
    }
}

#[test]
fn the_step_of_a_minor_frame_has_converged_below_a_millimetre() {
    let mut rough = world();
    rough.atmosphere.dispersion = DensityDispersion {
        wave_amplitude: 0.04,
        wave_length_m: 10e3,
        perturbation: Some(crate::atmosphere::Perturbation::draw(
            0.03,
            2e3,
            &mut crate::noise::Stream::new(1, 1, "perturbation"),
        )),
        ..DensityDispersion::default()
    };
    let reversals = |t: f64| rad(45.0) * libm::sin(t / 8.0);
    for world in [world(), rough] {
        let (coarse, fine) = (fly(&world, 0.02, 260.0, reversals), fly(&world, 0.005, 260.0, reversals));
        let (dr, dv) = ((coarse.r_i - fine.r_i).norm(), (coarse.v_i - fine.v_i).norm());
        assert!(dr < 1e-3 && dv < 1e-5, "{dr} m, {dv} m/s");
        assert!((coarse.drag_sum_mps - fine.drag_sum_mps).abs() < 1e-5);
    }
}

#[test]
fn wind_changes_what_is_relative_to_the_air_and_nothing_else() {
    let still = world();
    let mut windy = world();
    windy.wind = Wind::default().with(&[wind::Row { altitude_m: 0.0, east_mps: 60.0, north_mps: -25.0 }]);
    let m = entry();
    let (a, b) = (still.flow(&m.r_i, &m.v_i), windy.flow(&m.r_i, &m.v_i));
    assert_eq!((a.altitude_m, a.density_kgpm3), (b.altitude_m, b.density_kgpm3));
    let blown = a.v_air_i - b.v_air_i;
    let up = m.r_i.unit().unwrap();
    assert!((blown.norm() - 60f64.hypot(25.0)).abs() < 1e-9 && blown.dot(&up).abs() < 1e-9);
    // At longitude −90° (inertial −y at t = 0) east is +x.
    assert!((blown.x() - 60.0 * rad(0.072).cos()).abs() < 0.2);
    assert_eq!(m.planet_relative(0.0, &still.planet), m.planet_relative(0.0, &windy.planet));
}

#[test]
fn in_air_at_rest_with_the_planet_a_fall_from_rest_has_no_drag() {
    let world = world();
    let r = Vec3::<Inertial>::new(2.0e6, -2.2e6, -1.8e6);
    let flow = world.flow(&r, &surface_velocity(&r, &MARS));
    assert!(flow.drag_mps2 == 0.0 && flow.v_air_i.norm() == 0.0);
}

#[test]
fn a_right_bank_turns_the_heading_clockwise() {
    let heading = |bank: f64| fly(&world(), 0.02, 150.0, |_| bank).planet_relative(150.0, &MARS).heading_rad;
    assert!(heading(0.7) > heading(0.0) && heading(0.0) > heading(-0.7));
}
