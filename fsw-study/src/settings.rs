//! A study's TOML file: text to settings, and ranges, each with one sentence for what is wrong.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Settings that are read and written where they are defined: what serde makes of them is compiled there, once.
pub trait Stored: Sized + Default {
    /// The settings of a TOML file, in range.
    ///
    /// # Errors
    /// One sentence for the first thing that is wrong.
    fn from_toml(text: &str) -> Result<Self, String>;

    /// As TOML.
    ///
    /// # Errors
    /// They cannot be written as TOML.
    fn to_toml(&self) -> Result<String, String>;
}

/// TOML text; the error is one line with the field or the place.
///
/// # Errors
/// It is not TOML, or has a field that is missing, unknown or of another type.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    typed(table(text)?)
}

/// TOML text of which every field may be missing: the defaults of the whole take its place, whatever the default of the
/// field's own type is. A list is replaced as one.
///
/// # Errors
/// It is not TOML, or has a field that is unknown or of another type.
pub fn parse_over_defaults<T: DeserializeOwned + Serialize + Default>(text: &str) -> Result<T, String> {
    let mut whole = toml::Table::try_from(T::default()).map_err(|e| e.to_string())?;
    lay_over(&mut whole, table(text)?, "")?;
    typed(whole)
}

/// Settings as TOML.
///
/// # Errors
/// They cannot be written as TOML.
pub fn write<T: Serialize>(settings: &T) -> Result<String, String> {
    toml::to_string(settings).map_err(|e| e.to_string())
}

/// A table is laid over the table of its place, field by field; `within` is the path of both, with a dot at its end.
fn lay_over(under: &mut toml::Table, over: toml::Table, within: &str) -> Result<(), String> {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(toml::Value::Table(below)), toml::Value::Table(above)) => {
                lay_over(below, above, &format!("{within}{key}."))?;
            }
            (Some(toml::Value::Table(_)), value) => {
                return Err(format!("{within}{key} must be a table, not {}", with_article(value.type_str())));
            }
            (_, value) => drop(under.insert(key, value)),
        }
    }
    Ok(())
}

/// "an array", "a string".
fn with_article(name: &str) -> String {
    let article = if name.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {name}")
}

fn table(text: &str) -> Result<toml::Table, String> {
    text.parse().map_err(|e: toml::de::Error| {
        let line = e.span().map_or(1, |span| text.get(..span.start).unwrap_or("").lines().count().max(1));
        format!("line {line}: {}", e.message().lines().next().unwrap_or("not TOML"))
    })
}

fn typed<T: DeserializeOwned>(table: toml::Table) -> Result<T, String> {
    serde_path_to_error::deserialize(table).map_err(|e| {
        let what = e.inner().message().lines().next().unwrap_or_default().to_owned();
        if e.path().iter().next().is_none() { what } else { format!("{}: {what}", e.path()) }
    })
}

/// Ok for a number from `low` to `high`; not a number is refused.
///
/// # Errors
/// A sentence with the name, the value and the range.
pub fn within(name: &str, value: f64, low: f64, high: f64) -> Result<(), String> {
    if value >= low && value <= high { Ok(()) } else { Err(format!("{name} is {value}; it must be {low} to {high}")) }
}

/// [`within`] for whole numbers.
///
/// # Errors
/// As there.
pub fn whole(name: &str, value: u64, low: u64, high: u64) -> Result<(), String> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(format!("{name} is {value}; it must be {low} to {high}")) }
}

/// Ok for a rate of readings with a whole number of steps from one to the next.
///
/// # Errors
/// A sentence with the name, the rate and the step.
pub fn divides(name: &str, rate_hz: f64, step_s: f64) -> Result<(), String> {
    within(name, rate_hz, 1e-3, 1.0 / step_s)?;
    let between = 1.0 / (rate_hz * step_s);
    if (between - between.round()).abs() > 1e-6 * between {
        return Err(format!(
            "{name} is {rate_hz}; a whole number of steps of {step_s} s must lie between two readings"
        ));
    }
    Ok(())
}

/// Ok for a list that is not empty and names nothing twice.
///
/// # Errors
/// A sentence with the name of the list, and the place and the name of what is there again.
pub fn distinct<T: PartialEq>(list: &str, values: &[T], name: impl Fn(&T) -> &'static str) -> Result<(), String> {
    if values.is_empty() {
        return Err(format!("{list} must name at least one filter"));
    }
    let twice = values.iter().enumerate().find(|(at, value)| values.iter().take(*at).any(|v| v == *value));
    twice.map_or(Ok(()), |(at, value)| Err(format!("{list}[{at}] names {} twice", name(value))))
}

/// [`within`] for each of a list, which must not be empty.
///
/// # Errors
/// As there, with the place in the list.
pub fn each(name: &str, values: &[f64], low: f64, high: f64) -> Result<(), String> {
    if values.is_empty() {
        return Err(format!("{name} must hold at least one value"));
    }
    values.iter().enumerate().try_for_each(|(at, value)| within(&format!("{name}[{at}]"), *value, low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq, serde::Deserialize)]
    #[serde(default, deny_unknown_fields)]
    struct Small {
        part: Part,
    }

    #[derive(Debug, Default, PartialEq, serde::Deserialize)]
    #[serde(default, deny_unknown_fields)]
    struct Part {
        rate_hz: f64,
    }

    #[test]
    fn what_is_wrong_is_one_line_with_its_place() {
        assert_eq!(parse::<Small>("[part]\nrate_hz = 2.0").unwrap().part.rate_hz.to_bits(), 2.0f64.to_bits());
        for (text, words) in [
            ("[part]\nrate = 2.0", ["part", "unknown field `rate`"]),
            ("[part]\nrate_hz = \"fast\"", ["part.rate_hz", "string"]),
            ("[part]\n\nrate_hz = = 2", ["line 3", ""]),
        ] {
            let said = parse::<Small>(text).unwrap_err();
            assert!(!said.contains('\n') && words.iter().all(|word| said.contains(word)), "{said}");
        }
    }

    #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Pair {
        low: f64,
        high: f64,
    }

    #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Two {
        first: Pair,
        second: Pair,
    }

    impl Default for Two {
        fn default() -> Self {
            Self { first: Pair { low: 1.0, high: 2.0 }, second: Pair { low: 3.0, high: 4.0 } }
        }
    }

    #[test]
    fn a_field_that_is_missing_has_the_default_of_its_place() {
        let mut expected = Two::default();
        assert_eq!(parse_over_defaults::<Two>("").unwrap(), expected);
        expected.second.low = 0.0;
        assert_eq!(parse_over_defaults::<Two>("second.low = 0").unwrap(), expected);
        assert_eq!(parse::<Two>(&write(&expected).unwrap()).unwrap(), expected);
        for (text, words) in
            [("[third]", "third"), ("first = 1", "first must be a table, not an integer"), ("first.mid = 1", "mid")]
        {
            let said = parse_over_defaults::<Two>(text).unwrap_err();
            assert!(!said.contains('\n') && said.contains(words), "{said}");
        }
    }

    #[test]
    fn a_range_refuses_what_is_outside_and_what_is_no_number() {
        assert!(within("rate_hz", 1.0, 1.0, 2.0).is_ok() && each("sigmas", &[1.0, 2.0], 1.0, 2.0).is_ok());
        assert_eq!(within("rate_hz", 0.0, 1.0, 2.0).unwrap_err(), "rate_hz is 0; it must be 1 to 2");
        assert!(within("rate_hz", f64::NAN, 1.0, 2.0).unwrap_err().starts_with("rate_hz is NaN"));
        assert_eq!(each("sigmas", &[1.0, 3.0], 1.0, 2.0).unwrap_err(), "sigmas[1] is 3; it must be 1 to 2");
        assert!(each("sigmas", &[], 1.0, 2.0).unwrap_err().contains("at least one"));
        assert!(whole("runs", 0, 1, 9).is_err());
        assert_eq!(distinct("fly", &["a", "b", "a"], |name| *name).unwrap_err(), "fly[2] names a twice");
        assert!(distinct("fly", &["a", "b"], |name| *name).is_ok() && distinct("fly", &[""; 0], |name| *name).is_err());
    }
}
