//! The text of `llvm-objdump`, line by line.

use std::path::Path;

use anyhow::Result;
use xshell::{Shell, cmd};

use super::elf::Machine;
use crate::symbols::llvm_tool;

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction<'a> {
    pub address: u64,
    pub mnemonic: &'a str,
    /// Without the disassembler's comments.
    pub operands: &'a str,
}

/// Disassembles the code of an image.
pub fn disassemble(shell: &Shell, machine: Machine, image: &Path) -> Result<String> {
    let objdump = llvm_tool(shell, "llvm-objdump")?;
    // Without the processor's name the floating-point instructions stay unknown; aliases would hide the registers.
    let option = match machine {
        Machine::Thumb => "--mcpu=cortex-m7",
        Machine::RiscV => "--disassembler-options=no-aliases",
    };
    Ok(cmd!(shell, "{objdump} --disassemble --no-show-raw-insn {option} {image}").quiet().read()?)
}

/// The instructions of a disassembly; labels and data in the code are passed over.
pub fn instructions(text: &str) -> impl Iterator<Item = Instruction<'_>> {
    text.lines().filter_map(instruction)
}

fn instruction(line: &str) -> Option<Instruction<'_>> {
    let (address, rest) = line.split_once(':')?;
    let address = u64::from_str_radix(address.trim(), 16).ok()?;
    // Data has its bytes between the address and the tab.
    let (before, rest) = rest.split_once('\t')?;
    if !before.trim().is_empty() {
        return None;
    }
    let (mnemonic, operands) = rest.split_once('\t').unwrap_or((rest, ""));
    let operands = operands.split(['@', '<']).next().unwrap_or_default();
    Some(Instruction { address, mnemonic: mnemonic.trim(), operands: operands.trim() })
}

/// A number as the disassembler writes it: `0x1a`, `#-0x8`, `12`.
pub fn number(text: &str) -> Option<i64> {
    let text = text.trim().trim_start_matches('#');
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |rest| (-1, rest));
    let magnitude = match digits.strip_prefix("0x") {
        // Addresses of 64 bits do not fit otherwise.
        Some(hex) => u64::from_str_radix(hex, 16).ok()?.cast_signed(),
        None => digits.parse().ok()?,
    };
    Some(sign * magnitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_are_read_and_data_is_passed_over() {
        let text = "00000400 <Reset>:\n     400:      \tldr\tr0, [pc, #0x48]         @ 0x44c <Reset+0x4c>\n     \
                    40c:      \tbl\t0x10c50 <__pre_init>    @ imm = #0x10840\n     40e:      \tnop\n     \
                    44c: 00 00 40 20  \t.word\t0x20400000\n";
        let found: Vec<_> = instructions(text).collect();
        assert_eq!(
            found,
            [
                Instruction { address: 0x400, mnemonic: "ldr", operands: "r0, [pc, #0x48]" },
                Instruction { address: 0x40c, mnemonic: "bl", operands: "0x10c50" },
                Instruction { address: 0x40e, mnemonic: "nop", operands: "" },
            ]
        );
    }

    #[test]
    fn numbers_have_signs_and_two_bases() {
        assert_eq!(["#-0x8", "0x10", "12", "sp"].map(number), [Some(-8), Some(16), Some(12), None]);
    }
}
