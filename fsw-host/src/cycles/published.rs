//! Block cycles from timings that were measured on a real Cortex-M7 and published: a second opinion beside LLVM's model.
//!
//! LLVM's model says when a double-precision result can be used, but not that the multiplier is busy until then. Public
//! measurements on an STM32H743 (github.com/jnk0le/random, "pipeline cycle test", `cortex_m7.md`) give both. This is
//! an in-order, dual-issue scoreboard with those figures; where they give a range, with its upper end for normal
//! numbers, and where they give nothing, with the figure of LLVM's model or of the next slower instruction.

use super::listing::Instruction;
use super::registers::{self, Access};

/// What limits pairing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    /// Add, move, logic, plain shifts: two a cycle.
    Simple,
    /// Shifted operands, bit fields, reversals: one a cycle, and operands a cycle early.
    Shifter,
    Multiplier,
    Load,
    Store,
    Branch,
    /// Floating-point arithmetic; a younger simple instruction may go with it.
    Float,
    /// Goes alone.
    Alone,
}

/// The timing of one instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Timing {
    unit: Unit,
    /// Cycles until another instruction can issue.
    busy: u32,
    /// Cycles until the result can be used.
    latency: u32,
}

const fn timing(unit: Unit, busy: u32, latency: u32) -> Timing {
    Timing { unit, busy, latency }
}

/// A multiply-accumulate right after another one needs less.
const CHAINED_ACCUMULATE_BUSY: u32 = 7;
/// Integer division depends on its operands; the longest published for the family (Cortex-M4: 2 to 12).
const DIVISION: u32 = 12;
/// Barriers and moves to special registers: the stand-in of LLVM's model.
const SPECIAL: u32 = 3;

/// Cycles of a block, from the issue of its first instruction until its last result can be used.
pub fn cycles(block: &[Instruction]) -> u32 {
    let mut board = Scoreboard { free: 0, open: None, ready: [0; registers::COUNT], after_accumulate: false };
    for instruction in block {
        board.issue(instruction);
    }
    board.ready.iter().copied().fold(board.free, u32::max)
}

/// Where the pipeline stands.
struct Scoreboard {
    /// First cycle in which the next instruction can issue on its own.
    free: u32,
    /// The cycle and unit of an instruction that may still be joined by a younger one.
    open: Option<(u32, Unit)>,
    /// When each register can be used.
    ready: [u32; registers::COUNT],
    after_accumulate: bool,
}

impl Scoreboard {
    fn issue(&mut self, instruction: &Instruction) {
        let access = registers::access(instruction);
        let mut timing = classify(instruction, &access);
        let accumulates = is_accumulate(&instruction.mnemonic);
        if accumulates && self.after_accumulate {
            timing.busy = timing.busy.min(CHAINED_ACCUMULATE_BUSY);
        }
        let operands = self.operands_ready(&access, timing.unit);
        let cycle = match self.open {
            Some((cycle, older)) if operands <= cycle && may_join(older, timing.unit) => {
                self.open = None;
                cycle
            }
            _ => {
                let cycle = self.free.max(operands);
                self.open = (timing.unit != Unit::Alone).then_some((cycle, timing.unit));
                cycle
            }
        };
        self.free = self.free.max(cycle + timing.busy);
        for &register in &access.writes {
            self.ready[register] = cycle + timing.latency;
        }
        if timing.unit == Unit::Float {
            self.after_accumulate = accumulates;
        }
    }

    /// Addresses and shifted operands are needed a cycle before the others; a branch is predicted and waits for nothing.
    fn operands_ready(&self, access: &Access, unit: Unit) -> u32 {
        if unit == Unit::Branch {
            return 0;
        }
        let early = u32::from(unit == Unit::Shifter);
        let plain = access.reads.iter().map(|&register| (register, early));
        let addresses = access.addresses.iter().map(|&register| (register, 1));
        // A register that was ready from the start is ready early too.
        let when = |(register, early): (usize, u32)| match self.ready[register] {
            0 => 0,
            cycle => cycle + early,
        };
        plain.chain(addresses).map(when).max().unwrap_or(0)
    }
}

/// Whether a younger instruction can issue in the cycle of an older one. Two loads can when they fall in different
/// banks, which is not known here: so they do not.
fn may_join(older: Unit, younger: Unit) -> bool {
    use Unit::{Alone, Branch, Float, Load, Multiplier, Shifter, Simple, Store};
    match (older, younger) {
        (Alone | Branch, _) | (_, Alone | Float) => false,
        (Float, Simple | Shifter | Branch) => true,
        (Float, _) => false,
        (Multiplier, Multiplier | Store) | (Store, Multiplier | Store) => false,
        (Load, Load) | (Shifter, Shifter) => false,
        _ => true,
    }
}

fn is_accumulate(mnemonic: &str) -> bool {
    ["vmla", "vmls", "vnmla", "vnmls", "vfma", "vfms", "vfnma", "vfnms"].iter().any(|name| mnemonic.starts_with(name))
}

fn classify(instruction: &Instruction, access: &Access) -> Timing {
    let name = instruction.mnemonic.as_str();
    if name.starts_with('v') {
        return classify_float(name, instruction, access);
    }
    let base = registers::base_mnemonic(instruction);
    match base {
        _ if registers::is_branch(base) => timing(Unit::Branch, 1, 1),
        "ldm" | "pop" | "stm" | "push" | "ldmdb" | "stmdb" => multiple(access.listed),
        "ldrd" | "strd" => timing(Unit::Alone, 1, 2),
        "ldrb" | "ldrh" | "ldrsb" | "ldrsh" => timing(Unit::Load, 1, 2),
        _ if base.starts_with("ldr") => timing(Unit::Load, 1, 1),
        _ if base.starts_with("str") => timing(Unit::Store, 1, 1),
        "udiv" | "sdiv" => timing(Unit::Alone, DIVISION, DIVISION),
        "dmb" | "dsb" | "isb" | "mrs" | "msr" | "bkpt" | "svc" | "cps" | "cpsid" | "cpsie" => {
            timing(Unit::Alone, SPECIAL, SPECIAL)
        }
        _ if ["mul", "mla", "mls", "umull", "umlal", "umaal", "sm"].iter().any(|start| base.starts_with(start)) => {
            timing(Unit::Multiplier, 1, 2)
        }
        _ if uses_shifter(base, &instruction.operands) => timing(Unit::Shifter, 1, 1),
        _ => timing(Unit::Simple, 1, 1),
    }
}

fn uses_shifter(base: &str, operands: &str) -> bool {
    let fields =
        ["ubfx", "sbfx", "bfi", "bfc", "uxt", "sxt", "rev", "rbit", "clz", "pkh", "ssat", "usat", "uadd", "usub"];
    let shifts = [", lsl #", ", lsr #", ", asr #", ", ror #"];
    fields.iter().any(|start| base.starts_with(start)) || shifts.iter().any(|shift| operands.contains(shift))
}

/// Load and store multiple move two words a cycle.
fn multiple(words: u32) -> Timing {
    let busy = words.div_ceil(2).max(1);
    timing(Unit::Alone, busy, busy + 1)
}

fn classify_float(name: &str, instruction: &Instruction, access: &Access) -> Timing {
    let operation = name.split('.').next().unwrap_or(name);
    // The condition of a predicated instruction is part of its mnemonic.
    let operation = match instruction.condition {
        Some(condition) => operation.strip_suffix(condition).unwrap_or(operation),
        None => operation,
    };
    match operation {
        "vldmia" | "vpop" | "vldmdb" | "vstmia" | "vpush" | "vstmdb" => return multiple(access.listed),
        "vldr" => return timing(Unit::Alone, 1, 2),
        "vstr" => return timing(Unit::Alone, 1, 1),
        "vmrs" | "vmsr" => return timing(Unit::Alone, 1, 1),
        "vmov" if access.reads.iter().any(|&register| registers::is_core(register)) => {
            return timing(Unit::Alone, 1, 4);
        }
        "vmov" if access.writes.iter().any(|&register| registers::is_core(register)) => {
            return timing(Unit::Alone, 1, 2);
        }
        _ => {}
    }
    let double = name.contains(".f64");
    match operation {
        "vdiv" | "vsqrt" if double => timing(Unit::Float, 30, 32),
        "vdiv" | "vsqrt" => timing(Unit::Float, 16, 18),
        "vmul" | "vnmul" if double => timing(Unit::Float, 5, 7),
        "vfma" | "vfms" | "vfnma" | "vfnms" if double => timing(Unit::Float, 8, 10),
        "vmla" | "vmls" | "vnmla" | "vnmls" if double => timing(Unit::Float, 9, 11),
        _ if is_accumulate(operation) => timing(Unit::Float, 1, 6),
        // Additions, and what is not published: comparisons, conversions, selections, moves.
        _ if double => timing(Unit::Float, 2, 4),
        _ => timing(Unit::Float, 1, 3),
    }
}

#[cfg(test)]
mod tests {
    use super::super::listing::Listing;
    use super::*;

    /// The cycles of a block in assembler syntax.
    fn of(lines: &[String]) -> u32 {
        let text: String = lines
            .iter()
            .enumerate()
            .map(|(index, line)| format!("  {:x}:      \t{}\n", 4 * index, line.replacen(' ', "\t", 1)))
            .collect();
        cycles(Listing::parse(&text).unwrap().block(0, lines.len()).unwrap())
    }

    /// Cycles that each further copy of a line adds; `{}` in it is a register that differs from copy to copy.
    fn each(line: &str) -> u32 {
        let copies = |count: usize| -> Vec<String> {
            (0..count)
                .flat_map(|i| line.replace("{}", &(i % 8).to_string()).lines().map(String::from).collect::<Vec<_>>())
                .collect()
        };
        (of(&copies(20)) - of(&copies(10))) / 10
    }

    #[test]
    fn independent_double_arithmetic_costs_what_was_measured() {
        assert_eq!(each("vadd.f64 d{}, d8, d9"), 2);
        assert_eq!(each("vmul.f64 d{}, d8, d9"), 5);
        assert_eq!(each("vdiv.f64 d{}, d8, d9"), 30);
        assert_eq!(each("vmla.f64 d{}, d8, d9"), 7);
    }

    #[test]
    fn chains_of_double_arithmetic_wait_for_their_results() {
        assert_eq!(each("vadd.f64 d0, d0, d9"), 4);
        assert_eq!(each("vmul.f64 d0, d0, d9"), 7);
        assert_eq!(each("vmul.f64 d0, d1, d9\nvadd.f64 d1, d0, d9"), 11);
    }

    #[test]
    fn integer_work_hides_behind_double_arithmetic() {
        assert_eq!(each("vmul.f64 d{}, d8, d9\nadd.w r1, r2, r3"), 5);
        assert_eq!(each("vadd.f64 d{}, d8, d9\nadd.w r1, r2, r3"), 2);
    }

    #[test]
    fn simple_instructions_go_in_pairs_and_chains_do_not() {
        assert_eq!(each("add.w r{}, r8, r9\nadd.w r10, r8, r9"), 1);
        assert_eq!(each("add.w r0, r0, r9\nadd.w r0, r0, r9"), 2);
        assert_eq!(each("ldr.w r0, [r0]"), 2);
        assert_eq!(each("str.w r{}, [r10]\nstr.w r{}, [r10, #4]"), 2);
    }

    #[test]
    fn multiple_transfers_take_a_cycle_for_two_words() {
        assert_eq!(each("push {r4, r5, r6, r7, r8, lr}"), 3);
        assert_eq!(each("vpush {d8, d9, d10}"), 3);
    }

    #[test]
    fn a_block_lasts_until_its_last_result() {
        assert_eq!(of(&["vmul.f64 d0, d1, d2".to_owned()]), 7);
        assert_eq!(of(&["add.w r0, r1, r2".to_owned()]), 1);
    }
}
