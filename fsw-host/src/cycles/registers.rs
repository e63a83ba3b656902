//! Which registers an instruction reads and writes, from its assembler text.

use super::listing::{Instruction, is_if_then};

/// Core registers 0 to 15, flags, double registers 0 to 15, flags of the floating-point unit.
pub const COUNT: usize = 34;
const FLAGS: usize = 16;
const FIRST_DOUBLE: usize = 17;
const FLOAT_FLAGS: usize = 33;

/// The registers of one instruction, by index below [`COUNT`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Access {
    /// Read as operands.
    pub reads: Vec<usize>,
    /// Read as parts of an address.
    pub addresses: Vec<usize>,
    /// Written.
    pub writes: Vec<usize>,
    /// Words that a load or store multiple moves.
    pub listed: u32,
}

/// Whether it is one of r0 to pc.
pub fn is_core(register: usize) -> bool {
    register < FLAGS
}

/// The mnemonic of an integer instruction without its width and condition.
pub fn base_mnemonic(instruction: &Instruction) -> &str {
    let name = instruction.mnemonic.split('.').next().unwrap_or_default();
    instruction.condition.and_then(|condition| name.strip_suffix(condition)).unwrap_or(name)
}

/// `b` with or without a condition, calls, returns, compare and branch, table branches.
pub fn is_branch(base: &str) -> bool {
    is_conditional_branch(base) || matches!(base, "b" | "bl" | "bx" | "blx" | "tbb" | "tbh")
}

/// A branch that may go either way.
pub fn is_conditional_branch(base: &str) -> bool {
    let condition = base.strip_prefix('b').unwrap_or_default();
    let conditions = ["eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];
    conditions.contains(&condition) || matches!(base, "cbz" | "cbnz")
}

/// How many operands at the front are written.
fn destinations(base: &str, operands: &str) -> usize {
    match base {
        "cmp" | "cmn" | "tst" | "teq" | "push" | "vpush" | "nop" | "vcmp" | "vcmpe" | "msr" | "vmsr" => 0,
        _ if base.starts_with("st") || base.starts_with("vst") || is_branch(base) || is_if_then(base) => 0,
        "ldm" | "ldmdb" | "pop" | "vldmia" | "vldmdb" | "vpop" => 0,
        "ldrd" | "umull" | "smull" | "umlal" | "smlal" | "umaal" => 2,
        // Two core registers from a double.
        "vmov" if operands.starts_with('r') && operands.matches(',').count() == 2 => 2,
        _ => 1,
    }
}

/// Whether the destination is an operand too.
fn updates(base: &str, operands: usize) -> bool {
    let accumulates = ["vmla", "vmls", "vnml", "vfm", "vfnm"].iter().any(|start| base.starts_with(start));
    let moves = base.starts_with("mov") || base.starts_with("mvn") || base.starts_with("ldr") || base.starts_with('v');
    accumulates || matches!(base, "movt" | "bfi" | "bfc" | "umlal" | "smlal" | "umaal") || operands == 2 && !moves
}

/// Reads the registers off an instruction.
pub fn access(instruction: &Instruction) -> Access {
    let base = base_mnemonic(instruction);
    let text = instruction.operands.as_str();
    let mut access = Access::default();
    let (plain, address) = text.split_once('[').unwrap_or((text, ""));
    let (before_list, list) = plain.split_once('{').unwrap_or((plain, ""));
    let operands: Vec<&str> = before_list.split(',').map(str::trim).filter(|operand| !operand.is_empty()).collect();

    let written = destinations(base, text);
    for (index, operand) in operands.iter().enumerate() {
        let Some(register) = register(operand) else { continue };
        let moves_list = !list.is_empty();
        if index < written && !moves_list {
            access.writes.push(register);
            if updates(base, operands.len()) || instruction.condition.is_some() {
                access.reads.push(register);
            }
        } else if moves_list {
            access.addresses.push(register);
        } else {
            access.reads.push(register);
        }
    }
    access.addresses.extend(address.split([',', ']', ' ', '!']).filter_map(register));
    add_list(&mut access, base, list);
    add_flags(&mut access, base, instruction);
    access
}

fn add_list(access: &mut Access, base: &str, list: &str) {
    let loads = base.starts_with("ld") || base.starts_with("vld") || base.ends_with("pop");
    for name in list.split([',', '}']).map(str::trim).filter(|name| !name.is_empty()) {
        let Some(register) = register(name) else { continue };
        access.listed += if name.starts_with('d') { 2 } else { 1 };
        if loads { access.writes.push(register) } else { access.reads.push(register) }
    }
}

fn add_flags(access: &mut Access, base: &str, instruction: &Instruction) {
    let compares = matches!(base, "cmp" | "cmn" | "tst" | "teq");
    let sets = instruction.condition.is_none() && base.ends_with('s') && !base.starts_with('v') && base != "mrs";
    if compares || sets && !is_branch(base) {
        access.writes.push(FLAGS);
    }
    if instruction.condition.is_some() || base.starts_with("vsel") || matches!(base, "adc" | "adcs" | "sbc" | "sbcs") {
        access.reads.push(FLAGS);
    }
    match base {
        "vcmp" | "vcmpe" => access.writes.push(FLOAT_FLAGS),
        "vmrs" => {
            access.reads.push(FLOAT_FLAGS);
            if instruction.operands.starts_with("apsr") {
                access.writes.push(FLAGS);
            }
        }
        _ => {}
    }
}

/// `r0` to `r12`, `sp`, `lr`, `pc`; `d0` to `d15`; `s0` to `s31`, which are halves of those.
fn register(name: &str) -> Option<usize> {
    let name = name.trim_end_matches('!');
    match name {
        "sp" => return Some(13),
        "lr" => return Some(14),
        "pc" => return Some(15),
        _ => {}
    }
    let number: usize = name.get(1..)?.parse().ok()?;
    match (name.as_bytes()[0], number) {
        (b'r', 0..=12) => Some(number),
        (b'd', 0..=15) => Some(FIRST_DOUBLE + number),
        (b's', 0..=31) => Some(FIRST_DOUBLE + number / 2),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(mnemonic: &str, operands: &str) -> Access {
        access(&Instruction {
            address: 0,
            mnemonic: mnemonic.to_owned(),
            operands: operands.to_owned(),
            condition: None,
        })
    }

    #[test]
    fn the_first_operand_is_written_and_the_others_read() {
        let access = of("vadd.f64", "d0, d1, d2");
        assert_eq!((access.writes, access.reads), (vec![17], vec![18, 19]));
    }

    #[test]
    fn an_accumulator_is_read_and_written() {
        let access = of("vmla.f64", "d0, d1, d2");
        assert_eq!((access.writes, access.reads), (vec![17], vec![17, 18, 19]));
        assert_eq!(of("adds", "r0, #0x1").reads, [0]);
        assert_eq!(of("mov", "r0, r1").reads, [1]);
    }

    #[test]
    fn stores_write_nothing_and_addresses_are_told_from_operands() {
        let access = of("str.w", "r1, [r2, r3, lsl #2]");
        assert_eq!((access.writes, access.reads, access.addresses), (vec![], vec![1], vec![2, 3]));
        let access = of("ldr", "r1, [sp, #0x4]");
        assert_eq!((access.writes, access.addresses), (vec![1], vec![13]));
    }

    #[test]
    fn lists_are_counted_in_words() {
        let pop = of("pop", "{r4, r5, pc}");
        assert_eq!((pop.writes, pop.listed), (vec![4, 5, 15], 3));
        let save = of("vstmia", "r0!, {d0, d1}");
        assert_eq!((save.reads, save.addresses, save.listed), (vec![17, 18], vec![0], 4));
    }

    #[test]
    fn moves_between_the_register_files_have_their_directions() {
        let out = of("vmov", "r0, r1, d3");
        assert_eq!((out.writes, out.reads), (vec![0, 1], vec![20]));
        let into = of("vmov", "d3, r0, r1");
        assert_eq!((into.writes, into.reads), (vec![20], vec![0, 1]));
    }

    #[test]
    fn flags_go_from_comparisons_to_conditions() {
        assert_eq!(of("cmp", "r0, r1").writes, [FLAGS]);
        assert_eq!(of("vcmp.f64", "d0, d1").writes, [FLOAT_FLAGS]);
        assert_eq!(of("vmrs", "apsr_nzcv, fpscr").writes, [FLAGS]);
        assert!(of("vselge.f64", "d0, d1, d2").reads.contains(&FLAGS));
        assert!(!of("bls", "elsewhere").writes.contains(&FLAGS));
    }
}
