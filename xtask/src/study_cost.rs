//! `cargo xtask study-cost`: counts what a step of every filter of the studies costs on the Cortex-M7, and holds it against
//! `fsw-study/m7-cost.toml`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use anyhow::{Context, Result, bail, ensure};
use toml_edit::DocumentMut;
use xshell::{Shell, cmd};

use crate::budgets::written;
use crate::symbols::target_directory;

/// What was counted last.
const FILE: &str = "fsw-study/m7-cost.toml";
/// The image that counts, and what it is built for.
const IMAGE: &str = "study-image";
const TRIPLE: &str = "thumbv7em-none-eabihf";
/// A count may differ by this share from the recorded one.
const TOLERANCE: f64 = 0.02;
const HEAD: &str = "\
# What a step of every filter of the studies costs on the Cortex-M7: instructions, the mean over a flight of its study as it
# flies when nothing is set; of a filter that stops on its way, up to that step.
# Written by `cargo xtask study-cost --bless`; held to 2 % by `cargo xtask test --only \"filters of the studies\"`.
";

/// A line of what the image prints.
#[derive(Debug)]
struct Line {
    study: String,
    filter: String,
    /// Of a step.
    instructions: i64,
    /// Steps that were flown, with the one that stopped it if one did.
    steps: u64,
    /// Steps of the whole flight.
    of: u64,
}

/// Counts; `bless` records instead of comparing.
pub fn run(shell: &Shell, bless: bool) -> Result<()> {
    let counted = parse(&count(shell)?)?;
    println!("{}", table(&counted));
    if bless {
        shell.write_file(FILE, text(&counted))?;
        return Ok(());
    }
    let text = shell.read_file(FILE)?;
    let failures = differences(&counted, &recorded(&text).context(FILE)?);
    if failures.is_empty() {
        return Ok(());
    }
    bail!("{}\n  if that is meant: cargo xtask study-cost --bless", failures.join("\n  "))
}

/// What the image prints.
fn count(shell: &Shell) -> Result<String> {
    cmd!(shell, "cargo build --quiet --package {IMAGE} --profile flight --target {TRIPLE}").quiet().run()?;
    let image = target_directory(shell)?.join(TRIPLE).join("flight").join(IMAGE);
    let machine = ["-M", "mps2-an500", "-icount", "shift=0", "-nic", "none"];
    let silent = ["-display", "none", "-monitor", "none", "-nodefaults"];
    let words = ["-semihosting-config", "enable=on,target=native"];
    let output = cmd!(shell, "qemu-system-arm {machine...} {silent...} {words...} -kernel {image}");
    output.quiet().ignore_stderr().read().context("the image that counts did not come to its end")
}

fn parse(said: &str) -> Result<Vec<Line>> {
    let lines: Vec<Line> = said
        .lines()
        .map(|line| parse_line(line).with_context(|| format!("the image said {line:?}")))
        .collect::<Result<_>>()?;
    ensure!(!lines.is_empty(), "the image said nothing");
    Ok(lines)
}

fn parse_line(line: &str) -> Result<Line> {
    let words: Vec<&str> = line.split('\t').collect();
    let [study, filter, instructions, steps, of] = words[..] else { bail!("five words were expected") };
    let (study, filter) = (study.to_owned(), filter.to_owned());
    Ok(Line { study, filter, instructions: instructions.parse()?, steps: steps.parse()?, of: of.parse()? })
}

/// The file.
fn text(counted: &[Line]) -> String {
    let mut text = HEAD.to_owned();
    let mut last = "";
    for Line { study, filter, instructions, steps, of } in counted {
        if study != last {
            let _ = writeln!(text, "\n[{study}]");
            last = study;
        }
        #[allow(clippy::cast_precision_loss)] // far below 2^53
        let _ = write!(text, "\"{filter}\" = {}", written(*instructions as f64));
        let _ = if steps < of { writeln!(text, " # stopped in step {steps} of {of}") } else { writeln!(text) };
    }
    text
}

/// All filters of all studies, for the terminal.
fn table(counted: &[Line]) -> String {
    let mut text = format!("{:<10}{:<34}{:>16}\n", "study", "filter", "M7 instr. a step");
    for Line { study, filter, instructions, .. } in counted {
        #[allow(clippy::cast_precision_loss)] // far below 2^53
        let _ = writeln!(text, "{study:<10}{filter:<34}{:>16}", written(*instructions as f64));
    }
    text
}

fn recorded(text: &str) -> Result<BTreeMap<(String, String), i64>> {
    let document: DocumentMut = text.parse()?;
    let mut all = BTreeMap::new();
    for (study, filters) in document.iter() {
        for (filter, count) in filters.as_table().context("a table of filters was expected")?.iter() {
            let count = count.as_value().and_then(|value| value.as_integer()).with_context(|| filter.to_owned())?;
            all.insert((study.to_owned(), filter.to_owned()), count);
        }
    }
    Ok(all)
}

/// What is missing on either side, or differs by more than is allowed.
fn differences(counted: &[Line], recorded: &BTreeMap<(String, String), i64>) -> Vec<String> {
    let mut recorded = recorded.clone();
    let mut failures = Vec::new();
    for Line { study, filter, instructions, .. } in counted {
        let Some(before) = recorded.remove(&(study.clone(), filter.clone())) else {
            failures.push(format!("{study}, {filter}: is not recorded"));
            continue;
        };
        #[allow(clippy::cast_precision_loss)] // far below 2^53
        let change = *instructions as f64 / before as f64 - 1.0;
        if change.is_nan() || change.abs() > TOLERANCE {
            let change = 100.0 * change;
            failures.push(format!(
                "{study}, {filter}: costs {instructions} instructions a step, {before} are recorded ({change:+.1} %)"
            ));
        }
    }
    failures.extend(recorded.keys().map(|(study, filter)| format!("{study}, {filter}: is recorded, and not counted")));
    failures
}

#[cfg(test)]
mod tests {
    use super::*;

    fn against(said: &str) -> Vec<String> {
        let before = text(&parse("ddf\tRDDF1\t1000\t9\t9\nddf\tRDDF2\t2000\t3\t9\n").unwrap());
        assert!(before.ends_with("[ddf]\n\"RDDF1\" = 1_000\n\"RDDF2\" = 2_000 # stopped in step 3 of 9\n"));
        differences(&parse(said).unwrap(), &recorded(&before).unwrap())
    }

    #[test]
    fn counts_within_two_percent_pass() {
        assert!(against("ddf\tRDDF1\t1019\t9\t9\nddf\tRDDF2\t1961\t9\t9").is_empty());
    }

    #[test]
    fn what_is_missing_new_or_dearer_is_named() {
        for (said, words) in [
            ("ddf\tRDDF1\t1000\t9\t9", "RDDF2: is recorded, and not counted"),
            ("ddf\tRDDF1\t1000\t9\t9\nddf\tRDDF2\t2000\t9\t9\nddf\tRDDF3\t3\t9\t9", "RDDF3: is not recorded"),
            (
                "ddf\tRDDF1\t1021\t9\t9\nddf\tRDDF2\t2000\t9\t9",
                "RDDF1: costs 1021 instructions a step, 1000 are recorded (+2.1 %)",
            ),
        ] {
            let failures = against(said);
            assert!(failures.len() == 1 && failures[0].contains(words), "{failures:?}");
        }
    }

    #[test]
    fn an_image_that_says_nothing_or_something_else_is_an_error() {
        assert!(parse("").is_err() && parse("panicked").is_err() && parse("ddf\tRDDF1\tmany\t9\t9").is_err());
    }
}
