//! What the whole-system tests share: reading the sources of the workspace.

use std::fs;
use std::path::{Path, PathBuf};

/// Root of the workspace.
#[must_use]
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests live one level below the root").to_path_buf()
}

/// All Rust sources below a folder of the workspace, with their path relative to the root.
///
/// # Panics
/// When the folder cannot be read.
#[must_use]
pub fn rust_sources(folder: &str) -> Vec<(String, String)> {
    let root = workspace();
    let mut found = Vec::new();
    let mut open = vec![root.join(folder)];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.expect("readable folder entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("readable source");
                let name = path.strip_prefix(&root).expect("below the root").display().to_string();
                found.push((name, text));
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "no sources below {folder}");
    found
}

/// The shipped sources below a folder: without test modules, whether they stand in the same file or in one of their own.
#[must_use]
pub fn shipped_sources(folder: &str) -> Vec<(String, String)> {
    let all = rust_sources(folder);
    let test_only: Vec<String> = all.iter().flat_map(|(path, text)| test_modules(path, text)).collect();
    all.into_iter()
        .filter(|(path, _)| !test_only.contains(path))
        .map(|(path, text)| (path, without_test_modules(&text)))
        .collect()
}

/// Files that a source declares as modules of its tests.
fn test_modules(path: &str, text: &str) -> Vec<String> {
    let (folder, file) = path.rsplit_once('/').unwrap_or(("", path));
    let stem = file.trim_end_matches(".rs");
    let inside = if matches!(stem, "mod" | "lib" | "main") { folder.to_owned() } else { format!("{folder}/{stem}") };
    let mut found = Vec::new();
    for after in text.split("#[cfg(test)]\n").skip(1) {
        let mut lines = after.lines();
        let first = lines.next().unwrap_or("");
        if let Some(name) = first.strip_prefix("#[path = \"") {
            found.push(format!("{folder}/{}", name.trim_end_matches("\"]")));
        } else if let Some(name) = first.strip_prefix("mod ").and_then(|rest| rest.strip_suffix(';')) {
            found.push(format!("{inside}/{name}.rs"));
            found.push(format!("{inside}/{name}/mod.rs"));
        }
    }
    found
}

fn without_test_modules(text: &str) -> String {
    let is_test_module = |at: usize| {
        let rest = &text[at..];
        rest.lines()
            .skip(2)
            .find(|line| !line.starts_with("#["))
            .is_some_and(|line| line.contains("mod ") && !line.contains("use "))
    };
    let end = text.match_indices("\n#[cfg(test)]\n").map(|(at, _)| at).find(|at| is_test_module(*at));
    text[..end.unwrap_or(text.len())].to_owned()
}
