//! What can be wrong with a scenario; every message is one clear sentence.

/// Why a scenario cannot be flown.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ScenarioError {
    /// The sentence: file, line, field, value, allowed range.
    pub message: String,
}

impl ScenarioError {
    /// From the sentence.
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { message: message.into() }
    }
}

/// A deserialization error in the words of a user. `field` is the dotted path that serde stopped at.
pub(super) fn explain(field: &str, serde_says: &str) -> String {
    let says = serde_says.trim().lines().next().unwrap_or_default();
    let quoted: Vec<&str> = says.split('`').skip(1).step_by(2).collect();
    if says.starts_with("unknown field") && !quoted.is_empty() {
        let parent = field.strip_suffix(quoted[0]).unwrap_or(field).trim_end_matches('.');
        return format!("unknown field `{}`{}", join(parent, quoted[0]), suggestion(quoted[0], &quoted[1..], "fields"));
    }
    if says.starts_with("unknown variant") && !quoted.is_empty() {
        return format!("{field} = \"{}\" is not known{}", quoted[0], suggestion(quoted[0], &quoted[1..], "choices"));
    }
    if says.starts_with("missing field") && !quoted.is_empty() {
        let parent = field.strip_suffix(quoted[0]).unwrap_or(field).trim_end_matches('.');
        return format!("field `{}` is missing", join(parent, quoted[0]));
    }
    let says = says
        .replace("invalid type: ", "found ")
        .replace("invalid value: ", "found ")
        .replace("floating point", "the number")
        .replace("integer", "the whole number")
        .replace("expected f64", "where a number is expected")
        .replace("expected u8", "where a whole number from 0 to 255 is expected")
        .replace("expected a string", "where a string is expected")
        .replace("expected a boolean", "where true or false is expected");
    let says = match says.split_once(", expected struct ") {
        Some((found, _)) => format!("{found}, where a table is expected"),
        None => says,
    };
    if field.is_empty() || field == "." { says } else { format!("{field}: {says}") }
}

fn join(parent: &str, field: &str) -> String {
    if parent.is_empty() { field.into() } else { format!("{parent}.{field}") }
}

/// "; did you mean …" with the nearest candidate, and all of them.
fn suggestion(wrong: &str, candidates: &[&str], what: &str) -> String {
    let nearest = candidates
        .iter()
        .map(|candidate| (strsim::jaro_winkler(wrong, candidate), candidate))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let meant = nearest.map_or(String::new(), |(_, name)| format!(", did you mean `{name}`?"));
    let link = if meant.is_empty() { ";" } else { "" };
    format!("{meant}{link} the {what} are {}", candidates.join(", "))
}
