//! Where Thumb instructions lead and what they take from the stack.

use super::disassembly::{Instruction, number};
use super::flow::{Flow, StackMove};

/// Conditions, both spellings of the carry ones.
const CONDITIONS: [&str; 16] =
    ["eq", "ne", "cs", "hs", "cc", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];

/// Instructions before a jump into a table of branches in which its address is made, at most.
const TABLE_PREPARATION: usize = 16;

/// Where control goes from the instruction `index` of a function.
pub fn flow_within(code: &[Instruction<'_>], index: usize) -> Flow {
    match code.get(index).map_or(Flow::Straight, flow) {
        // The branches of the table stand behind it as instructions of their own.
        Flow::Unknown if enters_table(code, index) => Flow::Straight,
        flow => flow,
    }
}

/// Whether the jump goes into a table of branches right behind it, or behind a filler, as a match of many arms does:
/// `adr a, table`, `add b, a, arm, lsl #2`, `mov pc, b`. The compare before it bounds the arm, as with `tbb`.
fn enters_table(code: &[Instruction<'_>], index: usize) -> bool {
    let behind = code.iter().skip(index + 1).take(2).find(|i| i.mnemonic != "nop");
    let (Some(jump), Some(table)) = (code.get(index), behind) else { return false };
    let Some(entry) = jump.operands.strip_prefix("pc, ").filter(|_| jump.mnemonic == "mov") else { return false };
    if table.mnemonic != "b.w" {
        return false;
    }
    let before = || code[index.saturating_sub(TABLE_PREPARATION)..index].iter().rev();
    let base = before().find(|i| is(i.mnemonic, "add") && writes(i, entry)).and_then(|add| {
        let mut operands = add.operands.split(", ").skip(1);
        let base = operands.next()?;
        (operands.last()? == "lsl #2").then_some(base)
    });
    let address = base.and_then(|base| before().find(|i| is(i.mnemonic, "adr") && writes(i, base))).and_then(|adr| {
        let offset = adr.operands.rsplit(", ").next().and_then(number)?;
        Some(((adr.address + 4) & !3).wrapping_add_signed(offset))
    });
    address == Some(table.address)
}

/// Whether a register is the first operand.
fn writes(instruction: &Instruction<'_>, register: &str) -> bool {
    instruction.operands.split(',').next() == Some(register)
}

/// Where control goes from here.
pub fn flow(instruction: &Instruction<'_>) -> Flow {
    let Instruction { mnemonic, operands, .. } = *instruction;
    let target = operands.rsplit(',').next().and_then(number).map(i64::cast_unsigned);
    let conditional = |base| is(mnemonic, base);
    match target {
        Some(to) if conditional("bl") || conditional("blx") => return Flow::Call(vec![to]),
        Some(to) if conditional("b") || matches!(mnemonic, "cbz" | "cbnz") => return Flow::Jump(vec![to]),
        _ => {}
    }
    if conditional("blx") {
        Flow::Unknown
    } else if conditional("bx") {
        if operands == "lr" { Flow::Return } else { Flow::Unknown }
    } else if matches!(mnemonic, "udf" | "udf.w") {
        Flow::Return
    } else if matches!(mnemonic, "tbb" | "tbh") {
        // Offsets after the instruction itself, bounded by the compare before it: within the function.
        Flow::Straight
    } else if writes_pc(mnemonic, operands) {
        let from_stack = mnemonic.starts_with("pop") || operands.contains("sp!") || operands.contains("[sp]");
        let to_link = operands.trim_start_matches("pc,").trim() == "lr";
        if from_stack || to_link { Flow::Return } else { Flow::Unknown }
    } else {
        Flow::Straight
    }
}

/// `bne.w` is a `b`, `bls` is a `b` too, `blls` is a `bl`.
fn is(mnemonic: &str, base: &str) -> bool {
    let plain = mnemonic.trim_end_matches(".w").trim_end_matches(".n");
    plain.strip_prefix(base).is_some_and(|rest| rest.is_empty() || CONDITIONS.contains(&rest))
}

fn writes_pc(mnemonic: &str, operands: &str) -> bool {
    let listed = (mnemonic.starts_with("pop") || mnemonic.starts_with("ldm")) && operands.ends_with("pc}");
    let stores_or_compares = mnemonic.starts_with("st") || mnemonic.starts_with("cmp");
    listed || (operands.starts_with("pc,") && !stores_or_compares)
}

/// What the instruction does to the stack pointer.
pub fn stack_move(instruction: &Instruction<'_>) -> StackMove {
    let Instruction { mnemonic, operands, .. } = *instruction;
    let plain = mnemonic.trim_end_matches(".w");
    if matches!(plain, "push" | "vpush") {
        return StackMove::Down(registers(operands));
    }
    if mnemonic.starts_with("stmdb") && operands.starts_with("sp!") {
        return StackMove::Down(registers(operands));
    }
    if mnemonic.starts_with("str") && operands.ends_with("]!") && operands.contains("[sp,") {
        let offset = operands.rsplit(',').next().and_then(|text| number(text.trim_end_matches("]!")));
        return offset.map_or(StackMove::Unknown, |bytes| StackMove::Down(bytes.unsigned_abs()));
    }
    if plain == "msr" && operands.starts_with("msp,") {
        return StackMove::Switched;
    }
    if let ("bfc", [_, "#0x0", bits]) = (plain, operands.split(", ").collect::<Vec<_>>().as_slice()) {
        return number(bits).filter(|bits| *bits < 12).map_or(StackMove::None, |bits| StackMove::Aligned(1 << bits));
    }
    if !operands.starts_with("sp,") || mnemonic.starts_with("cmp") || mnemonic.starts_with("tst") {
        return StackMove::None;
    }
    let last = operands.rsplit(',').next().unwrap_or_default();
    match (plain, number(last)) {
        ("sub" | "subw", Some(bytes)) => StackMove::Down(bytes.unsigned_abs()),
        ("add" | "addw", Some(_)) => StackMove::None,
        _ => StackMove::Unknown,
    }
}

/// Bytes of a register list: four for a core or single-precision register, eight for a double.
fn registers(operands: &str) -> u64 {
    let list = operands.split(['{', '}']).nth(1).unwrap_or_default();
    list.split(',').map(|register| if register.trim().starts_with('d') { 8 } else { 4 }).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(mnemonic: &'static str, operands: &'static str) -> Instruction<'static> {
        Instruction { address: 0x100, mnemonic, operands }
    }

    #[test]
    fn branches_calls_and_returns_are_told_apart() {
        assert_eq!(flow(&at("bl", "0x200")), Flow::Call(vec![0x200]));
        assert_eq!(flow(&at("blls", "0x200")), Flow::Call(vec![0x200]));
        assert_eq!(flow(&at("bls.w", "0x200")), Flow::Jump(vec![0x200]));
        assert_eq!(flow(&at("b.w", "0x200")), Flow::Jump(vec![0x200]));
        assert_eq!(flow(&at("cbz", "r0, 0x200")), Flow::Jump(vec![0x200]));
        assert_eq!(flow(&at("bic", "r0, r0, #0x3")), Flow::Straight);
        assert_eq!(flow(&at("bxhi", "lr")), Flow::Return);
        assert_eq!(flow(&at("pop.w", "{r4, r8, pc}")), Flow::Return);
        assert_eq!(flow(&at("ldr", "pc, [sp], #0x4")), Flow::Return);
        assert_eq!(flow(&at("tbh", "[pc, r3, lsl #1]")), Flow::Straight);
    }

    #[test]
    fn jumps_through_registers_and_tables_of_addresses_are_unknown() {
        assert_eq!(flow(&at("blx", "r3")), Flow::Unknown);
        assert_eq!(flow(&at("bx", "r3")), Flow::Unknown);
        assert_eq!(flow(&at("ldr.w", "pc, [r0, r1, lsl #2]")), Flow::Unknown);
        assert_eq!(flow(&at("mov", "pc, r2")), Flow::Unknown);
    }

    #[test]
    fn a_jump_into_a_table_of_branches_behind_it_is_known_and_any_other_is_not() {
        let code = |shift: &'static str, offset: &'static str| {
            [(0x2ab8, "adr.w", offset), (0x2ac4, "add.w", shift), (0x2aca, "mov", "pc, r6"), (0x2acc, "b.w", "0x2f28")]
                .map(|(address, mnemonic, operands)| Instruction { address, mnemonic, operands })
        };
        let known = code("r6, r1, r4, lsl #2", "r1, #0x10");
        assert_eq!(flow_within(&known, 2), Flow::Straight);
        assert_eq!(flow_within(&known, 3), Flow::Jump(vec![0x2f28]));
        assert_eq!(flow_within(&code("r6, r1, r4, lsl #2", "r1, #0x14"), 2), Flow::Unknown);
        assert_eq!(flow_within(&code("r6, r1, r4", "r1, #0x10"), 2), Flow::Unknown);
        assert_eq!(flow_within(&code("r5, r1, r4, lsl #2", "r1, #0x10"), 2), Flow::Unknown);
        assert_eq!(flow_within(&known[..3], 2), Flow::Unknown);
        let filler = Instruction { address: 0x2acc, mnemonic: "nop", operands: "" };
        let shifted = |offset| {
            let [adr, add, jump, branch] = code("r6, r1, r4, lsl #2", offset);
            [adr, add, jump, filler, Instruction { address: 0x2ad0, ..branch }]
        };
        assert_eq!(flow_within(&shifted("r1, #0x14"), 2), Flow::Straight);
        assert_eq!(flow_within(&shifted("r1, #0x10"), 2), Flow::Unknown);
    }

    #[test]
    fn pushes_and_subtractions_lower_the_stack() {
        assert_eq!(stack_move(&at("push", "{r4, r5, r7, lr}")), StackMove::Down(16));
        assert_eq!(stack_move(&at("vpush", "{d8, d9, d10}")), StackMove::Down(24));
        assert_eq!(stack_move(&at("sub.w", "sp, sp, #0x4d0")), StackMove::Down(1232));
        assert_eq!(stack_move(&at("sub", "sp, #0x18")), StackMove::Down(24));
        assert_eq!(stack_move(&at("str", "lr, [sp, #-0x8]!")), StackMove::Down(8));
        assert_eq!(stack_move(&at("bfc", "r4, #0x0, #0x4")), StackMove::Aligned(16));
        assert_eq!(stack_move(&at("add", "sp, #0x18")), StackMove::None);
        assert_eq!(stack_move(&at("msr", "msp, r1")), StackMove::Switched);
        assert_eq!(stack_move(&at("mov", "sp, r4")), StackMove::Unknown);
    }
}
