//! From text to [`Scenario`]: the file over the default scenario, then `--set`, then the onboard belief, then checks.

use std::path::Path;

use fsw_core::link::parameters::{MAX_AERO_ROWS, MAX_ATMOSPHERE_ROWS};
use toml::{Table, Value};

use super::error::explain;
use super::layers::{Layer, document, merge, place, set};
use super::ranges::{numbers, range_of};
use super::{Scenario, ScenarioError, check, table};

/// Built-in scenarios by name; the first is the default and has every field.
const BUILTIN: &[(&str, &str)] = &[
    ("msl", include_str!("builtin/msl.toml")),
    ("msl-ideal", include_str!("builtin/msl-ideal.toml")),
    ("msl-beacon", include_str!("builtin/msl-beacon.toml")),
    ("msl-direct", include_str!("builtin/msl-direct.toml")),
    ("paper-exp40", include_str!("builtin/paper-exp40.toml")),
    ("msl-winds", include_str!("builtin/msl-winds.toml")),
    ("msl-hard", include_str!("builtin/msl-hard.toml")),
    ("low-beta", include_str!("builtin/low-beta.toml")),
    ("high-lift", include_str!("builtin/high-lift.toml")),
    ("southern-winter", include_str!("builtin/southern-winter.toml")),
];

impl Scenario {
    /// Names of the built-in scenarios, the default first.
    #[must_use]
    pub fn builtin_names() -> Vec<&'static str> {
        BUILTIN.iter().map(|(name, _)| *name).collect()
    }

    /// Text of a built-in scenario, comments and all.
    #[must_use]
    pub fn builtin_text(name: &str) -> Option<&'static str> {
        BUILTIN.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
    }

    /// A built-in scenario.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn builtin(name: &str) -> Result<Self, ScenarioError> {
        let text = Self::builtin_text(name).ok_or_else(|| no_such_scenario(name))?;
        Self::from_text(name, text, Path::new(""), &[])
    }

    /// A built-in scenario or a TOML file, with `--set dotted.field=value` applied in their order.
    ///
    /// # Errors
    /// One sentence on the first thing that is wrong: file, line, field, value, allowed range.
    pub fn resolve(name_or_path: &str, sets: &[String]) -> Result<Self, ScenarioError> {
        if let Some(text) = Self::builtin_text(name_or_path) {
            return Self::from_text(name_or_path, text, Path::new(""), sets);
        }
        if name_or_path.is_empty() {
            return Err(no_such_scenario("\"\""));
        }
        let path = Path::new(name_or_path);
        // A bare word was meant as a built-in name.
        if !path.exists() && path.components().count() == 1 && path.extension().is_none() {
            return Err(no_such_scenario(name_or_path));
        }
        let text = table::read_text(path).map_err(|e| {
            ScenarioError::new(format!("{name_or_path}: the scenario cannot be read: {}", table::reason(&e)))
        })?;
        let stem = path.file_stem().map_or_else(|| name_or_path.into(), |s| s.to_string_lossy().into_owned());
        let directory = path.parent().unwrap_or_else(|| Path::new(""));
        Self::layered(name_or_path, &stem, text, Some(directory), sets)
    }

    /// A scenario from TOML text; `name` stands for the file in messages, table files are looked for in `directory`.
    ///
    /// # Errors
    /// As [`Scenario::resolve`].
    pub fn from_text(name: &str, text: &str, directory: &Path, sets: &[String]) -> Result<Self, ScenarioError> {
        Self::layered(name, name, text.into(), Some(directory), sets)
    }

    /// A scenario that somebody else sent: as resolved text, which names no files. Nobody else's text opens files here.
    ///
    /// # Errors
    /// As [`Scenario::resolve`].
    pub fn from_link(text: &str) -> Result<Self, ScenarioError> {
        Self::layered("scenario", "scenario", text.into(), None, &[])
    }

    /// The resolved scenario as TOML, table rows in line; reads back equal.
    #[must_use]
    pub fn to_toml(&self) -> String {
        // The structs have only string keys and plain values, which always serialize.
        toml::to_string(self).unwrap_or_default()
    }

    fn layered(
        place_name: &str,
        stem: &str,
        text: String,
        directory: Option<&Path>,
        sets: &[String],
    ) -> Result<Self, ScenarioError> {
        let (mut all, _) = document(BUILTIN[0].0, BUILTIN[0].1.into(), None)?;
        let (over, layer) = document(place_name, text, directory)?;
        all.insert("name".into(), Value::String(stem.into()));
        merge(&mut all, over);
        let mut layers = vec![layer];
        for assignment in sets {
            layers.push(set(&mut all, assignment)?);
        }
        fill_onboard(&mut all);
        let all = Value::Table(all);
        let scenario: Self =
            serde_path_to_error::deserialize(all.clone()).map_err(|e| refused(&layers, e.path(), e.inner()))?;
        check_ranges(&layers, &all)?;
        check::consistent(&scenario)
            .map_err(|(path, what)| ScenarioError::new(format!("{}: {what}", place(&layers, &path))))?;
        Ok(scenario)
    }
}

fn no_such_scenario(name: &str) -> ScenarioError {
    let names = Scenario::builtin_names().join(", ");
    ScenarioError::new(format!("{name}: neither a built-in scenario ({names}) nor a file"))
}

/// A deserialization error as a sentence with its place.
fn refused(layers: &[Layer], path: &serde_path_to_error::Path, inner: &toml::de::Error) -> ScenarioError {
    let segments: Vec<String> = dotted(path).split('.').map(String::from).collect();
    let segments = as_written(layers, &segments);
    ScenarioError::new(format!("{}: {}", place(layers, segments), explain(&segments.join("."), inner.message())))
}

/// A belief that nobody wrote is a copy of its nominal twin: the twin is what to name.
fn as_written<'a>(layers: &[Layer], path: &'a [String]) -> &'a [String] {
    match path {
        [onboard, nominal @ ..] if onboard == "onboard" && !layers.iter().any(|layer| layer.mentions(path)) => nominal,
        _ => path,
    }
}

/// serde's path with indices as segments: `orbiter.0.name`.
fn dotted(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    let segments: Vec<String> = path
        .iter()
        .filter_map(|segment| match segment {
            Segment::Seq { index } => Some(index.to_string()),
            Segment::Map { key } => Some(key.clone()),
            Segment::Enum { variant } => Some(variant.clone()),
            Segment::Unknown => None,
        })
        .collect();
    segments.join(".")
}

/// Every number finite and within its range.
fn check_ranges(layers: &[Layer], all: &Value) -> Result<(), ScenarioError> {
    for (path, x) in numbers(all) {
        let Some(range) = range_of(&path) else { continue };
        if !(x >= range.min && x <= range.max) {
            let path = as_written(layers, &path);
            let (place, field) = (place(layers, path), path.join("."));
            let allowed = format!("{} to {} {}", range.min, range.max, range.unit);
            let what = if x.is_finite() { "is outside" } else { "is not a finite number; allowed:" };
            return Err(ScenarioError::new(format!("{place}: {field} = {x} {what} {}", allowed.trim_end())));
        }
    }
    Ok(())
}

/// Fills what `[onboard.*]` leaves open from the nominal tables.
fn fill_onboard(all: &mut Table) {
    let said = match all.remove("onboard") {
        None => Table::new(),
        Some(Value::Table(said)) => said,
        Some(other) => {
            all.insert("onboard".into(), other);
            return;
        }
    };
    let mut onboard = Table::new();
    for part in ["vehicle", "planet", "atmosphere", "sensors"] {
        let Some(Value::Table(nominal)) = all.get(part) else { continue };
        let mut nominal = nominal.clone();
        nominal.remove("density_scale");
        nominal.remove("perturbation");
        thin(&mut nominal, "aero_table", MAX_AERO_ROWS);
        thin(&mut nominal, "rows", MAX_ATMOSPHERE_ROWS);
        onboard.insert(part.into(), Value::Table(nominal));
    }
    merge(&mut onboard, said);
    all.insert("onboard".into(), Value::Table(onboard));
}

/// Keeps as many evenly spread rows of a table as the flight software can hold, first and last among them.
fn thin(table: &mut Table, field: &str, capacity: usize) {
    if let Some(Value::Array(rows)) = table.get_mut(field)
        && rows.len() > capacity
    {
        let last = rows.len() - 1;
        *rows = (0..capacity).map(|k| rows[k * last / (capacity - 1)].clone()).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(toml: &str) -> Result<Scenario, String> {
        Scenario::from_text("my.toml", toml, Path::new(""), &[]).map_err(|e| e.message)
    }

    fn sets(assignments: &[&str]) -> Result<Scenario, String> {
        let assignments: Vec<String> = assignments.iter().map(|s| (*s).to_owned()).collect();
        Scenario::resolve("msl", &assignments).map_err(|e| e.message)
    }

    /// A folder of its own for the files of one test.
    fn folder(name: &str, files: &[(&str, &str)]) -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("hil-sim-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for (file, text) in files {
            std::fs::write(folder.join(file), text).unwrap();
        }
        folder
    }

    #[test]
    fn every_builtin_scenario_resolves_and_reads_back_equal() {
        for name in Scenario::builtin_names() {
            let scenario = Scenario::builtin(name).unwrap();
            assert_eq!(scenario.name, name);
            assert_eq!(text(&scenario.to_toml()).as_ref(), Ok(&scenario));
        }
    }

    #[test]
    fn builtins_differ_from_msl_only_where_they_say() {
        let msl = Scenario::builtin("msl").unwrap();
        let direct = Scenario::builtin("msl-direct").unwrap();
        assert!(direct.orbiter.is_empty() && msl.orbiter.len() == 1);
        assert_eq!(Scenario { name: msl.name.clone(), orbiter: msl.orbiter.clone(), ..direct }, msl);
        let beacon = Scenario::builtin("msl-beacon").unwrap();
        assert_eq!((beacon.orbiter.len(), beacon.beacon.len()), (1, 1));
    }

    #[test]
    fn each_mistake_in_a_file_gets_one_sentence_with_its_place() {
        let cases: &[(&str, &str)] = &[
            (
                "[entry]\naltitude_kn = 125.0",
                "my.toml, line 2: unknown field `entry.altitude_kn`, did you mean `altitude_km`? the fields are longitude_deg, latitude_deg, altitude_km, speed_mps, flight_path_angle_deg, heading_deg, position_km, velocity_mps",
            ),
            (
                "\n[vehicel]\nmass_kg = 1.0",
                "my.toml, line 2: unknown field `vehicel`, did you mean `vehicle`? the fields are name,",
            ),
            (
                "[vehicle]\nmass_kg = \"heavy\"",
                "my.toml, line 2: vehicle.mass_kg: found string \"heavy\", where a number is expected",
            ),
            ("entry = 5", "my.toml, line 1: entry: found the whole number `5`, where a table is expected"),
            (
                "[guidance]\nmax_iterations = 300",
                "my.toml, line 2: guidance.max_iterations: found the whole number `300`, where a whole number from 0 to 255 is expected",
            ),
            (
                "[vehicle]\n\nmass_kg = nan",
                "my.toml, line 3: vehicle.mass_kg = NaN is not a finite number; allowed: 1 to 1000000 kg",
            ),
            ("[entry]\naltitude_km = 1e9", "my.toml, line 2: entry.altitude_km = 1000000000 is outside 1 to 1000 km"),
            (
                "[onboard.vehicle]\nmass_kg = -3",
                "my.toml, line 2: onboard.vehicle.mass_kg = -3 is outside 1 to 1000000 kg",
            ),
            (
                "[deploy]\ntrigger = \"altitude\"",
                "my.toml, line 2: deploy.trigger = \"altitude\" is not known; the choices are speed, range",
            ),
            (
                "[deploy]\nspeed_window_mps = [500, 400]",
                "my.toml, line 2: deploy.speed_window_mps: the lowest value 500 must be less than the highest 400",
            ),
            (
                "[deploy.box]\nmach = [1.0]",
                "my.toml, line 2: deploy.box.mach: invalid length 1, expected an array of length 2",
            ),
            (
                "[entry]\nposition_km = [1, 2, 3]\nspeed_mps = 5000",
                "my.toml, line 1: entry: `position_km` and `speed_mps` exclude each other",
            ),
            (
                "[entry]\nposition_km = [1, 2, 3]",
                "my.toml, line 1: entry: `position_km` needs `velocity_mps` beside it",
            ),
            (
                "[atmosphere]\nkind = \"table\"",
                "my.toml, line 2: atmosphere: kind is \"table\", but no `file` is given",
            ),
            (
                "[atmosphere]\nkind = \"cubic\"",
                "my.toml, line 2: atmosphere.kind = \"cubic\" is not known; the choices are exponential, table",
            ),
            (
                "[atmosphere]\nrows = [[0, 0.01], [10, 0.001]]",
                "my.toml, line 2: atmosphere: a table is given, but kind is \"exponential\"",
            ),
            (
                "[atmosphere]\nkind = \"table\"\nrows = [[10, 0.01], [10, 0.001]]",
                "my.toml, line 3: atmosphere.rows: the first column must rise from row to row, but 10 follows 10",
            ),
            (
                "[atmosphere]\nkind = \"table\"\nrows = [[10, 0.01, 1, 2]]",
                "my.toml, line 3: atmosphere.rows.0: a row has 4 values",
            ),
            (
                "[[orbiter]]\nname = \"low\"\nsemi_major_axis_km = 3500",
                "my.toml, line 1: field `orbiter.0.eccentricity` is missing",
            ),
            (
                "[[orbiter]]\nname = \"low\"\nsemi_major_axis_km = 3500\neccentricity = 0.5\ninclination_deg = 0\nraan_deg = 0\narg_periapsis_deg = 0\ntrue_anomaly_deg = 0",
                "my.toml, line 3: orbiter.0: its periapsis of 1750.0 km lies below the surface at 3397.2 km",
            ),
            (
                "[[beacon]]\nname = \"lamp\"\nlongitude_deg = 0\nlatitude_deg = 0\naltitude_km = 0\n[[beacon]]\nname = \"lamp\"\nlongitude_deg = 1\nlatitude_deg = 0\naltitude_km = 0",
                "my.toml, line 7: two radio sources have the name \"lamp\"",
            ),
            ("name = \"\"", "my.toml, line 1: name is empty"),
            (
                "[entry]\nposition_km = [0, 0, 3000]\nvelocity_mps = [0, 5000, 0]",
                "my.toml, line 2: entry.position_km lies at an altitude of -397.2 km; allowed: 1 to 1000 km",
            ),
            (
                "[entry]\nposition_km = [0, 0, 3520]\nvelocity_mps = [0, 1, 0]",
                "my.toml, line 3: entry.velocity_mps is 1.0 m/s relative to the planet; allowed: 100 to 15000 m/s",
            ),
            (
                "[planet]\nmu_m3ps2 = 1e12",
                "my.toml, line 2: planet.mu_m3ps2 = 1e12 and planet.radius_km = 3397.2 make a surface gravity of 0.087 m/s²; allowed: 0.1 to 100 m/s²",
            ),
            (
                "[guidance]\npredictor_step_s = 0.5",
                "my.toml, line 2: guidance.predictor_step_s = 0.5 divides the prediction_horizon_s of 600 into 1200 steps; allowed: at most 1000",
            ),
            (
                "[sensors.radio]\nrate_hz = 3",
                "my.toml, line 2: sensors.radio.rate_hz = 3 is not a whole number of 50 Hz frames",
            ),
            (
                "[dispersions]\nmass = { distribution = \"uniform\", three_sigma = 1 }",
                "my.toml, line 2: dispersions.mass: distribution \"uniform\" takes `bounds = [lowest, highest]` and nothing else",
            ),
            (
                "[dispersions.mass]\ndistribution = \"uniform\"\nbounds = [0.2, 0.1]",
                "my.toml, line 3: dispersions.mass.bounds: the lowest value 0.2 must not exceed the highest 0.1",
            ),
            (
                "[dispersions]\nmass.three_sigma = -0.1",
                "my.toml, line 2: dispersions.mass.three_sigma = -0.1 is outside 0 to 0.5",
            ),
            (
                "[[fault]]\nkind = \"bit-flips\"\ntarget = \"radio\"\nstart_s = 1\nduration_s = 1",
                "my.toml, line 2: fault.0: kind \"bit-flips\" does not fit its target; it can have dropout, bias",
            ),
            (
                "[[fault]]\nkind = \"bias\"\ntarget = \"radio\"\nstart_s = 1\nduration_s = 1",
                "my.toml, line 1: fault.0: kind \"bias\" takes `value`, but has no parameters",
            ),
            (
                "[vehicle]\naero_table = \"nowhere.csv\"",
                "my.toml, line 2: nowhere.csv: the table cannot be read: no such file",
            ),
            ("[vehicle]\nmass_kg = ", "my.toml, line 2: not valid TOML: "),
        ];
        for (toml, sentence) in cases {
            let said = text(toml).expect_err(toml);
            assert!(said.starts_with(sentence), "{toml}\n  said:     {said}\n  expected: {sentence}");
            assert!(!said.contains('\n'), "more than one line: {said}");
        }
    }

    #[test]
    fn each_mistake_in_a_set_names_the_set() {
        let cases: &[(&[&str], &str)] = &[
            (&["vehicle.mass_kg"], "--set vehicle.mass_kg: expected dotted.field=value"),
            (&["vehicle..mass_kg=1"], "--set vehicle..mass_kg=1: `vehicle..mass_kg` is not a dotted field name"),
            (&["vehicle.mas_kg=1"], "--set vehicle.mas_kg=1: unknown field `vehicle.mas_kg`, did you mean `mass_kg`?"),
            (&["vehicle.mass_kg=-1"], "--set vehicle.mass_kg=-1: vehicle.mass_kg = -1 is outside 1 to 1000000 kg"),
            (
                &["vehicle.mass_kg=heavy"],
                "--set vehicle.mass_kg=heavy: vehicle.mass_kg: found string \"heavy\", where a number is expected",
            ),
            (&["vehicle.mass_kg=1\nx=2"], "--set vehicle.mass_kg=1: the value must stand on one line"),
            (
                &["orbiter.-1.name=x"],
                "--set orbiter.-1.name=x: `orbiter` is a list: behind its name stands an index from 0 to 0",
            ),
            (&["vehicle.mass_kg.x=1"], "--set vehicle.mass_kg.x=1: `vehicle.mass_kg` is a value, not a table"),
            (
                &["orbiter.1.eccentricity=0"],
                "--set orbiter.1.eccentricity=0: `orbiter` has no index 1: the indices go from 0 to 0",
            ),
            (&["beacon.0.altitude_km=0"], "--set beacon.0.altitude_km=0: `beacon` is empty, so it has no index 0"),
            (
                &["orbiter.0.eccentricty=0"],
                "--set orbiter.0.eccentricty=0: unknown field `orbiter.0.eccentricty`, did you mean `eccentricity`?",
            ),
        ];
        for (assignments, sentence) in cases {
            let said = sets(assignments).expect_err(sentence);
            assert!(said.starts_with(sentence), "said:     {said}\nexpected: {sentence}");
        }
    }

    #[test]
    fn a_set_changes_the_field_and_the_belief_that_follows_it() {
        let changed = sets(&["orbiter.0.inclination_deg=30", "vehicle.mass_kg=3000", "deploy.trigger=range"]).unwrap();
        assert_eq!(changed.orbiter[0].inclination_deg, 30.0);
        assert_eq!((changed.vehicle.mass_kg, changed.onboard.vehicle.mass_kg), (3000.0, 3000.0));
        assert_eq!(changed.deploy.trigger, fsw_core::link::parameters::TriggerKind::Range);
        let doubted = sets(&["onboard.vehicle.mass_kg=3000"]).unwrap();
        assert_eq!((doubted.vehicle.mass_kg, doubted.onboard.vehicle.mass_kg), (2804.0, 3000.0));
    }

    #[test]
    fn a_cartesian_entry_by_set_replaces_the_spherical_one() {
        let scenario = sets(&["entry.position_km=[3522.5, 0, 0]", "entry.velocity_mps=[-1345, 5338, 0]"]).unwrap();
        assert!(matches!(scenario.entry, super::super::Entry::Cartesian { .. }));
        assert_eq!(text(&scenario.to_toml()), Ok(scenario));
    }

    #[test]
    fn table_files_are_found_beside_the_scenario_and_travel_with_it() {
        let folder = folder(
            "tables",
            &[
                (
                    "air.csv",
                    "# Mars, roughly\naltitude_km,density_kgpm3,temperature_k\n0,0.0158,210\n40,2e-4,150\n125,1e-8,140\n",
                ),
                ("aero.csv", "mach, cl, cd\n1, 0.30, 1.3\n30, 0.35, 1.45\n"),
                (
                    "flight.toml",
                    "[vehicle]\naero_table = \"aero.csv\"\n[atmosphere]\nkind = \"table\"\nfile = \"air.csv\"\n",
                ),
            ],
        );
        let path = folder.join("flight.toml");
        let scenario = Scenario::resolve(&path.to_string_lossy(), &[]).unwrap();
        assert_eq!(scenario.name, "flight");
        let aero = scenario.vehicle.aero_table.as_ref().unwrap();
        assert_eq!((aero[0].drag_coefficient, aero[0].lift_coefficient), (1.3, 0.3));
        assert_eq!(scenario.onboard.atmosphere.rows, scenario.atmosphere.rows);
        // The resolved text needs no file any more.
        assert_eq!(text(&scenario.to_toml()), Ok(scenario));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_table_too_long_for_the_flight_software_is_thinned_on_board() {
        let rows: Vec<String> = (0..200).map(|k| format!("[{k}, {:e}]", 0.0158 / f64::from(k + 1))).collect();
        let scenario = text(&format!("[atmosphere]\nkind = \"table\"\nrows = [{}]", rows.join(","))).unwrap();
        let (truth, onboard) = (scenario.atmosphere.rows.unwrap(), scenario.onboard.atmosphere.rows.unwrap());
        assert_eq!((truth.len(), onboard.len()), (200, MAX_ATMOSPHERE_ROWS));
        assert_eq!((onboard[0], onboard[MAX_ATMOSPHERE_ROWS - 1]), (truth[0], truth[199]));
    }

    #[test]
    fn each_mistake_in_a_table_names_file_and_line() {
        let cases: &[(&str, &str)] = &[
            ("", "the table is empty; its first line must name the columns mach, cd, cl"),
            ("mach,cd\n1,2\n", ", line 1: column `cl` is missing; the columns are mach, cd, cl"),
            ("mach,cd,lift\n", ", line 1: unknown column `lift`; the columns are mach, cd, cl"),
            ("\u{feff}mach,cd,lift\r\n", ", line 1: unknown column `lift`; the columns are mach, cd, cl"),
            ("mach,cd,cl,cd\n", ", line 1: column `cd` stands twice"),
            ("mach,cd,cl\n1,1.4,0.3\n", "the table has 1 data lines where at least 2 are needed"),
            ("mach,cd,cl\n1,1.4\n", ", line 2: 2 values where the first line names 3 columns"),
            ("mach,cd,cl\n1,1.4,x\n", ", line 2: cl: \"x\" is not a number"),
            ("mach,cd,cl\n1,NaN,0.3\n", ", line 2: cd = NaN is outside 0.01 to 10"),
            ("mach,cd,cl\n2,1.4,0.3\n\n1,1.4,0.3\n", ", line 4: mach must rise from line to line, but 1 follows 2"),
        ];
        for (k, (csv, sentence)) in cases.iter().enumerate() {
            let folder = folder(&format!("bad-table-{k}"), &[("aero.csv", csv)]);
            let path = folder.join("aero.csv");
            let said = sets(&[&format!("vehicle.aero_table=\"{}\"", path.display())]).expect_err(sentence);
            assert!(
                said.contains(&format!("{}", path.display())) && said.ends_with(sentence),
                "said: {said}\nexpected: {sentence}"
            );
            std::fs::remove_dir_all(folder).unwrap();
        }
    }

    #[test]
    fn a_scenario_from_the_link_opens_no_files() {
        for toml in ["[vehicle]\naero_table = \"/etc/hostname\"", "[atmosphere]\nkind = \"table\"\nfile = \"air.csv\""]
        {
            let said = Scenario::from_link(toml).unwrap_err().message;
            assert!(said.ends_with("comes over a link names no table files: give the rows in line"), "{said}");
        }
        let scenario = Scenario::builtin("msl-beacon").unwrap();
        assert_eq!(Scenario::from_link(&scenario.to_toml()), Ok(scenario));
    }

    #[test]
    fn a_file_without_end_is_refused_before_it_fills_the_memory() {
        let said = Scenario::resolve("/dev/zero", &[]).unwrap_err().message;
        assert_eq!(said, "/dev/zero: the scenario cannot be read: it is longer than 16 MiB");
    }

    #[test]
    fn a_missing_or_unreadable_file_is_named() {
        let said = |name: &str| Scenario::resolve(name, &[]).unwrap_err().message;
        assert_eq!(
            said("mls"),
            "mls: neither a built-in scenario (msl, msl-ideal, msl-beacon, msl-direct, paper-exp40, msl-winds, msl-hard, low-beta, high-lift, southern-winter) nor a file"
        );
        assert_eq!(said("no/such.toml"), "no/such.toml: the scenario cannot be read: no such file");
        let folder = folder("unreadable", &[]);
        assert!(said(&folder.to_string_lossy()).ends_with("the scenario cannot be read: it is a directory"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
