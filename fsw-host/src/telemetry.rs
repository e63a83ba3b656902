//! The table of a flight: ten rows a second, truth beside estimate beside command, as Parquet and as CSV.
//!
//! Column names end in their unit. A cell is empty where nothing was said: no navigation packet in that tenth of a
//! second, no guidance cycle yet.

use std::io::{self, Write};
use std::sync::Arc;

use fsw_core::frames::{Inertial, PlanetRelative, Vec3, planet_relative_from_inertial};
use fsw_core::link::packet::{Actuator, GuidanceTlm, Mode, NavTlm};
use fsw_core::time::MissionTime;
use fsw_core::units::deg;
use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::record::{FlightRecord, NeesSample, TruthSample};

/// Minor frames of one row.
const FRAMES_PER_ROW: usize = 5;

/// One column; every cell may be empty.
pub struct Column {
    /// Name with unit.
    pub name: &'static str,
    /// Cells.
    pub cells: Cells,
}

/// The cells of a column.
pub enum Cells {
    /// Numbers.
    Number(Vec<Option<f64>>),
    /// Words.
    Word(Vec<Option<&'static str>>),
}

/// Everything known at one instant.
struct Row<'a> {
    truth: &'a TruthSample,
    actuator: Option<&'a Actuator>,
    nav: Option<&'a NavTlm>,
    estimate: Option<PlanetRelative>,
    errors: Option<&'a NeesSample>,
    guidance: Option<&'a GuidanceTlm>,
}

type Number = (&'static str, fn(&Row<'_>) -> Option<f64>);

/// The numeric columns.
const NUMBERS: &[Number] = &[
    ("time_s", |r| Some(r.truth.time_s)),
    ("true_longitude_deg", |r| Some(deg(r.truth.longitude_rad))),
    ("true_latitude_deg", |r| Some(deg(r.truth.latitude_rad))),
    ("true_altitude_m", |r| Some(r.truth.altitude_m)),
    ("true_speed_mps", |r| Some(r.truth.speed_mps)),
    ("true_flight_path_angle_deg", |r| Some(deg(r.truth.flight_path_angle_rad))),
    ("true_heading_deg", |r| Some(deg(r.truth.heading_rad))),
    ("true_bank_deg", |r| Some(deg(r.truth.packet.bank_rad))),
    ("true_bank_rate_degps", |r| Some(deg(r.truth.packet.bank_rate_radps))),
    ("true_range_to_go_m", |r| Some(r.truth.range_to_go_m)),
    ("true_density_kgpm3", |r| Some(r.truth.packet.density_kgpm3)),
    ("true_mach", |r| Some(r.truth.packet.mach)),
    ("true_dynamic_pressure_pa", |r| Some(r.truth.packet.dynamic_pressure_pa)),
    ("true_load_g", |r| Some(r.truth.load_g)),
    ("true_heat_flux_wpm2", |r| Some(r.truth.heat_flux_wpm2)),
    ("true_position_x_m", |r| Some(r.truth.packet.position_m[0])),
    ("true_position_y_m", |r| Some(r.truth.packet.position_m[1])),
    ("true_position_z_m", |r| Some(r.truth.packet.position_m[2])),
    ("true_velocity_x_mps", |r| Some(r.truth.packet.velocity_mps[0])),
    ("true_velocity_y_mps", |r| Some(r.truth.packet.velocity_mps[1])),
    ("true_velocity_z_mps", |r| Some(r.truth.packet.velocity_mps[2])),
    ("bank_accel_command_degps2", |r| r.actuator.map(|a| deg(a.bank_accel_radps2))),
    ("bank_rate_command_degps", |r| r.actuator.map(|a| deg(a.bank_rate_radps))),
    ("discretes", |r| r.actuator.map(|a| f64::from(a.discretes))),
    ("nav_longitude_deg", |r| r.estimate.map(|e| deg(e.longitude_rad))),
    ("nav_latitude_deg", |r| r.estimate.map(|e| deg(e.latitude_rad))),
    ("nav_radius_m", |r| r.estimate.map(|e| e.radius_m)),
    ("nav_speed_mps", |r| r.estimate.map(|e| e.speed_mps)),
    ("nav_flight_path_angle_deg", |r| r.estimate.map(|e| deg(e.flight_path_angle_rad))),
    ("nav_heading_deg", |r| r.estimate.map(|e| deg(e.heading_rad))),
    ("nav_bank_deg", |r| r.nav.map(|n| deg(f64::from(n.bank_rad)))),
    ("nav_position_x_m", |r| r.nav.map(|n| n.position_m[0])),
    ("nav_position_y_m", |r| r.nav.map(|n| n.position_m[1])),
    ("nav_position_z_m", |r| r.nav.map(|n| n.position_m[2])),
    ("nav_velocity_x_mps", |r| r.nav.map(|n| n.velocity_mps[0])),
    ("nav_velocity_y_mps", |r| r.nav.map(|n| n.velocity_mps[1])),
    ("nav_velocity_z_mps", |r| r.nav.map(|n| n.velocity_mps[2])),
    ("nav_position_sigma_x_m", |r| r.errors.map(|e| e.position_sigma_m[0])),
    ("nav_position_sigma_y_m", |r| r.errors.map(|e| e.position_sigma_m[1])),
    ("nav_position_sigma_z_m", |r| r.errors.map(|e| e.position_sigma_m[2])),
    ("nav_velocity_sigma_x_mps", |r| r.errors.map(|e| e.velocity_sigma_mps[0])),
    ("nav_velocity_sigma_y_mps", |r| r.errors.map(|e| e.velocity_sigma_mps[1])),
    ("nav_velocity_sigma_z_mps", |r| r.errors.map(|e| e.velocity_sigma_mps[2])),
    ("nav_nees", |r| r.errors.and_then(|e| e.nees)),
    ("nav_log_density", |r| r.nav.map(|n| f64::from(n.log_density))),
    ("nav_log_density_sigma", |r| r.nav.map(|n| f64::from(n.log_density_sigma))),
    ("guidance_bank_deg", |r| r.guidance.map(|g| deg(g.bank_rad))),
    ("guidance_range_to_go_m", |r| r.guidance.map(|g| g.range_to_go_m)),
    ("guidance_downrange_error_m", |r| r.guidance.map(|g| g.predicted_downrange_error_m)),
    ("guidance_heading_offset_m", |r| r.guidance.map(|g| g.heading_offset_m)),
    ("guidance_heading_threshold_m", |r| r.guidance.map(|g| g.heading_threshold_m)),
    ("guidance_iterations", |r| r.guidance.map(|g| f64::from(g.iterations))),
    ("guidance_evaluations", |r| r.guidance.map(|g| f64::from(g.evaluations))),
];

/// The table of a flight.
#[must_use]
pub fn table(record: &FlightRecord) -> Vec<Column> {
    let rows = rows(record);
    let mut columns: Vec<Column> = NUMBERS
        .iter()
        .map(|(name, cell)| Column { name, cells: Cells::Number(rows.iter().map(cell).collect()) })
        .collect();
    let modes = rows.iter().map(|r| r.actuator.map(|a| mode_word(a.mode))).collect();
    columns.push(Column { name: "mode", cells: Cells::Word(modes) });
    columns
}

/// One row per five frames, at the frame of the navigation packet when there is one, and one at the end of the flight.
fn rows(record: &FlightRecord) -> Vec<Row<'_>> {
    let mut cursors = Cursors::default();
    let last = record.truth.len().saturating_sub(1);
    let has_nav = |index: usize| -> bool {
        let time = time_of(&record.truth[index]);
        record.nav.binary_search_by_key(&time, |(t, _)| *t).is_ok()
    };
    let mut picks = Vec::new();
    for start in (0..record.truth.len()).step_by(FRAMES_PER_ROW) {
        let end = (start + FRAMES_PER_ROW).min(record.truth.len());
        picks.push((start..end).find(|index| has_nav(*index)).unwrap_or(start));
    }
    if !record.truth.is_empty() && picks.last() != Some(&last) {
        picks.push(last);
    }
    picks.into_iter().map(|index| cursors.row(record, &record.truth[index])).collect()
}

fn time_of(sample: &TruthSample) -> MissionTime {
    MissionTime((sample.time_s * 1e6).round() as u32)
}

/// Positions in the lists of a record, which are all in order of time.
#[derive(Default)]
struct Cursors {
    actuator: usize,
    nav: usize,
    errors: usize,
    guidance: usize,
}

impl Cursors {
    fn row<'a>(&mut self, record: &'a FlightRecord, truth: &'a TruthSample) -> Row<'a> {
        let time = time_of(truth);
        advance(&mut self.actuator, &record.actuators, |a| MissionTime::of_frame(a.frame) <= time);
        advance(&mut self.nav, &record.nav, |(t, _)| *t <= time);
        advance(&mut self.errors, &record.nees, |e| e.time_s <= truth.time_s + 1e-6);
        advance(&mut self.guidance, &record.guidance, |(t, _)| *t <= time);
        let nav = last(self.nav, &record.nav).filter(|(t, _)| *t == time).map(|(_, nav)| nav);
        Row {
            truth,
            actuator: last(self.actuator, &record.actuators),
            nav,
            estimate: nav.map(|nav| planet_relative(record, time, nav)),
            errors: last(self.errors, &record.nees).filter(|e| nav.is_some() && (e.time_s - truth.time_s).abs() < 1e-6),
            guidance: last(self.guidance, &record.guidance).map(|(_, g)| g),
        }
    }
}

fn advance<T>(cursor: &mut usize, list: &[T], passed: impl Fn(&T) -> bool) {
    while list.get(*cursor).is_some_and(&passed) {
        *cursor += 1;
    }
}

fn last<T>(cursor: usize, list: &[T]) -> Option<&T> {
    list.get(cursor.checked_sub(1)?)
}

fn planet_relative(record: &FlightRecord, time: MissionTime, nav: &NavTlm) -> PlanetRelative {
    let r_i = Vec3::<Inertial>::from_array(nav.position_m);
    let v_i = Vec3::<Inertial>::from_array(nav.velocity_mps);
    let (r_p, v_p) = planet_relative_from_inertial(&r_i, &v_i, time, record.facts.planet.rotation_radps);
    PlanetRelative::from_cartesian(&r_p, &v_p)
}

/// The word for a mode.
#[must_use]
pub fn mode_word(mode: Mode) -> &'static str {
    match mode {
        Mode::Standby => "standby",
        Mode::Coast => "coast",
        Mode::RangeControl => "range control",
        Mode::HeadingAlignment => "heading alignment",
        Mode::Deployed => "deployed",
        Mode::DegradedRangeControl => "degraded range control",
        Mode::DegradedHeadingAlignment => "degraded heading alignment",
    }
}

/// Writes the table as CSV.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_csv(columns: &[Column], out: &mut impl Write) -> io::Result<()> {
    let names: Vec<_> = columns.iter().map(|c| c.name).collect();
    writeln!(out, "{}", names.join(","))?;
    let count = columns.first().map_or(0, |c| c.cells.len());
    for row in 0..count {
        for (index, column) in columns.iter().enumerate() {
            if index > 0 {
                write!(out, ",")?;
            }
            match &column.cells {
                Cells::Number(cells) => cells[row].map_or(Ok(()), |value| write!(out, "{value}"))?,
                Cells::Word(cells) => cells[row].map_or(Ok(()), |word| write!(out, "{word}"))?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Self::Number(cells) => cells.len(),
            Self::Word(cells) => cells.len(),
        }
    }
}

/// The system's own error where there is one underneath: `External: …` tells a user nothing.
fn plain(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(inner) => *inner,
            Err(inner) => io::Error::other(inner),
        },
        other => io::Error::other(other),
    }
}

/// Writes the table as Parquet: one row group, optional doubles, words as UTF-8.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_parquet(columns: &[Column], out: impl Write + Send) -> io::Result<()> {
    let fields = columns.iter().map(field).collect::<Result<Vec<_>, _>>().map_err(plain)?;
    let schema = Type::group_type_builder("flight").with_fields(fields).build().map_err(plain)?;
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), properties).map_err(plain)?;
    let mut group = file.next_row_group().map_err(plain)?;
    for column in columns {
        let Some(mut writer) = group.next_column().map_err(plain)? else { break };
        let written = match &column.cells {
            Cells::Number(cells) => {
                let values: Vec<f64> = cells.iter().flatten().copied().collect();
                writer.typed::<DoubleType>().write_batch(&values, Some(&present(cells)), None)
            }
            Cells::Word(cells) => {
                let values: Vec<ByteArray> = cells.iter().flatten().map(|word| ByteArray::from(*word)).collect();
                writer.typed::<ByteArrayType>().write_batch(&values, Some(&present(cells)), None)
            }
        };
        written.map_err(plain)?;
        writer.close().map_err(plain)?;
    }
    group.close().map_err(plain)?;
    file.close().map_err(plain)?;
    Ok(())
}

/// Definition levels: 1 for a cell that is there.
fn present<T>(cells: &[Option<T>]) -> Vec<i16> {
    cells.iter().map(|cell| i16::from(cell.is_some())).collect()
}

fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match column.cells {
        Cells::Number(_) => (PhysicalType::DOUBLE, None),
        Cells::Word(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
    };
    Type::primitive_type_builder(column.name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()
        .map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::End;
    use crate::record::tests::facts;
    use crate::recorder::{FlightId, Recorder};
    use fsw_core::link::packet::{Downlink, Frame, Truth};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    fn flight() -> FlightRecord {
        let mut recorder = Recorder::new(facts(), FlightId::default(), 1000.0);
        for frame in 0..=13u32 {
            let time = MissionTime::of_frame(frame);
            let position_m = [3_500_000.0, f64::from(frame), 0.0];
            recorder.truth(time, &Truth { position_m, velocity_mps: [0.0, 5e3, 0.0], ..Truth::default() });
            if frame == 7 {
                let nav = NavTlm { position_m, velocity_mps: [0.0, 5e3, 0.0], ..NavTlm::default() };
                recorder.downlink(Frame { sequence: 0, time, packet: Downlink::NavTlm(nav) });
            }
            if frame > 0 {
                let actuator = Actuator { frame, mode: Mode::Coast, ..Actuator::default() };
                recorder.downlink(Frame { sequence: 0, time, packet: Downlink::Actuator(actuator) });
            }
        }
        recorder.finish(End::Interrupted, 0.0)
    }

    #[test]
    fn rows_sit_on_navigation_packets_and_the_end_of_the_flight() {
        let columns = table(&flight());
        let Cells::Number(times) = &columns[0].cells else { panic!("time is a number") };
        let times: Vec<f64> = times.iter().flatten().copied().collect();
        assert_eq!(times, [0.0, 0.14, 0.2, 0.26]);
    }

    #[test]
    fn what_is_written_as_parquet_reads_back_with_its_gaps() {
        let columns = table(&flight());
        let mut bytes = Vec::new();
        write_parquet(&columns, &mut bytes).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 4);
        let nav_x = columns.iter().position(|c| c.name == "nav_position_x_m").unwrap();
        assert!(rows[0].get_double(nav_x).is_err());
        assert_eq!(rows[1].get_double(nav_x).unwrap(), 3_500_000.0);
        assert_eq!(rows[3].get_string(columns.len() - 1).unwrap(), "coast");
    }

    #[test]
    fn every_csv_line_has_a_cell_per_column() {
        let columns = table(&flight());
        let mut text = Vec::new();
        write_csv(&columns, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text.lines().count(), 5);
        assert!(text.lines().all(|line| line.split(',').count() == columns.len()));
    }
}
