//! Settings that a search found, as a file.

use serde::{Deserialize, Serialize};

use super::config::Settings;
use super::kind::Kind;
use crate::settings::{Stored, parse, write};

/// The settings that the project's own search found.
const SHIPPED: &str = include_str!("tuned.toml");

/// One line of the tuned settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuned {
    /// Case.
    pub case: String,
    /// Filter.
    pub filter: Kind,
    /// What the search found.
    pub settings: Settings,
}

/// What a search writes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TunedFile {
    /// The command that found them.
    pub command: String,
    /// Step that they were found for, s.
    pub step_s: f64,
    /// The settings.
    pub tuned: Vec<Tuned>,
}

impl Stored for TunedFile {
    /// No field may be missing.
    fn from_toml(text: &str) -> Result<Self, String> {
        let tuned: Self = parse(text)?;
        tuned.check()?;
        Ok(tuned)
    }

    fn to_toml(&self) -> Result<String, String> {
        write(self)
    }
}

impl TunedFile {
    /// The settings that come with the program.
    ///
    /// # Errors
    /// Never; a test reads them.
    pub fn shipped() -> Result<Self, String> {
        parse(SHIPPED)
    }

    /// One sentence about the first line out of its range.
    ///
    /// # Errors
    /// That sentence.
    pub fn check(&self) -> Result<(), String> {
        let mut lines = self.tuned.iter().enumerate();
        lines.try_for_each(|(at, line)| line.settings.check(&format!("tuned[{at}].settings")))
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::CASES;
    use super::*;

    #[test]
    fn the_shipped_settings_cover_every_filter_of_every_tuned_case_once() {
        let file = TunedFile::shipped().unwrap();
        for case in CASES.iter().filter(|case| case.is_tuned) {
            for kind in Kind::ALL.map(Kind::tuned_as) {
                let mut found = file.tuned.iter().filter(|t| t.case == case.name && t.filter == kind);
                assert!(found.next().is_some() && found.next().is_none(), "{} {kind:?}", case.name);
            }
        }
        assert!(file.command.starts_with("aeroshell study sekf") && (file.step_s - 1.0).abs() < 1e-12);
        file.check().unwrap();
    }
}
