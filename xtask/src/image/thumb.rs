//! Where Thumb instructions lead and what they take from the stack.

use super::disassembly::{Instruction, number};
use super::flow::{Flow, StackMove};

/// Conditions, both spellings of the carry ones.
const CONDITIONS: [&str; 16] =
    ["eq", "ne", "cs", "hs", "cc", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];

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
