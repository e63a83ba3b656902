//! The report of a flight: one self-contained HTML page, and the one picture that tells the flight.
//!
//! [`plot`] is the toolkit, [`figures`] describe what to draw, `page` sets them; nothing here changes a result.

mod computer;
mod figures;
mod overview;
mod page;
mod palette;
mod plot;
#[cfg(test)]
mod synthetic;
mod tables;

use std::io;
use std::path::{Path, PathBuf};

use crate::record::FlightRecord;
pub(crate) use page::STYLE;
pub(crate) use palette::{Ink, style_sheet};
pub use plot::PlotError;
pub(crate) use plot::{Anchor, Axis, Figure, Layer, Mark, Panel, Point, number};

/// A report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The plotting library failed.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// The file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Writes the report of `record` to `path`: one HTML file that needs nothing else. Incomplete flights give a page
/// that says what is missing.
///
/// # Errors
/// When a plot cannot be drawn or the file cannot be written.
pub fn write(record: &FlightRecord, path: &Path) -> Result<(), ReportError> {
    save(path, &page::html(record)?)
}

/// Writes the overview picture of `record` to `path`.
///
/// # Errors
/// When it cannot be drawn or the file cannot be written.
pub fn write_overview(record: &FlightRecord, path: &Path) -> Result<(), ReportError> {
    save(path, &overview::svg(record)?)
}

/// The overview picture as SVG: the descent over the ground coloured by load, the bank history and the end about the
/// target. Empty when it cannot be drawn.
#[must_use]
pub fn overview_svg(record: &FlightRecord) -> String {
    overview::svg(record).unwrap_or_default()
}

fn save(path: &Path, content: &str) -> Result<(), ReportError> {
    std::fs::write(path, content).map_err(|source| ReportError::Write { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::End;

    /// Sections that every page has, whatever the flight.
    const SECTIONS: [&str; 10] = [
        "figures",
        "timeline",
        "flight",
        "track",
        "guidance",
        "navigation",
        "measurements",
        "computer",
        "link",
        "again",
    ];

    /// The flight cut, emptied and spoiled in every way that can reach the report.
    fn records() -> Vec<(&'static str, FlightRecord)> {
        let whole = synthetic::flight();
        let mut cut = whole.clone();
        cut.truth.truncate(1500);
        cut.nav.truncate(300);
        cut.guidance.clear();
        cut.end = End::Interrupted;
        cut.summary.deploy = None;
        cut.summary.miss_m = None;
        cut.summary.success = false;
        let mut blind = whole.clone();
        blind.nav.clear();
        blind.nees.clear();
        blind.frame_cost_us.clear();
        blind.end = End::Failed("the link was <cut> & lost".into());
        blind.summary.success = false;
        let mut single = whole.clone();
        single.truth.truncate(1);
        single.nav.truncate(1);
        single.guidance.truncate(1);
        single.frame_cost_us.truncate(1);
        let mut spoiled = whole.clone();
        for sample in spoiled.truth.iter_mut().step_by(3) {
            sample.altitude_m = f64::NAN;
            sample.load_g = f64::INFINITY;
            sample.packet.position_m = [f64::NAN; 3];
            sample.packet.bank_rad = f64::NAN;
        }
        for (_, nav) in spoiled.nav.iter_mut().step_by(2) {
            nav.position_m = [f64::NAN; 3];
            nav.covariance = [f32::NAN; fsw_core::link::packet::COVARIANCE_ELEMENTS];
        }
        spoiled.guidance.iter_mut().for_each(|(_, g)| g.predicted_downrange_error_m = f64::NAN);
        spoiled.frame_cost_us.fill(f32::NAN);
        let mut nothing_finite = whole.clone();
        nothing_finite.truth.iter_mut().for_each(|s| {
            (s.time_s, s.longitude_rad, s.latitude_rad, s.altitude_m, s.speed_mps) =
                (f64::NAN, f64::NAN, f64::NAN, f64::NAN, f64::NAN);
        });
        let empty = synthetic::empty();
        vec![
            ("whole", whole),
            ("cut", cut),
            ("blind", blind),
            ("single", single),
            ("spoiled", spoiled),
            ("nothing_finite", nothing_finite),
            ("empty", empty),
        ]
    }

    /// Every element is closed in order, and text holds no bare `<`.
    fn assert_well_formed(name: &str, html: &str) {
        const VOID: [&str; 2] = ["meta", "br"];
        let mut open: Vec<&str> = Vec::new();
        for tag in html.split('<').skip(1) {
            let (inside, _) = tag.split_once('>').unwrap_or_else(|| panic!("{name}: tag without end: {tag:.80}"));
            let element = inside.split([' ', '/', '\n']).next().unwrap_or_default();
            if let Some(closed) = inside.strip_prefix('/') {
                assert_eq!(open.pop(), Some(closed), "{name}");
            } else if !inside.starts_with('!') && !inside.ends_with('/') && !VOID.contains(&element) {
                open.push(element);
            }
        }
        assert!(open.is_empty(), "{name}: {open:?} left open");
    }

    #[test]
    fn every_page_has_all_sections_is_well_formed_and_stands_alone() {
        for (name, record) in records() {
            let html = page::html(&record).unwrap();
            for section in SECTIONS {
                assert!(html.contains(&format!("id=\"{section}\"")), "{name} lacks {section}");
            }
            assert_well_formed(name, &html);
            for reference in ["http:", "https:", "src=", "href=", "@import", "url("] {
                assert!(!html.contains(reference), "{name} refers to something outside by {reference}");
            }
            assert!(!html.contains("NaN") && !html.contains(">inf"), "{name} shows a number that is none");
            assert!(html.len() < 2_000_000, "{name} has {} bytes", html.len());
        }
    }

    #[test]
    fn a_whole_flight_fills_every_figure_and_an_empty_one_says_what_is_missing() {
        let whole = page::html(&synthetic::flight()).unwrap();
        assert!(!whole.contains("class=\"missing\""));
        let empty = page::html(&synthetic::empty()).unwrap();
        assert!(!empty.contains("class=\"plot\""));
        assert!(empty.contains("No true state was recorded."));
    }

    #[test]
    fn words_from_outside_cannot_break_the_page() {
        let mut record = synthetic::empty();
        record.facts.name = "<script>\"&".into();
        let html = page::html(&record).unwrap();
        assert!(html.contains("&lt;script&gt;") && !html.contains("<script"));
    }

    #[test]
    fn the_overview_of_any_flight_is_one_well_formed_picture() {
        for (name, record) in records() {
            let svg = overview_svg(&record);
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
            assert_well_formed(name, &svg);
            assert!(!svg.contains("NaN"), "{name}");
        }
    }

    #[test]
    fn a_page_that_cannot_be_written_names_the_file() {
        let path = Path::new("no such folder/report.html");
        let error = write(&synthetic::empty(), path).unwrap_err().to_string();
        assert!(error.starts_with("cannot write no such folder/report.html"), "{error}");
    }

    /// `REPORT_SAMPLES=folder cargo test -p fsw-host samples_to_look_at -- --ignored` writes pages to look at.
    #[test]
    #[ignore = "writes files to look at"]
    fn samples_to_look_at() {
        let folder = PathBuf::from(std::env::var_os("REPORT_SAMPLES").expect("REPORT_SAMPLES names a folder"));
        for (name, record) in records() {
            write(&record, &folder.join(format!("{name}.html"))).unwrap();
            write_overview(&record, &folder.join(format!("{name}.svg"))).unwrap();
        }
    }
}
