//! `doc/icd.md` against the packet types: every packet, every field, its encoded size, and the link budget. A changed
//! packet fails here until the document says so.

use std::fmt::Write;

use fsw_core::config::limits::{self, Limit};
use fsw_core::link::framing::{MAX_FRAME, MAX_PAYLOAD, wire_len};
use fsw_core::link::packet::{Downlink, Frame, Uplink};
use fsw_core::link::parameters::ParameterBlock;
use fsw_core::sensors::limits as sensors;
use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType as Type, DataModelVariant as Variant, NamedType, NamedValue};

/// Bits on the wire per byte: start, eight data, stop.
const BITS_PER_BYTE: f64 = 10.0;
/// Default speed of the serial link, bit/s.
const BAUD: f64 = 921_600.0;
/// Share of the line that may be used, each way.
const BUDGET: f64 = 0.6;
/// Bytes of tag, sequence number and time stamp around a packet, at most: 1 + 3 + 5.
const ENVELOPE: usize = 9;

fn document() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../doc/icd.md")).expect("doc/icd.md is there")
}

/// Smallest and largest postcard encoding, bytes.
fn size(named: &NamedType) -> (usize, usize) {
    let sum = |items: &mut dyn Iterator<Item = (usize, usize)>| items.fold((0, 0), |s, i| (s.0 + i.0, s.1 + i.1));
    match named.ty {
        Type::Bool | Type::I8 | Type::U8 => (1, 1),
        Type::I16 | Type::U16 => (1, 3),
        Type::I32 | Type::U32 => (1, 5),
        Type::I64 | Type::U64 => (1, 10),
        Type::F32 => (4, 4),
        Type::F64 => (8, 8),
        Type::Option(inner) => (1, 1 + size(inner).1),
        Type::NewtypeStruct(inner) => size(inner),
        Type::Tuple(items) | Type::TupleStruct(items) => sum(&mut items.iter().map(|t| size(t))),
        Type::Struct(fields) => sum(&mut fields.iter().map(|f| size(f.ty))),
        Type::Enum(variants) => variants
            .iter()
            .map(|v| variant_size(v.ty))
            .fold((usize::MAX, 0), |s, v| (s.0.min(1 + v.0), s.1.max(1 + v.1))),
        other => panic!("packets do not use {other:?}"),
    }
}

fn variant_size(variant: &Variant) -> (usize, usize) {
    match variant {
        Variant::UnitVariant => (0, 0),
        Variant::NewtypeVariant(inner) => size(inner),
        Variant::TupleVariant(items) => items.iter().map(|t| size(t)).fold((0, 0), |s, t| (s.0 + t.0, s.1 + t.1)),
        Variant::StructVariant(fields) => fields.iter().map(|f| size(f.ty)).fold((0, 0), |s, t| (s.0 + t.0, s.1 + t.1)),
    }
}

/// The type as the document writes it.
fn type_name(named: &NamedType) -> String {
    match named.ty {
        Type::Tuple(items) => format!("{} × {}", items.len(), type_name(items[0])),
        Type::Option(inner) => format!("optional {}", type_name(inner)),
        Type::Struct(_) | Type::Enum(_) => format!("[{}](#{})", named.name, named.name.to_lowercase()),
        Type::NewtypeStruct(inner) => format!("{} ({})", named.name, type_name(inner)),
        _ => named.name.to_string(),
    }
}

fn bytes((least, most): (usize, usize)) -> String {
    if least == most { least.to_string() } else { format!("{least}–{most}") }
}

/// Beginnings of the rows that the document must have, section by section.
#[derive(Default)]
struct Expected {
    sections: Vec<(String, Vec<String>)>,
    /// Names of the fields of each struct.
    fields: Vec<(String, Vec<&'static str>)>,
}

impl Expected {
    fn of_both_directions() -> Self {
        let mut expected = Self::default();
        expected.walk(Frame::<Uplink>::SCHEMA);
        expected.walk(Frame::<Downlink>::SCHEMA);
        expected
    }

    /// Collects a section for the named type and all those it contains. Numbers with limits are given with them.
    fn walk(&mut self, named: &NamedType) {
        let title = named.name.to_string();
        if self.sections.iter().any(|(known, _)| *known == title && title != "Frame") {
            return;
        }
        match named.ty {
            Type::Tuple(items) => self.walk(items[0]),
            Type::Option(inner) => self.walk(inner),
            Type::Struct(fields) => {
                let limits = limits_of(&title).unwrap_or(&[]);
                let row = |(index, f): (usize, &&NamedValue)| {
                    let checked = limits.get(index).map(unit_and_range).unwrap_or_default();
                    format!("| `{}` | {} | {} |{checked}", f.name, type_name(f.ty), bytes(size(f.ty)))
                };
                if title != "Frame" {
                    self.fields.push((title.clone(), fields.iter().map(|f| f.name).collect()));
                    self.sections.push((title, fields.iter().enumerate().map(row).collect()));
                }
                fields.iter().for_each(|f| self.walk(f.ty));
            }
            Type::Enum(variants) => {
                let rows = variants.iter().enumerate().map(|(tag, v)| {
                    let content = match v.ty {
                        Variant::UnitVariant => "–".to_string(),
                        Variant::NewtypeVariant(inner) => type_name(inner),
                        Variant::TupleVariant(items) => {
                            items.iter().map(|t| type_name(t)).collect::<Vec<_>>().join(", ")
                        }
                        Variant::StructVariant(fields) => fields
                            .iter()
                            .map(|f| format!("`{}` {}", f.name, type_name(f.ty)))
                            .collect::<Vec<_>>()
                            .join(", "),
                    };
                    let (least, most) = variant_size(v.ty);
                    format!("| {tag} | `{}` | {content} | {} |", v.name, bytes((1 + least, 1 + most)))
                });
                self.sections.push((title.clone(), rows.collect()));
                variants.iter().for_each(|v| match v.ty {
                    Variant::NewtypeVariant(inner) => self.walk(inner),
                    Variant::StructVariant(fields) => fields.iter().for_each(|f| self.walk(f.ty)),
                    Variant::UnitVariant | Variant::TupleVariant(_) => {}
                });
            }
            _ => {}
        }
    }
}

#[test]
fn the_document_names_every_packet_and_field_with_type_and_size() {
    let document = document();
    let mut missing = String::new();
    for (title, rows) in Expected::of_both_directions().sections {
        let heading = format!("### {title}");
        let body: Vec<&str> =
            document.lines().skip_while(|l| *l != heading).skip(1).take_while(|l| !l.starts_with('#')).collect();
        let lacking: Vec<_> = rows.iter().filter(|row| !body.iter().any(|line| line.starts_with(*row))).collect();
        let present = body.iter().filter(|l| l.starts_with("| ") && l.contains('`')).count();
        if body.is_empty() || !lacking.is_empty() || present != rows.len() {
            writeln!(missing, "{heading} ({present} rows there, {} expected)", rows.len()).unwrap();
            lacking.iter().for_each(|row| writeln!(missing, "{row}").unwrap());
        }
    }
    assert!(missing.is_empty(), "doc/icd.md is not up to date:\n{missing}");
}

#[test]
fn sizes_worked_out_from_the_shapes_are_those_of_the_code() {
    assert_eq!(size(Frame::<Uplink>::SCHEMA).1, Frame::<Uplink>::POSTCARD_MAX_SIZE);
    assert_eq!(size(Frame::<Downlink>::SCHEMA).1, Frame::<Downlink>::POSTCARD_MAX_SIZE);
    let text = document();
    for figure in [format!("{MAX_PAYLOAD} bytes of payload"), format!("{MAX_FRAME} bytes on the wire")] {
        assert!(text.contains(&figure), "doc/icd.md does not say: {figure}");
    }
}

/// Limits of the structs whose numbers are checked when they are loaded.
fn limits_of(title: &str) -> Option<&'static [Limit]> {
    Some(match title {
        "Planet" => &limits::PLANET,
        "VehicleParameters" => &limits::VEHICLE,
        "AeroRow" => &limits::AERO_ROW,
        "AtmosphereParameters" => &limits::ATMOSPHERE,
        "AtmosphereRow" => &limits::ATMOSPHERE_ROW,
        "Target" => &limits::TARGET,
        "DeployParameters" => &limits::DEPLOY,
        "InitialKnowledge" => &limits::INITIAL_KNOWLEDGE,
        "NavigationParameters" => &limits::NAVIGATION,
        "GuidanceParameters" => &limits::GUIDANCE,
        "EstimatorParameters" => &limits::ESTIMATORS,
        "ConstraintParameters" => &limits::CONSTRAINTS,
        "ControlParameters" => &limits::CONTROL,
        _ => return None,
    })
}

/// Unit and range as the document writes them. Multiples of π are named.
fn unit_and_range(limit: &Limit) -> String {
    format!(" {} | {} to {} |", limit.unit, number(limit.min), number(limit.max))
}

fn number(x: f64) -> String {
    use std::f64::consts::PI;
    for (multiple, name) in [(0.5, "π/2"), (1.0, "π"), (2.0, "2π")] {
        if x.abs() == multiple * PI {
            return format!("{}{name}", if x < 0.0 { "−" } else { "" });
        }
    }
    let text = if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e5) { format!("{x:e}") } else { x.to_string() };
    text.replace('-', "−")
}

#[test]
fn every_struct_of_parameters_has_limits_under_the_names_of_its_fields() {
    let mut walk = Expected::default();
    walk.walk(ParameterBlock::SCHEMA);
    let mut limited = 0;
    for (title, fields) in walk.fields {
        let Some(limits) = limits_of(&title) else {
            // Tags and row numbers, checked where they are applied.
            assert!(["Modes", "AeroRows", "AtmosphereRows"].contains(&title.as_str()), "{title} has no limits");
            continue;
        };
        assert_eq!(fields, limits.iter().map(|l| l.field).collect::<Vec<_>>(), "{title}");
        limited += 1;
    }
    assert_eq!(limited, 13);
}

#[test]
fn the_document_states_the_ranges_of_radio_sources() {
    let text = document();
    for (kind, limits) in [("Orbiter", &limits::ORBITER[..]), ("Beacon", &limits::BEACON)] {
        for limit in limits {
            let row = format!("| {kind} | {} |{}", limit.field, unit_and_range(limit));
            assert!(text.lines().any(|line| line == row), "doc/icd.md lacks: {row}");
        }
    }
}

#[test]
fn the_document_states_the_ranges_of_measurements() {
    let text = document();
    let thousands = |n: u32| {
        let (millions, rest) = (n / 1_000_000, n % 1_000_000);
        format!("±{millions},{:03},{:03}", rest / 1_000, rest % 1_000)
    };
    for (field, range) in [
        ("delta_v_counts", thousands(sensors::MAX_DELTA_V_COUNTS)),
        ("delta_theta_counts", thousands(sensors::MAX_DELTA_THETA_COUNTS)),
        ("stagnation_pa", format!("−{} to {}", -sensors::MIN_STAGNATION_PA, sensors::MAX_STAGNATION_PA)),
        ("range_m", format!("{} to {:e}", sensors::MIN_RANGE_M, sensors::MAX_RANGE_M)),
        ("range_rate_mps", format!("±{}", sensors::MAX_RANGE_RATE_MPS)),
        ("quality", format!("{} to 255", sensors::MIN_QUALITY)),
    ] {
        let start = format!("| `{field}` |");
        let found = text.lines().any(|l| l.starts_with(&start) && l.contains(&format!("| {range} |")));
        assert!(found, "doc/icd.md does not give the range of {field}: {range}");
    }
    for (rule, time) in [("late", sensors::MAX_AGE), ("early", sensors::MAX_LEAD)] {
        let start = format!("| {rule} |");
        let figure = format!("{} ms", time.0 / 1_000);
        assert!(text.lines().any(|l| l.starts_with(&start) && l.contains(&figure)), "{rule}: {figure}");
    }
}

/// Packets per second at most, from the schedule: see the table of rates in the document.
const UPLINK_RATES: [(&str, f64); 4] = [("Imu", 50.0), ("Pressure", 10.0), ("Radio", 4.0), ("Truth", 50.0)];
const DOWNLINK_RATES: [(&str, f64); 5] =
    [("Actuator", 50.0), ("NavTlm", 10.0), ("GuidanceTlm", 1.0), ("HealthTlm", 1.0), ("Event", 10.0)];

/// Largest number of bytes on the wire of each packet of a direction.
fn largest(direction: &NamedType) -> Vec<(&'static str, usize)> {
    let Type::Enum(packets) = direction.ty else { panic!("an enum") };
    packets.iter().map(|p| (p.name, wire_len(ENVELOPE + variant_size(p.ty).1))).collect()
}

#[test]
fn the_link_budget_holds_with_every_packet_at_its_largest_and_is_stated() {
    let mut rows = Vec::new();
    for (name, direction, rates) in
        [("up", Uplink::SCHEMA, &UPLINK_RATES[..]), ("down", Downlink::SCHEMA, &DOWNLINK_RATES[..])]
    {
        let mut total = 0.0;
        for (packet, rate) in rates {
            let (_, bytes) = *largest(direction).iter().find(|(known, _)| known == packet).expect("known packet");
            let share = 100.0 * bytes as f64 * rate * BITS_PER_BYTE / BAUD;
            rows.push(format!("| {name} | {packet} | {bytes} | {rate} | {share:.2} % |"));
            total += share;
        }
        rows.push(format!("| {name} | **sum** | | | **{total:.2} %** |"));
        assert!(total <= 100.0 * BUDGET, "{name}: {total:.1} % of the line");
    }
    let text = document();
    let missing: Vec<_> = rows.iter().filter(|row| !text.lines().any(|line| line == *row)).collect();
    assert!(missing.is_empty(), "doc/icd.md lacks these rows of the link budget:\n{}", {
        missing.iter().fold(String::new(), |all, row| all + row + "\n")
    });
}
