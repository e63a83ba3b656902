//! `scenario`: list, show and check.

use hil_sim::scenario::Scenario;

use crate::cli::ScenarioCommand;
use crate::error::HostError;
use crate::output::print;

/// Runs the command; it succeeds or refuses its input.
///
/// # Errors
/// Bad input.
pub fn run(command: &ScenarioCommand) -> Result<bool, HostError> {
    match command {
        ScenarioCommand::List => print(&list())?,
        ScenarioCommand::Show { name, set } => print(&Scenario::resolve(name, set)?.to_toml())?,
        ScenarioCommand::Check { file, set } => {
            let scenario = Scenario::resolve(file, set)?;
            print(&format!("{file}: scenario \"{}\" is sound\n", scenario.name))?;
        }
    }
    Ok(true)
}

/// One line per built-in scenario: its name and the first sentence of its file.
fn list() -> String {
    let line = |name: &str| {
        let about = first_sentence(Scenario::builtin_text(name).unwrap_or_default());
        format!("{name:<14} {about}\n")
    };
    Scenario::builtin_names().into_iter().map(line).collect()
}

/// The first sentence of the comment at the head of a file: up to a full stop, a colon or a semicolon before a space.
fn first_sentence(text: &str) -> String {
    let lines: Vec<_> = text.lines().map_while(|line| line.strip_prefix('#')).map(str::trim).collect();
    let comment = lines.join(" ");
    let ends = |at: &usize| *at > 20 && !comment[..*at].ends_with("et al");
    let marks = [". ", ": ", "; "].iter().flat_map(|mark| comment.match_indices(mark)).map(|(at, _)| at);
    let end = marks.filter(ends).min().unwrap_or(comment.len());
    comment[..end].trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_scenario_is_listed_with_what_it_is() {
        let list = list();
        assert!(list.lines().all(|line| !line.ends_with("et al")), "{list}");
        for name in Scenario::builtin_names() {
            let line = list.lines().find(|l| l.split_whitespace().next() == Some(name)).unwrap_or_default();
            assert!(line.split_whitespace().count() > 1, "{name} has no description: {line:?}");
        }
    }
}
