//! Settings that are each in range but contradict each other.

use fsw_core::link::packet::MAX_SOURCES;
use fsw_core::link::parameters::{MAX_AERO_ROWS, MAX_ATMOSPHERE_ROWS};

use super::{AeroRow, AtmosphereKind, AtmosphereRow, Dispersion, Fault, FaultKind, FaultTarget, Scenario};

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
    dispersions(s)?;
    tables(s)?;
    sources(s)?;
    rates(s)?;
    s.fault.iter().enumerate().try_for_each(|(k, f)| fault(k, f))
}

fn finding<T>(path: &str, what: String) -> Result<T, Finding> {
    Err((path.split('.').map(String::from).collect(), what))
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
        FaultTarget::Uplink => &[FaultKind::Dropout, FaultKind::BitFlips],
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
        FaultKind::Dropout | FaultKind::Stuck | FaultKind::Failed => &[],
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
