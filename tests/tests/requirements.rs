//! Every numbered requirement names tests that exist, or gates of `cargo xtask test` by their titles.

use std::collections::BTreeSet;
use std::fs;

use system_tests::{rust_sources, workspace};

/// Rows of the requirement tables: identifier and the test names in backticks of the last column.
fn rows(text: &str) -> Vec<(String, Vec<String>)> {
    text.lines()
        .filter(|line| line.starts_with("| R-"))
        .map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let tests = cells.last().expect("a last column").split('`').skip(1).step_by(2).map(str::to_owned).collect();
            (cells[0].to_owned(), tests)
        })
        .collect()
}

#[test]
fn every_requirement_names_tests_that_exist() {
    let text = fs::read_to_string(workspace().join("doc/requirements.md")).expect("doc/requirements.md");
    let sources: String =
        ["fsw-core", "fsw-sqrt", "hil-noise", "hil-sim", "fsw-study", "fsw-host", "firmware", "tests", "xtask"]
            .iter()
            .flat_map(|folder| rust_sources(folder))
            .map(|(_, text)| text)
            .collect();
    let mut seen = BTreeSet::new();
    let rows = rows(&text);
    assert!(rows.len() >= 20, "only {} requirements found: is the table still readable?", rows.len());
    for (id, tests) in rows {
        assert!(seen.insert(id.clone()), "{id} appears twice");
        assert!(!tests.is_empty(), "{id} names no test");
        for test in tests {
            let is_test = sources.contains(&format!("fn {test}("));
            let is_gate = sources.contains(&format!("    (\"{test}\", "));
            assert!(is_test || is_gate, "{id} names `{test}`, which is neither a test nor a gate");
        }
    }
}
