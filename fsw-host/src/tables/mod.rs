//! `guidance-tables`: makes the tables of the guidance modes `apollo` and `segmented-table` from the onboard model of a
//! scenario, as the source file `fsw-core/src/guidance/tables.rs`.
//!
//! * [`mod@reference`] the nominal flight at constant bank, and what its range depends on. * [`remainder`] the polynomials.

mod reference;
mod remainder;

use std::fmt::Write;

use hil_sim::scenario::Scenario;

use crate::cli::GuidanceTablesArgs;
use crate::error::HostError;
use crate::output::print;
use crate::runfolder::write_whole;

use reference::Reference;

/// P4's waypoints: longitude, latitude, deg.
pub(crate) const WAYPOINTS_DEG: [[f64; 2]; 3] = [[-84.0, -43.24], [-80.0, -42.71], [-76.0, -42.07]];

const REFERENCE_HEAD: &str = "\
/// Speed (m/s), range to go (m), drag (m/s²), altitude rate (m/s), ∂R/∂D (s²), ∂R/∂ḣ (s), ∂R/∂cos σ (m).
pub type ReferenceRow = [f32; 7];
/// The reference flight by increasing speed; rows stand where the flight bends.
";
const TERMS_HEAD: &str = "\
];

/// Terms of the polynomials of [`Segment`], in the order of [`terms`](super::segments::terms).
pub const REMAINDER_TERMS: usize = ";
const SEGMENT_HEAD: &str = "\
/// A waypoint, and the range still flown from its speed to the parachute trigger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Longitude, rad.
    pub longitude_rad: f32,
    /// Planetocentric latitude, rad.
    pub latitude_rad: f32,
    /// Speed of the reference flight abeam, m/s.
    pub speed_mps: f32,
    /// Centre and reach, either way, of altitude (m), flight-path angle (rad), cosine of the bank and log-density.
    pub validity: [(f32, f32); 4],
    /// Coefficients, m.
    pub coefficients: [f32; REMAINDER_TERMS],
}

/// P4's waypoints, in the order of the flight.
";

/// Runs the command.
///
/// # Errors
/// The scenario cannot be read, has no nominal flight to its target, or the file cannot be written.
pub fn run(args: &GuidanceTablesArgs) -> Result<bool, HostError> {
    let scenario = Scenario::resolve(&args.scenario, &args.set)?;
    let mut command = format!("aeroshell guidance-tables {}", args.scenario);
    for set in &args.set {
        let _ = write!(command, " --set {set}");
    }
    let source = source(&scenario, &command)?;
    match &args.out {
        Some(path) => write_whole(path, |out| std::io::Write::write_all(out, source.as_bytes()))?,
        None => print(&source)?,
    }
    Ok(true)
}

/// The source file of the tables of a scenario, made by `command`.
///
/// # Errors
/// The scenario has no nominal flight to its target.
pub fn source(scenario: &Scenario, command: &str) -> Result<String, HostError> {
    let reference = Reference::new(scenario)?;
    let segments: [_; 3] = std::array::from_fn(|k| remainder::segment(&reference, k, WAYPOINTS_DEG[k]));
    let mut text = format!(
        "//! Tables of the guidance modes `apollo` and `segmented-table`. Made by\n//! `{command}`;\n//! do not edit.\n\n"
    );
    text.push_str(&reference.made_with());
    let _ = write!(
        text,
        "/// Cosine of the constant bank of the reference flight, {:.3}°.\npub const REFERENCE_COS_BANK: f64 = {:.6};\n",
        reference.cos_bank.acos().to_degrees(),
        reference.cos_bank
    );
    text.push_str(REFERENCE_HEAD);
    let rows = reference.rows();
    let _ = writeln!(text, "pub const REFERENCE: [ReferenceRow; {}] = [", rows.len());
    for row in rows {
        let [v, r, d, h, fd, fh, fu] = row;
        let _ = writeln!(text, "    [{v:.1}, {r:.1}, {d:.4}, {h:.2}, {fd:.1}, {fh:.1}, {fu:.1}],");
    }
    let _ = write!(text, "{TERMS_HEAD}{};\n\n{SEGMENT_HEAD}", fsw_core::guidance::tables::REMAINDER_TERMS);
    let _ = writeln!(text, "pub const SEGMENTS: [Segment; {}] = [", segments.len());
    for segment in &segments {
        text.push_str(&segment.source());
    }
    text.push_str("];\n");
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_checked_in_are_those_that_the_command_makes() {
        let checked_in = include_str!("../../../fsw-core/src/guidance/tables.rs");
        let command = checked_in.lines().find_map(|line| line.strip_prefix("//! `")?.strip_suffix("`;")).unwrap();
        let mut sets = Vec::new();
        let mut words = command.split(' ').skip(3);
        while let (Some("--set"), Some(set)) = (words.next(), words.next()) {
            sets.push(set.to_owned());
        }
        let scenario = Scenario::resolve("msl", &sets).unwrap();
        // The formatter breaks lines and sets commas there; the numbers and words are what counts.
        let plain = |text: &str| text.replace([' ', '\n', ','], "");
        assert_eq!(plain(&source(&scenario, command).unwrap()), plain(checked_in));
    }
}
