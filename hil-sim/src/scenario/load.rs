//! From text to [`Scenario`]: the file over the default scenario, then `--set`, then tables, then the onboard belief.

use toml::{Table, Value};

use super::{Scenario, ScenarioError};

/// Built-in scenarios by name; the first is the default and has every field.
const BUILTIN: &[(&str, &str)] = &[
    ("msl", include_str!("builtin/msl.toml")),
    ("msl-ideal", include_str!("builtin/msl-ideal.toml")),
    ("msl-beacon", include_str!("builtin/msl-beacon.toml")),
    ("msl-direct", include_str!("builtin/msl-direct.toml")),
    ("paper-exp40", include_str!("builtin/paper-exp40.toml")),
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
        Self::resolve(name, &[])
    }

    /// A built-in scenario or a TOML file, with `--set dotted.field=value` applied.
    ///
    /// # Errors
    /// One sentence on the first thing that is wrong.
    pub fn resolve(name_or_path: &str, sets: &[String]) -> Result<Self, ScenarioError> {
        let _ = sets;
        let text = match Self::builtin_text(name_or_path) {
            Some(text) => text.to_owned(),
            None => std::fs::read_to_string(name_or_path).map_err(fail)?,
        };
        let mut all: Table = BUILTIN[0].1.parse().map_err(fail)?;
        merge(&mut all, text.parse().map_err(fail)?);
        fill_onboard(&mut all);
        Value::Table(all).try_into().map_err(fail)
    }

    /// The resolved scenario as TOML; reads back equal.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }
}

fn fail(e: impl std::fmt::Display) -> ScenarioError {
    ScenarioError { message: e.to_string() }
}

/// Lays `over` over `base`: tables field by field, everything else as a whole.
fn merge(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(below, above),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Fills what `[onboard.*]` leaves open from the nominal tables.
fn fill_onboard(all: &mut Table) {
    let said = match all.remove("onboard") {
        Some(Value::Table(said)) => said,
        _ => Table::new(),
    };
    let mut onboard = Table::new();
    for part in ["vehicle", "planet", "atmosphere", "sensors"] {
        if let Some(Value::Table(nominal)) = all.get(part) {
            let mut nominal = nominal.clone();
            if part == "atmosphere" {
                nominal.remove("density_scale");
                nominal.remove("perturbation");
            }
            onboard.insert(part.into(), Value::Table(nominal));
        }
    }
    merge(&mut onboard, said);
    all.insert("onboard".into(), Value::Table(onboard));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_builtin_scenario_resolves_and_reads_back_equal() {
        for name in Scenario::builtin_names() {
            let scenario = Scenario::builtin(name).unwrap();
            assert_eq!(scenario.name, name);
            let again: Scenario = toml::from_str(&scenario.to_toml()).unwrap();
            assert_eq!(again, scenario);
        }
    }
}
