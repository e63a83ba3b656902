//! Cycles put to block counts: per frame, per function, and what the figures leave out.

use std::collections::{BTreeMap, HashMap};
use std::fmt::{self, Write as _};

use serde::Serialize;

use super::blocks::BlockCost;
use super::counts::{BlockCounts, Executions};

/// What every figure assumes; printed with it.
pub const ASSUMPTIONS: [&str; 5] = [
    "caches warm, memory without wait states (the executed code and data of a frame fit in tightly coupled memory)",
    "branches predicted right",
    "no interrupts",
    "nothing of a block overlaps with the next one",
    "per block the larger of two figures: LLVM's Cortex-M7 model by llvm-mca 19, and published measurements",
];

/// Most cycles that a wrongly predicted branch costs (published measurement).
const MISPREDICTION_CYCLES: u64 = 8;

/// What one frame cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FrameCost {
    /// Executed instructions, exact.
    pub instructions: u64,
    /// Estimated cycles: per block the larger of the two figures below.
    pub cycles: u64,
    /// By LLVM's model alone.
    pub llvm_cycles: u64,
    /// By published measurements alone.
    pub published_cycles: u64,
    /// Executed conditional branches: each that is predicted wrongly costs 6 to 8 cycles more.
    pub conditional_branches: u64,
}

impl FrameCost {
    fn add(&mut self, cost: &BlockCost, times: u64) {
        self.instructions += cost.instructions * times;
        self.cycles += u64::from(cost.llvm.max(cost.published)) * times;
        self.llvm_cycles += u64::from(cost.llvm) * times;
        self.published_cycles += u64::from(cost.published) * times;
        self.conditional_branches += u64::from(cost.conditional_branch) * times;
    }

    /// Cycles per instruction.
    pub fn cycles_per_instruction(&self) -> f64 {
        if self.instructions == 0 { 0.0 } else { self.cycles as f64 / self.instructions as f64 }
    }
}

/// What one function cost, without the functions that it calls.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FunctionCost {
    /// Its name in the image.
    pub name: String,
    /// Its share.
    pub cost: FrameCost,
}

/// The estimate for one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CycleReport {
    /// Every measured frame, in order.
    pub frames: Vec<FrameCost>,
    /// Number of the frame with the most cycles; the first of equals.
    pub worst_frame: Option<usize>,
    /// Functions of that frame, the costliest first.
    pub worst_functions: Vec<FunctionCost>,
    /// Functions of all frames together, the costliest first.
    pub functions: Vec<FunctionCost>,
    /// All frames together.
    pub total: FrameCost,
    /// Different blocks that ran.
    pub blocks: usize,
    /// Executions in frames of instructions that LLVM's model lacks, at a cycle each.
    pub stand_ins: BTreeMap<String, u64>,
    /// Instructions executed in frames that are not in the image's listing; they cost the mean of the others.
    pub unlisted_instructions: u64,
    /// Whether the guest ended in good order; otherwise frames until it was killed are there, and no later ones.
    pub complete: bool,
}

impl CycleReport {
    /// Puts costs, one per block, to counts.
    pub(super) fn new(counts: &BlockCounts, costs: &[BlockCost]) -> Self {
        let frames: Vec<FrameCost> = counts.frames().map(|frame| price(&frame, costs)).collect();
        let worst_frame = (0..frames.len()).rev().max_by_key(|&number| frames[number].cycles);
        let worst = worst_frame.and_then(|number| counts.frames().nth(number)).unwrap_or_default();
        let mut executions = vec![0; costs.len()];
        for entry in counts.frames().flatten() {
            executions[entry.block] += entry.times;
        }
        let all: Vec<Executions> =
            executions.iter().enumerate().map(|(block, &times)| Executions { block, times }).collect();
        let mut report = Self {
            frames,
            worst_frame,
            worst_functions: by_function(&worst, costs),
            functions: by_function(&all, costs),
            total: price(&all, costs),
            blocks: costs.len(),
            complete: counts.complete(),
            ..Self::default()
        };
        for entry in &all {
            let cost = &costs[entry.block];
            if !cost.listed {
                report.unlisted_instructions += cost.instructions * entry.times;
            }
            for mnemonic in &cost.stand_ins {
                *report.stand_ins.entry(mnemonic.clone()).or_default() += entry.times;
            }
        }
        report
    }

    /// The costliest frame.
    pub fn worst(&self) -> FrameCost {
        self.worst_frame.map(|number| self.frames[number]).unwrap_or_default()
    }

    /// The tables for a reader, with the `rows` costliest functions.
    pub fn text(&self, rows: usize) -> String {
        let mut text = String::new();
        // Writing into a string cannot fail.
        let _ = self.write_text(&mut text, rows);
        text
    }

    fn write_text(&self, text: &mut String, rows: usize) -> fmt::Result {
        let worst = self.worst();
        writeln!(text, "frames {}, blocks {}", self.frames.len(), self.blocks)?;
        writeln!(
            text,
            "{:<18} {:>12} {:>12} {:>6} {:>12} {:>12}",
            "", "instructions", "cycles", "CPI", "LLVM", "published"
        )?;
        let mean = |value: u64| value / (self.frames.len() as u64).max(1);
        let average = FrameCost {
            instructions: mean(self.total.instructions),
            cycles: mean(self.total.cycles),
            llvm_cycles: mean(self.total.llvm_cycles),
            published_cycles: mean(self.total.published_cycles),
            conditional_branches: mean(self.total.conditional_branches),
        };
        let label = format!("worst (frame {})", self.worst_frame.unwrap_or_default());
        for (label, cost) in [(label.as_str(), worst), ("mean", average)] {
            write!(text, "{label:<18} {:>12} {:>12}", cost.instructions, cost.cycles)?;
            write!(text, " {:>6.2}", cost.cycles_per_instruction())?;
            writeln!(text, " {:>12} {:>12}", cost.llvm_cycles, cost.published_cycles)?;
        }
        let branches = worst.conditional_branches;
        let bound = branches * MISPREDICTION_CYCLES;
        writeln!(text, "conditional branches in the worst frame: {branches}; all predicted wrongly: +{bound} cycles")?;
        for (title, functions) in [("worst frame", &self.worst_functions), ("all frames", &self.functions)] {
            let whole: u64 = functions.iter().map(|function| function.cost.cycles).sum();
            writeln!(
                text,
                "\nwhere the cycles go, {title}\n{:>6} {:>12} {:>12} {:>6}  function",
                "%", "cycles", "instructions", "CPI"
            )?;
            for FunctionCost { name, cost } in functions.iter().take(rows) {
                let share = 100.0 * cost.cycles as f64 / (whole as f64).max(1.0);
                let ratio = cost.cycles_per_instruction();
                writeln!(text, "{share:>6.1} {:>12} {:>12} {ratio:>6.2}  {name}", cost.cycles, cost.instructions)?;
            }
        }
        writeln!(text, "\nassumed: {}", ASSUMPTIONS.join("; "))?;
        for (mnemonic, times) in &self.stand_ins {
            writeln!(text, "not in LLVM's model: {mnemonic}, {times} times, at a cycle each")?;
        }
        if self.unlisted_instructions > 0 {
            let share = 100.0 * self.unlisted_instructions as f64 / self.total.instructions as f64;
            writeln!(text, "not in the image's listing: {share:.3} % of the instructions, at the mean of the others")?;
        }
        if !self.complete {
            writeln!(text, "the guest was killed before its end: frames after that are not in the figures")?;
        }
        Ok(())
    }
}

fn price(executions: &[Executions], costs: &[BlockCost]) -> FrameCost {
    let mut sum = FrameCost::default();
    for entry in executions {
        sum.add(&costs[entry.block], entry.times);
    }
    sum
}

fn by_function(executions: &[Executions], costs: &[BlockCost]) -> Vec<FunctionCost> {
    let mut sums: HashMap<&str, FrameCost> = HashMap::new();
    for entry in executions.iter().filter(|entry| entry.times > 0) {
        let cost = &costs[entry.block];
        sums.entry(&cost.function).or_default().add(cost, entry.times);
    }
    let mut functions: Vec<FunctionCost> =
        sums.into_iter().map(|(name, cost)| FunctionCost { name: name.to_owned(), cost }).collect();
    functions.sort_by(|a, b| b.cost.cycles.cmp(&a.cost.cycles).then_with(|| a.name.cmp(&b.name)));
    functions
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(function: &str, instructions: u64, llvm: u32, published: u32) -> BlockCost {
        BlockCost { function: function.to_owned(), instructions, llvm, published, listed: true, ..BlockCost::default() }
    }

    /// Two blocks of 2 and 8 instructions; a frame of each, twice and once, then one of both.
    fn report() -> CycleReport {
        let file = b"aeroshell-blocks 1\nB\x10\x02B\x20\x08F\x01\x00\x02F\x02\x00\x01\x01\x01F\x02\x00\x01\x01\x01E";
        let counts = BlockCounts::parse(file.to_vec()).unwrap();
        CycleReport::new(&counts, &[cost("small", 2, 3, 4), cost("large", 8, 30, 20)])
    }

    #[test]
    fn a_frame_costs_per_block_the_larger_of_the_two_figures() {
        let report = report();
        assert_eq!((report.frames[0].instructions, report.frames[0].cycles), (4, 8));
        let second = report.frames[1];
        assert_eq!((second.instructions, second.cycles), (10, 34));
        assert_eq!((second.llvm_cycles, second.published_cycles), (33, 24));
    }

    #[test]
    fn the_worst_frame_is_the_first_with_the_most_cycles() {
        assert_eq!(report().worst_frame, Some(1));
        assert_eq!(report().worst().cycles, 34);
    }

    #[test]
    fn functions_are_summed_over_frames_and_sorted_by_cycles() {
        let report = report();
        let names: Vec<_> = report.functions.iter().map(|f| (f.name.as_str(), f.cost.cycles)).collect();
        assert_eq!(names, [("large", 60), ("small", 16)]);
        assert_eq!(report.functions.iter().map(|f| f.cost.cycles).sum::<u64>(), report.total.cycles);
    }

    #[test]
    fn stand_ins_and_unlisted_instructions_are_counted_and_shown() {
        let counts = BlockCounts::parse(b"aeroshell-blocks 1\nB\x10\x02F\x01\x00\x05".to_vec()).unwrap();
        let block = BlockCost { stand_ins: vec!["it".to_owned()], listed: false, ..cost("f", 2, 3, 4) };
        let report = CycleReport::new(&counts, &[block]);
        assert_eq!(report.stand_ins["it"], 5);
        assert_eq!(report.unlisted_instructions, 10);
        let text = report.text(3);
        assert!(text.contains("it, 5 times") && text.contains("100.000 %") && text.contains("killed"), "{text}");
    }

    #[test]
    fn a_run_without_frames_is_an_empty_report() {
        let counts = BlockCounts::parse(b"aeroshell-blocks 1\nE".to_vec()).unwrap();
        let report = CycleReport::new(&counts, &[]);
        assert_eq!((report.worst_frame, report.worst()), (None, FrameCost::default()));
        assert!(!report.text(3).is_empty());
    }
}
