//! Settings that are each in range but contradict each other.

use fsw_core::config::limits::{ATMOSPHERE, MAX_HORIZON_STEPS, SURFACE_GRAVITY_MPS2};
use fsw_core::link::packet::MAX_SOURCES;
use fsw_core::link::parameters::{MAX_AERO_ROWS, MAX_ATMOSPHERE_ROWS};

use super::ranges::range_of;
use super::{AeroRow, AtmosphereKind, AtmosphereRow, Dispersion, Entry, Fault, FaultKind, FaultTarget, Scenario};

/// What is wrong: the field and the sentence.
type Finding = (Vec<String>, String);

/// The first contradiction, if any.
pub fn consistent(s: &Scenario) -> Result<(), Finding> {
    for (path, [low, high]) in [
        ("deploy.speed_window_mps", s.deploy.speed_window_mps),
        ("deploy.box.altitude_km", s.deploy.limits.altitude_km),
        ("deploy.box.mach", s.deploy.limits.mach),
        ("deploy.box.dynamic_pressure_pa", s.deploy.limits.dynamic_pressure_pa),
        ("guidance.max_bank_deg", [s.guidance.min_bank_deg, s.guidance.max_bank_deg]),
    ] {
        if low >= high {
            return finding(path, format!("{path}: the lowest value {low} must be less than the highest {high}"));
        }
    }
    if s.name.is_empty() {
        return finding("name", "name is empty".into());
    }
    entry(s)?;
    gravity(s)?;
    temperature(s)?;
    horizon(s)?;
    dispersions(s)?;
    tables(s)?;
    sources(s)?;
    rates(s)?;
    s.fault.iter().enumerate().try_for_each(|(k, f)| fault(k, f))
}

fn finding<T>(path: &str, what: String) -> Result<T, Finding> {
    Err((path.split('.').map(String::from).collect(), what))
}

/// A Cartesian entry state lies where a spherical one may lie.
fn entry(s: &Scenario) -> Result<(), Finding> {
    if !matches!(s.entry, Entry::Cartesian { .. }) {
        return Ok(());
    }
    let planet = s.planet.si();
    let state = s.entry.planet_relative(&planet);
    let allowed = |field: &str| {
        let range = range_of(&["entry".into(), field.into()]);
        range.map_or((f64::NEG_INFINITY, f64::INFINITY), |range| (range.min, range.max))
    };
    let (low, high) = allowed("altitude_km");
    let altitude_km = (state.radius_m - planet.radius_m) * 1e-3;
    if !(low..=high).contains(&altitude_km) {
        let what = format!("entry.position_km lies at an altitude of {altitude_km:.1} km; allowed: {low} to {high} km");
        return finding("entry.position_km", what);
    }
    let (low, high) = allowed("speed_mps");
    let speed_mps = state.speed_mps;
    if !(low..=high).contains(&speed_mps) {
        let what =
            format!("entry.velocity_mps is {speed_mps:.1} m/s relative to the planet; allowed: {low} to {high} m/s");
        return finding("entry.velocity_mps", what);
    }
    Ok(())
}

/// Gravity at the surface as the flight software takes it, which ties two fields together.
fn gravity(s: &Scenario) -> Result<(), Finding> {
    for (part, planet) in [("planet", &s.planet), ("onboard.planet", &s.onboard.planet)] {
        let (mu_m3ps2, radius_m) = (planet.mu_m3ps2, planet.radius_km * 1e3);
        let (gravity, allowed) = (mu_m3ps2 / (radius_m * radius_m), SURFACE_GRAVITY_MPS2);
        if !allowed.admits(gravity) {
            let what = format!(
                "{part}.mu_m3ps2 = {mu_m3ps2:e} and {part}.radius_km = {} make a surface gravity of {gravity:.3} m/s²; allowed: {} to {} m/s²",
                planet.radius_km, allowed.min, allowed.max
            );
            return finding(&format!("{part}.mu_m3ps2"), what);
        }
    }
    Ok(())
}

/// The temperature that follows from gravity, scale height and gas when none is given.
fn temperature(s: &Scenario) -> Result<(), Finding> {
    let parameters = s.onboard.atmosphere.parameters(&s.onboard.planet.si());
    let (temperature_k, [.., allowed, _, _]) = (parameters.temperature_k, &ATMOSPHERE);
    if !allowed.admits(temperature_k) {
        let what = format!(
            "atmosphere.temperature_k is not given, and the hydrostatic one would be {temperature_k:.1} K; allowed: {} to {} K",
            allowed.min, allowed.max
        );
        return finding("onboard.atmosphere", what);
    }
    Ok(())
}

/// A prediction has only so many steps.
fn horizon(s: &Scenario) -> Result<(), Finding> {
    let (horizon_s, step_s) = (s.guidance.prediction_horizon_s, s.guidance.predictor_step_s);
    if horizon_s > MAX_HORIZON_STEPS * step_s {
        let what = format!(
            "guidance.predictor_step_s = {step_s} divides the prediction_horizon_s of {horizon_s} into {:.0} steps; allowed: at most {MAX_HORIZON_STEPS}",
            horizon_s / step_s
        );
        return finding("guidance.predictor_step_s", what);
    }
    Ok(())
}

fn dispersions(s: &Scenario) -> Result<(), Finding> {
    for (name, dispersion) in s.dispersions.all() {
        if let Dispersion::Uniform { bounds: [low, high] } = dispersion
            && low > high
        {
            let path = format!("dispersions.{name}.bounds");
            return finding(&path, format!("{path}: the lowest value {low} must not exceed the highest {high}"));
        }
    }
    Ok(())
}

fn tables(s: &Scenario) -> Result<(), Finding> {
    let airs = [
        ("atmosphere", s.atmosphere.kind, &s.atmosphere.rows, usize::MAX),
        ("onboard.atmosphere", s.onboard.atmosphere.kind, &s.onboard.atmosphere.rows, MAX_ATMOSPHERE_ROWS),
    ];
    for (part, kind, rows, capacity) in airs {
        match (kind, rows) {
            (AtmosphereKind::Exponential, Some(_)) => {
                return finding(
                    &format!("{part}.rows"),
                    format!("{part}: a table is given, but kind is \"exponential\"; set kind = \"table\""),
                );
            }
            (AtmosphereKind::Table, None) => {
                return finding(&format!("{part}.kind"), format!("{part}: kind is \"table\", but no `file` is given"));
            }
            (AtmosphereKind::Table, Some(rows)) => {
                let altitudes: Vec<f64> = rows.iter().map(|row: &AtmosphereRow| row.altitude_km).collect();
                rising(&format!("{part}.rows"), &altitudes, capacity)?;
                let with = rows.iter().filter(|row| row.temperature_k.is_some()).count();
                if with != 0 && with != rows.len() {
                    return finding(
                        &format!("{part}.rows"),
                        format!("{part}.rows: some rows have a temperature and some have none"),
                    );
                }
            }
            (AtmosphereKind::Exponential, None) => {}
        }
    }
    for (part, rows, capacity) in [
        ("vehicle", &s.vehicle.aero_table, usize::MAX),
        ("onboard.vehicle", &s.onboard.vehicle.aero_table, MAX_AERO_ROWS),
    ] {
        if let Some(rows) = rows {
            let machs: Vec<f64> = rows.iter().map(|row: &AeroRow| row.mach).collect();
            rising(&format!("{part}.aero_table"), &machs, capacity)?;
        }
    }
    Ok(())
}

/// At least two rows, no more than fit, each first column above the one before.
fn rising(path: &str, firsts: &[f64], capacity: usize) -> Result<(), Finding> {
    if firsts.len() < 2 || firsts.len() > capacity {
        let most = if capacity == usize::MAX { String::new() } else { format!(" and at most {capacity}") };
        return finding(
            path,
            format!("{path}: the table has {} rows where at least 2{most} are allowed", firsts.len()),
        );
    }
    match firsts.windows(2).find(|pair| pair[1] <= pair[0]) {
        Some(pair) => finding(
            path,
            format!("{path}: the first column must rise from row to row, but {} follows {}", pair[1], pair[0]),
        ),
        None => Ok(()),
    }
}

fn sources(s: &Scenario) -> Result<(), Finding> {
    let count = s.orbiter.len() + s.beacon.len();
    if count > MAX_SOURCES {
        let path = if s.beacon.is_empty() { "orbiter" } else { "beacon" };
        return finding(
            path,
            format!(
                "{} orbiters and {} beacons are {count} radio sources where at most {MAX_SOURCES} are allowed",
                s.orbiter.len(),
                s.beacon.len()
            ),
        );
    }
    let orbiters = s.orbiter.iter().enumerate().map(|(k, o)| (format!("orbiter.{k}.name"), &o.name));
    let beacons = s.beacon.iter().enumerate().map(|(k, b)| (format!("beacon.{k}.name"), &b.name));
    let mut names = Vec::new();
    for (path, name) in orbiters.chain(beacons) {
        if names.contains(&name) {
            return finding(&path, format!("two radio sources have the name \"{name}\""));
        }
        names.push(name);
    }
    for (k, orbiter) in s.orbiter.iter().enumerate() {
        let periapsis_km = orbiter.semi_major_axis_km * (1.0 - orbiter.eccentricity);
        if periapsis_km <= s.planet.radius_km {
            return finding(
                &format!("orbiter.{k}.semi_major_axis_km"),
                format!(
                    "orbiter.{k}: its periapsis of {periapsis_km:.1} km lies below the surface at {} km",
                    s.planet.radius_km
                ),
            );
        }
    }
    Ok(())
}

/// Sensor rates divide the frame rate.
fn rates(s: &Scenario) -> Result<(), Finding> {
    let frames_per_second = f64::from(fsw_core::time::FRAMES_PER_SECOND);
    for (path, rate_hz) in
        [("sensors.pressure.rate_hz", s.sensors.pressure.rate_hz), ("sensors.radio.rate_hz", s.sensors.radio.rate_hz)]
    {
        let frames = frames_per_second / rate_hz;
        if (frames - frames.round()).abs() > 1e-9 {
            return finding(
                path,
                format!(
                    "{path} = {rate_hz} is not a whole number of {frames_per_second} Hz frames; take 50, 25, 10, 5, 2, 1 or 0.5 Hz"
                ),
            );
        }
    }
    Ok(())
}

/// A fault that its target can have, with the numbers that it needs.
fn fault(k: usize, f: &Fault) -> Result<(), Finding> {
    let possible: &[FaultKind] = match f.target {
        FaultTarget::Accelerometer | FaultTarget::Gyro => &[FaultKind::Bias, FaultKind::Scale, FaultKind::Stuck],
        FaultTarget::Imu => &[FaultKind::Dropout, FaultKind::Stuck, FaultKind::Failed],
        FaultTarget::Pressure => {
            &[FaultKind::Dropout, FaultKind::Bias, FaultKind::Scale, FaultKind::Stuck, FaultKind::Failed]
        }
        FaultTarget::Radio => &[FaultKind::Dropout, FaultKind::Bias],
        FaultTarget::Uplink => {
            &[FaultKind::Dropout, FaultKind::BitFlips, FaultKind::Duplicate, FaultKind::Hold, FaultKind::Garbage]
        }
        FaultTarget::Computer => &[FaultKind::Overrun],
    };
    let name = |kind: &FaultKind| {
        toml::Value::try_from(kind).ok().and_then(|v| v.as_str().map(String::from)).unwrap_or_default()
    };
    if !possible.contains(&f.kind) {
        let list: Vec<String> = possible.iter().map(name).collect();
        return finding(
            &format!("fault.{k}.kind"),
            format!("fault.{k}: kind \"{}\" does not fit its target; it can have {}", name(&f.kind), list.join(", ")),
        );
    }
    let needed: &[&str] = match f.kind {
        FaultKind::Bias => &["value"],
        FaultKind::Scale => &["factor"],
        FaultKind::BitFlips => &["per_packet"],
        FaultKind::Duplicate => &["copies"],
        FaultKind::Garbage => &["bytes", "piece"],
        FaultKind::Dropout | FaultKind::Stuck | FaultKind::Failed | FaultKind::Hold | FaultKind::Overrun => &[],
    };
    if !f.parameters.keys().map(String::as_str).eq(needed.iter().copied()) {
        let given: Vec<&str> = f.parameters.keys().map(String::as_str).collect();
        let say = |names: &[&str]| {
            if names.is_empty() { "no parameters".into() } else { format!("`{}`", names.join("`, `")) }
        };
        return finding(
            &format!("fault.{k}.parameters"),
            format!("fault.{k}: kind \"{}\" takes {}, but has {}", name(&f.kind), say(needed), say(&given)),
        );
    }
    Ok(())
}
