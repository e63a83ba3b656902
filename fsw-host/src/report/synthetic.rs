//! A made-up flight with the shapes of a real one, for the tests of the report.

use fsw_core::frames::{PlanetRelative, inertial_from_planet_relative, surface_point};
use fsw_core::link::packet::*;
use fsw_core::link::parameters::*;
use fsw_core::planet::{MARS, STANDARD_GRAVITY_MPS2, SUTTON_GRAVES_MARS};
use fsw_core::time::MissionTime;
use nalgebra::Matrix3;

use crate::bound::Least;
use crate::cost::{Cost, SlotCost};
use crate::realtime::RealTime;
use crate::record::*;

const FRAME_S: f64 = 0.02;

/// A record without a single sample.
pub fn empty() -> FlightRecord {
    FlightRecord {
        facts: facts(),
        seed: 7,
        run: 0,
        nominal: false,
        truth: Vec::new(),
        actuators: Vec::new(),
        nav: Vec::new(),
        guidance: Vec::new(),
        health: Vec::new(),
        events: Vec::new(),
        frame_cost_us: Vec::new(),
        slot_worst_ns: [0; fsw_core::probe::SLOT_COUNT],
        nees: Vec::new(),
        bound: Vec::new(),
        end: End::Interrupted,
        summary: Summary { scenario: "synthetic".into(), ..Summary::default() },
    }
}

fn facts() -> ScenarioFacts {
    ScenarioFacts {
        name: "synthetic".into(),
        planet: MARS,
        entry_longitude_rad: (-90.072f64).to_radians(),
        entry_latitude_rad: (-43.898f64).to_radians(),
        target: Target { longitude_rad: (-73.26f64).to_radians(), latitude_rad: (-41.45f64).to_radians() },
        deploy: DeployParameters {
            speed_mps: 450.0,
            window_min_speed_mps: 400.0,
            window_max_speed_mps: 500.0,
            floor_altitude_m: 4000.0,
            min_altitude_m: 5000.0,
            max_altitude_m: 13_000.0,
            min_mach: 1.1,
            max_mach: 2.2,
            min_dynamic_pressure_pa: 300.0,
            max_dynamic_pressure_pa: 900.0,
        },
        trigger: TriggerKind::Speed,
        constraints: ConstraintParameters { load_mps2: 147.0, heat_flux_wpm2: 1e6, dynamic_pressure_pa: 20_000.0 },
        navigation: NavigationMode::Ekf,
        nose_radius_m: 1.125,
        sensors: fsw_core::config::Config::DEFAULT.navigation,
        source_names: vec!["orbiter".into(), "beacon".into()],
    }
}

/// A whole flight: deployed, with every kind of telemetry.
pub fn flight() -> FlightRecord {
    let mut record = empty();
    let mut state = PlanetRelative {
        radius_m: MARS.radius_m + 125_300.0,
        longitude_rad: record.facts.entry_longitude_rad,
        latitude_rad: record.facts.entry_latitude_rad,
        speed_mps: 5505.0,
        flight_path_angle_rad: (-14.15f64).to_radians(),
        heading_rad: 85.01f64.to_radians(),
    };
    let mut bank = 0.73;
    let mut mode = Mode::Coast;
    for frame in 0..20_000u32 {
        let time_s = f64::from(frame) * FRAME_S;
        let command = command_rad(time_s);
        bank += (command - bank).clamp(-0.35 * FRAME_S, 0.35 * FRAME_S);
        let sample = advance(&mut state, bank, frame);
        let now = MissionTime::of_frame(frame);
        let next = match sample.load_g {
            _ if sample.speed_mps < 600.0 => Mode::HeadingAlignment,
            load if load > 0.2 && mode == Mode::Coast => Mode::RangeControl,
            _ => mode,
        };
        if next != mode {
            let kind = EventKind::ModeChanged { from: mode, to: next };
            record.events.push(Event { time: now, severity: Severity::Activity, kind });
            mode = next;
        }
        let before = command_rad(time_s - FRAME_S);
        if before * command < 0.0 {
            let kind = EventKind::Reversal { bank_rad: command as f32 };
            record.events.push(Event { time: now, severity: Severity::Activity, kind });
        }
        telemetry(&mut record, frame, &sample, bank, mode);
        record.truth.push(sample);
        if sample.speed_mps < 450.0 {
            break;
        }
    }
    finish(&mut record);
    record
}

/// Bank with three reversals.
fn command_rad(time_s: f64) -> f64 {
    let sign = if (95.0..128.0).contains(&time_s) || time_s > 182.0 { -1.0 } else { 1.0 };
    sign * (0.73 + 0.12 * (time_s / 17.0).sin())
}

/// One crude step of a non-rotating entry.
fn advance(s: &mut PlanetRelative, bank: f64, frame: u32) -> TruthSample {
    let altitude_m = s.radius_m - MARS.radius_m;
    let density = 0.0158 * (-altitude_m / 9354.0).exp();
    let q = 0.5 * density * s.speed_mps * s.speed_mps;
    let (drag, lift) = (q * 15.9 * 1.45 / 2804.0, 0.24 * q * 15.9 * 1.45 / 2804.0);
    let gravity = MARS.mu_m3ps2 / (s.radius_m * s.radius_m);
    let (sg, cg) = s.flight_path_angle_rad.sin_cos();
    s.radius_m += FRAME_S * s.speed_mps * sg;
    s.longitude_rad += FRAME_S * s.speed_mps * cg * s.heading_rad.sin() / (s.radius_m * s.latitude_rad.cos());
    s.latitude_rad += FRAME_S * s.speed_mps * cg * s.heading_rad.cos() / s.radius_m;
    s.heading_rad += FRAME_S
        * (lift * bank.sin() / (cg * s.speed_mps)
            + s.speed_mps / s.radius_m * cg * s.heading_rad.sin() * s.latitude_rad.tan());
    s.flight_path_angle_rad +=
        FRAME_S * (lift * bank.cos() + (s.speed_mps * s.speed_mps / s.radius_m - gravity) * cg) / s.speed_mps;
    s.speed_mps -= FRAME_S * (drag + gravity * sg);
    let time = MissionTime::of_frame(frame);
    let (r, v) = s.to_cartesian();
    let (r, v) = inertial_from_planet_relative(&r, &v, time, MARS.rotation_radps);
    TruthSample {
        time_s: time.as_s(),
        packet: Truth {
            position_m: r.to_array(),
            velocity_mps: v.to_array(),
            bank_rad: bank,
            density_kgpm3: density,
            mach: s.speed_mps / 228.0,
            dynamic_pressure_pa: q,
            ..Truth::default()
        },
        longitude_rad: s.longitude_rad,
        latitude_rad: s.latitude_rad,
        altitude_m,
        speed_mps: s.speed_mps,
        flight_path_angle_rad: s.flight_path_angle_rad,
        heading_rad: s.heading_rad,
        load_g: drag.hypot(lift) / STANDARD_GRAVITY_MPS2,
        heat_flux_wpm2: SUTTON_GRAVES_MARS * (density / 1.125).sqrt() * s.speed_mps.powi(3),
        range_to_go_m: 0.0,
    }
}

/// A number between −1 and 1 that looks random.
fn noise(seed: u32) -> f64 {
    let hash = seed.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(1_597_334_677);
    f64::from(hash % 20_001) / 10_000.0 - 1.0
}

fn telemetry(record: &mut FlightRecord, frame: u32, truth: &TruthSample, bank: f64, mode: Mode) {
    let time = MissionTime::of_frame(frame);
    let rate = (command_rad(truth.time_s) - bank).clamp(-0.35, 0.35);
    record.actuators.push(Actuator { frame, bank_rate_radps: rate, mode, ..Actuator::default() });
    let slow = if frame.is_multiple_of(997) { 140.0 } else { 0.0 };
    record
        .frame_cost_us
        .push((6.0 + 2.0 * noise(frame).abs() + if frame.is_multiple_of(5) { 9.0 } else { 0.0 } + slow) as f32);
    if frame.is_multiple_of(5) {
        let sigma = 450.0 - truth.time_s;
        let mut nav =
            NavTlm { bank_rad: bank as f32 + 0.004, log_density: 0.1, log_density_sigma: 0.05, ..NavTlm::default() };
        for i in 0..3u32 {
            let (row, k) = (i as usize, f64::from(i));
            let offset = sigma * (0.7 * (truth.time_s / 40.0 + k).sin());
            nav.position_m[row] = truth.packet.position_m[row] + offset;
            nav.velocity_mps[row] = truth.packet.velocity_mps[row] + 0.006 * offset;
            nav.covariance[row * (row + 1) / 2 + row] = (sigma * sigma) as f32;
            nav.covariance[(row + 3) * (row + 4) / 2 + row + 3] = (3e-5 * sigma * sigma) as f32;
        }
        nav.innovations[0] = Some(innovation(time, MeasurementKind::Pressure, 0, noise(frame)));
        if frame.is_multiple_of(50) {
            for source in 0..2u8 {
                let n = noise(frame * 3 + u32::from(source));
                nav.innovations[1 + usize::from(source)] = Some(innovation(time, MeasurementKind::Range, source, n));
                nav.innovations[3 + usize::from(source)] =
                    Some(innovation(time, MeasurementKind::RangeRate, source, -n));
            }
        }
        record.nees.push(NeesSample {
            time_s: truth.time_s,
            nees: Some(6.0 + 4.0 * noise(frame)),
            ..NeesSample::default()
        });
        let least = |factor: f64| Matrix3::from_diagonal_element(0.8 * factor * sigma * sigma);
        record.bound.push(Least { time_s: truth.time_s, position: least(1.0), velocity: least(3e-5) });
        record.nav.push((time, nav));
    }
    if frame.is_multiple_of(50) && mode != Mode::Coast {
        let cycle = GuidanceTlm {
            cycle: frame / 50,
            effective: time,
            bank_rad: command_rad(truth.time_s),
            predicted_downrange_error_m: 60.0 * noise(frame),
            heading_offset_m: 2.0 * truth.speed_mps * (truth.time_s / 22.0).cos(),
            heading_threshold_m: 2.0 * truth.speed_mps,
            iterations: 1,
            predictions: 2 + (frame / 50 % 3) as u8,
            evaluations: 420 + (frame / 50 % 7) as u16 * 30,
            outcome: if frame.is_multiple_of(400) { CycleOutcome::BestSoFar } else { CycleOutcome::Converged },
            margins: [0.4, 0.3, 0.5],
            ..GuidanceTlm::default()
        };
        record.guidance.push((time, cycle));
    }
}

fn innovation(time: MissionTime, kind: MeasurementKind, source: u8, normal: f64) -> Innovation {
    let verdict = if normal.abs() > 0.99 { Verdict::Gated } else { Verdict::Used };
    let value = if verdict == Verdict::Gated { 40.0 * normal } else { 2.0 * normal };
    Innovation { time, kind, source, value: value as f32, sigma: 1.0, verdict }
}

/// One slot within its budget, and one beyond.
fn cost() -> Cost {
    let line = |name: &str, max, budget| SlotCost { name: name.into(), max, budget: Some(budget) };
    Cost {
        unit: "instructions".into(),
        frame: line("whole frame", 81_234, 100_000),
        slots: vec![line("navigation", 31_000, 35_000), line("guidance", 26_000, 25_000)],
        slips: 1,
        stack_high_water_bytes: Some(5_432),
    }
}

/// Ends the flight at the parachute and fills the summary.
fn finish(record: &mut FlightRecord) {
    let Some(last) = record.truth.last().copied() else { return };
    // The made-up guidance does not steer: the target is put 1.4 km from where it ended.
    record.facts.target = Target { longitude_rad: last.longitude_rad + 4e-4, latitude_rad: last.latitude_rad + 2e-4 };
    let target = surface_point(record.facts.target.longitude_rad, record.facts.target.latitude_rad);
    let miss = fsw_core::frames::great_circle_rad(&target, &surface_point(last.longitude_rad, last.latitude_rad));
    record.end = End::Deployed;
    let milestone = |event: &str, s: &TruthSample| Milestone {
        event: event.into(),
        time_s: s.time_s,
        altitude_m: s.altitude_m,
        speed_mps: s.speed_mps,
    };
    let at = |t: f64| record.truth[((t / FRAME_S) as usize).min(record.truth.len() - 1)];
    let peak = record.truth.iter().max_by(|a, b| a.load_g.total_cmp(&b.load_g)).copied().unwrap_or_default();
    record.summary = Summary {
        success: true,
        outcome: "deployed".into(),
        miss_m: Some(miss * MARS.radius_m),
        downrange_error_m: Some(-900.0),
        crossrange_error_m: Some(800.0),
        timeline: vec![
            milestone("Entry interface", &at(0.0)),
            milestone("Range control", &at(46.0)),
            milestone("Peak load", &peak),
            milestone("Bank reversal", &at(128.0)),
            milestone("Parachute", &last),
        ],
        deploy: Some(DeployState {
            time_s: last.time_s,
            altitude_m: last.altitude_m,
            speed_mps: last.speed_mps,
            mach: last.packet.mach,
            dynamic_pressure_pa: last.packet.dynamic_pressure_pa,
            longitude_deg: last.longitude_rad.to_degrees(),
            latitude_deg: last.latitude_rad.to_degrees(),
        }),
        peak: Peak { load_g: peak.load_g, dynamic_pressure_pa: 14_000.0, heat_flux_wpm2: 700e3 },
        reversals: 3,
        corrector: Corrector { max_iterations: 3, mean_iterations: 1.2, max_integrations: 600, bound: 2400 },
        output_hash: "0123456789abcdef".repeat(4),
        computer: Computer {
            place: "qemu:m7".into(),
            build_id: Some("00000000deadbeef".into()),
            image: Some("flight".into()),
            image_sha256: Some("89ab".repeat(16)),
        },
        cost: Some(cost()),
        realtime: Some(RealTime { frames: 13_000, misses: 2, ..RealTime::default() }),
        frames: record.actuators.len() as u32,
        wall_s: 0.8,
        ..record.summary.clone()
    };
}
