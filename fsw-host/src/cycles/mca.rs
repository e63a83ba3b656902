//! Block cycles from LLVM's scheduling model of the Cortex-M7, by `llvm-mca`.
//!
//! Every block is one named region of one input, simulated for one iteration. The figure taken is the total of that
//! one iteration less one: from the issue of the block's first instruction to the write-back of its last result, with
//! nothing of the next block overlapped (`doc/cycles.md` says what that is worth against a simulation of the whole
//! path). Calls end blocks and are plain branches to this core, so `llvm-mca`'s 100 cycles for the unknown callee
//! are switched off.

use std::collections::{BTreeSet, HashMap};
use std::ffi::OsStr;
use std::fmt::Write as _;

use serde::Deserialize;

use super::CycleError;
use super::listing::Instruction;
use super::tools;

/// Name of the program; figures are of this version of the model.
pub const PROGRAM: &str = "llvm-mca-19";

/// Cycles charged for an instruction that the model does not know. The only one in compiled code is `it`, which takes
/// an issue slot and no more; a whole cycle errs upwards.
pub const STAND_IN_CYCLES: u32 = 1;

const ARGUMENTS: [&str; 8] = [
    "-mtriple=thumbv7em-none-eabihf",
    "-mcpu=cortex-m7",
    "-skip-unsupported-instructions=lack-sched",
    "-iterations=1",
    "-call-latency=1",
    "-instruction-info=0",
    "-resource-pressure=0",
    "-json",
];

/// What the model says of some blocks.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Cycles per block, in the order given; stand-ins are in them.
    pub cycles: Vec<u32>,
    /// Mnemonics that the model lacks.
    pub lacking: BTreeSet<String>,
}

/// Simulates all blocks in one run of the program.
pub fn cycles(blocks: &[&[Instruction]]) -> Result<Verdict, CycleError> {
    if blocks.is_empty() {
        return Ok(Verdict::default());
    }
    let output = tools::run(PROGRAM, ARGUMENTS.map(OsStr::new), regions(blocks).into_bytes())?;
    verdict(blocks, &output.stdout, &output.stderr)
}

/// The blocks in the assembler's syntax. Each conditional instruction has an `it` of its own, so that a block may begin
/// in the middle of one.
fn regions(blocks: &[&[Instruction]]) -> String {
    let mut text = String::new();
    for (number, block) in blocks.iter().enumerate() {
        let _ = writeln!(text, "# LLVM-MCA-BEGIN {number}");
        for instruction in block.iter().filter(|instruction| !super::listing::is_if_then(&instruction.mnemonic)) {
            if let Some(condition) = instruction.condition {
                let _ = writeln!(text, "it {condition}");
            }
            let _ = writeln!(text, "{} {}", instruction.mnemonic, instruction.operands);
        }
        let _ = writeln!(text, "# LLVM-MCA-END {number}");
    }
    text
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Output {
    code_regions: Vec<Region>,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Region {
    name: String,
    summary_view: Summary,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Summary {
    total_cycles: u32,
}

fn verdict(blocks: &[&[Instruction]], json: &str, messages: &str) -> Result<Verdict, CycleError> {
    let wrong = |reason: String| CycleError::Tool { program: PROGRAM, reason };
    let output: Output = serde_json::from_str(json).map_err(|error| wrong(error.to_string()))?;
    let totals: HashMap<&str, u32> =
        output.code_regions.iter().map(|region| (region.name.as_str(), region.summary_view.total_cycles)).collect();
    let lacking = lacking_instructions(messages);
    let block_cycles = |(number, block): (usize, &&[Instruction])| {
        let stand_ins = block.iter().filter(|instruction| lacking.contains(&instruction.mnemonic)).count() as u32;
        let charge = stand_ins * STAND_IN_CYCLES;
        match totals.get(number.to_string().as_str()) {
            Some(total) => Ok(total.saturating_sub(1) + charge),
            None if stand_ins as usize == block.len() => Ok(charge),
            None => Err(wrong(format!("it gives no figure for the block at {:#x}", block[0].address))),
        }
    };
    let cycles = blocks.iter().enumerate().map(block_cycles).collect::<Result<_, _>>()?;
    Ok(Verdict { cycles, lacking })
}

/// Mnemonics in the notes "instruction: \tit\teq"; an `it` of any shape is reported as `it`.
fn lacking_instructions(messages: &str) -> BTreeSet<String> {
    let notes = messages.lines().filter_map(|line| line.trim().strip_prefix("note: instruction:"));
    let mnemonics = notes.filter_map(|note| note.split_whitespace().next().map(String::from));
    let mut lacking: BTreeSet<String> = mnemonics.collect();
    if lacking.contains("it") {
        let shapes = ["itt", "ite", "ittt", "itte", "itet", "itee", "itttt", "ittte", "ittet", "ittee"];
        let more = ["itett", "itete", "iteet", "iteee"];
        lacking.extend(shapes.into_iter().chain(more).map(String::from));
    }
    lacking
}

#[cfg(test)]
mod tests {
    use super::super::listing::Listing;
    use super::super::listing::tests::LISTING;
    use super::*;

    const JSON: &str = r#"{"CodeRegions": [
        {"Instructions": ["a"], "Name": "1", "SummaryView": {"IPC": 0.5, "TotalCycles": 8, "TotaluOps": 1}},
        {"Instructions": ["b"], "Name": "0", "SummaryView": {"IPC": 0.5, "TotalCycles": 2, "TotaluOps": 1}}],
        "SimulationParameters": {}, "TargetInfo": {}}"#;
    const NOTES: &str = "warning: found an unsupported instruction in the input assembly sequence, skipping\n\
        note: instruction: \tit\teq\n";

    #[test]
    fn a_block_becomes_a_named_region_with_an_if_then_for_each_conditional_instruction() {
        let listing = Listing::parse(LISTING).unwrap();
        let text = regions(&[listing.block(0x408, 4).unwrap()]);
        let lines: Vec<&str> = text.lines().collect();
        let expected = [
            "# LLVM-MCA-BEGIN 0",
            "it hs",
            "movhs r2, #0x0",
            "it lo",
            "vmovlo.f64 d0, d1",
            "vadd.f64 d0, d0, d2",
            "# LLVM-MCA-END 0",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn totals_are_taken_by_name_less_one_and_stand_ins_are_added() {
        let listing = Listing::parse(LISTING).unwrap();
        let blocks = [listing.block(0x400, 1).unwrap(), listing.block(0x404, 6).unwrap()];
        let verdict = verdict(&blocks, JSON, NOTES).unwrap();
        assert_eq!(verdict.cycles, [1, 7 + STAND_IN_CYCLES]);
        assert!(verdict.lacking.contains("ite"));
    }

    #[test]
    fn a_block_without_a_figure_and_output_that_is_none_are_errors_that_name_the_program() {
        let listing = Listing::parse(LISTING).unwrap();
        let block = listing.block(0x400, 1).unwrap();
        let missing = verdict(&[block, block, block], JSON, "").unwrap_err().to_string();
        assert!(missing.contains(PROGRAM) && missing.contains("0x400"), "{missing}");
        let garbage = verdict(&[block], "error: no such option", "").unwrap_err().to_string();
        assert!(garbage.contains(PROGRAM), "{garbage}");
    }

    #[test]
    fn no_blocks_need_no_program() {
        assert_eq!(cycles(&[]).unwrap(), Verdict::default());
    }
}
