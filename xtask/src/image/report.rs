//! An inspection as text.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};
use xshell::Shell;

use super::stack::{Bound, Source, frames_in_notes};
use super::{Inspection, inspect};

/// Prints what is known of an image; fails when it holds something forbidden.
pub fn show(shell: &Shell, image: &Path, notes: Option<&Path>) -> Result<()> {
    let frames = match notes {
        Some(path) => {
            let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
            frames_in_notes(&text)
        }
        None => HashMap::new(),
    };
    // The tools run from the root of the workspace.
    let inspection = inspect(shell, &std::path::absolute(image)?, &frames)?;
    print!("{}", text(&inspection));
    fail_on_violations(&inspection)
}

/// An error that names everything forbidden in the image.
pub fn fail_on_violations(inspection: &Inspection) -> Result<()> {
    if inspection.violations.is_empty() {
        return Ok(());
    }
    let lines: Vec<&str> = inspection.violations.iter().map(|violation| violation.text.as_str()).collect();
    bail!("the image holds what must not fly:\n  {}", lines.join("\n  "))
}

/// Where flash, RAM and stack go.
pub fn text(inspection: &Inspection) -> String {
    let mut text = sections(inspection);
    text += &inspection.stack.as_ref().map(stack).unwrap_or_default();
    for helper in &inspection.integer_helpers {
        let _ = writeln!(text, "integer routine of the run-time library: {helper}");
    }
    text
}

/// Flash and RAM by section.
fn sections(inspection: &Inspection) -> String {
    let mut text = format!("{:<20} {:>9} {:>9}\n", "section", "flash, B", "RAM, B");
    let rows = inspection.sections.iter().map(|section| (section.name.as_str(), section.flash, section.ram));
    for (name, flash, ram) in rows.chain([("all", inspection.flash, inspection.ram)]) {
        let _ = writeln!(text, "{name:<20} {flash:>9} {ram:>9}");
    }
    text
}

/// The deepest path of each entry, function by function.
fn stack(bound: &Bound) -> String {
    let mut text = String::new();
    for path in &bound.paths {
        let place = if path.on_own_stack { ", on a stack of its own" } else { "" };
        let _ = writeln!(text, "{:>7}  {}{place}", path.bytes(), path.entry);
        if path.hardware_bytes > 0 {
            let _ = writeln!(text, "  {:>7}  registers saved by the processor", path.hardware_bytes);
        }
        for step in &path.steps {
            let note = if step.source == Source::Instructions { "  (from its instructions)" } else { "" };
            let _ = writeln!(text, "  {:>7}  {}{note}", step.bytes, step.name);
        }
    }
    let _ = writeln!(text, "{:>7}  bytes of stack at most", bound.bytes());
    if bound.own_bytes() > 0 {
        let _ = writeln!(text, "{:>7}  bytes of the handlers' own stack at most", bound.own_bytes());
    }
    text
}
