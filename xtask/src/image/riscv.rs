//! Where RISC-V instructions lead. Far calls and switch tables take several instructions there, so register values are
//! followed as far as they are constants of the image.

use std::collections::HashMap;

use super::disassembly::{Instruction, number};
use super::elf::{Image, Named};
use super::flow::{Flow, StackMove};

/// What is known of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Value {
    /// This number.
    Constant(u64),
    /// A constant plus something computed.
    Within(u64),
    /// The word of so many bytes at this address.
    WordAt(u64, u64),
    /// Some word of so many bytes in the table at this address.
    WordOf(u64, u64),
}

/// Follows one function from its start to its end in the order of addresses.
pub struct Tracker<'a> {
    image: &'a Image,
    function: &'a Named,
    registers: HashMap<String, Value>,
}

impl<'a> Tracker<'a> {
    pub fn new(image: &'a Image, function: &'a Named) -> Self {
        Self { image, function, registers: HashMap::new() }
    }

    /// Where control goes from here; takes note of what the instruction does to registers.
    pub fn flow(&mut self, instruction: &Instruction<'_>) -> Flow {
        let Instruction { mnemonic, operands, .. } = *instruction;
        let parts: Vec<&str> = operands.split(',').map(str::trim).collect();
        let last = || parts.last().copied().and_then(number).map(i64::cast_unsigned);
        match (mnemonic, parts.as_slice()) {
            ("c.j", _) => last().map_or(Flow::Unknown, |to| Flow::Jump(vec![to])),
            ("jal", [link, ..]) => {
                let jump = *link == "zero";
                last().map_or(Flow::Unknown, |to| if jump { Flow::Jump(vec![to]) } else { self.call(vec![to]) })
            }
            ("c.jr", [register]) => self.jump(register, 0),
            ("c.jalr", [register]) => self.call_through(register, 0),
            ("jalr", [link, place]) => match (split_place(place), *link) {
                (Some((offset, register)), "zero") => self.jump(register, offset),
                (Some((offset, register)), _) => self.call_through(register, offset),
                _ => Flow::Unknown,
            },
            ("mret" | "c.unimp" | "unimp", _) => Flow::Return,
            _ if is_branch(mnemonic) => last().map_or(Flow::Unknown, |to| Flow::Jump(vec![to])),
            _ => {
                self.note(instruction, &parts);
                Flow::Straight
            }
        }
    }

    fn jump(&self, register: &str, offset: i64) -> Flow {
        match self.targets(register, offset) {
            Some(targets) => Flow::Jump(targets),
            // Nothing was put into the link register here: it still holds the caller.
            None if register == "ra" && offset == 0 => Flow::Return,
            None => Flow::Unknown,
        }
    }

    fn call_through(&mut self, register: &str, offset: i64) -> Flow {
        let targets = self.targets(register, offset);
        targets.map_or(Flow::Unknown, |targets| self.call(targets))
    }

    /// A call leaves only the saved registers as they were.
    fn call(&mut self, targets: Vec<u64>) -> Flow {
        self.registers.retain(|name, _| name.starts_with('s'));
        Flow::Call(targets)
    }

    fn targets(&self, register: &str, offset: i64) -> Option<Vec<u64>> {
        match *self.registers.get(register)? {
            Value::Constant(address) => Some(vec![address.wrapping_add_signed(offset)]),
            Value::WordAt(address, bytes) => Some(vec![self.image.word(address, bytes)?]),
            Value::WordOf(table, bytes) => self.entries(table, bytes),
            Value::Within(_) => None,
        }
    }

    /// Where a table of addresses leads. A table with a name and size is a table of functions; one without is a switch
    /// when its entries lie inside the function that reads it, and ends where they no longer do.
    fn entries(&self, table: u64, bytes: u64) -> Option<Vec<u64>> {
        let read = |index: u64| self.image.word(table + index * bytes, bytes);
        if let Some(named) = self.image.table_at(table) {
            let entries: Vec<u64> = (0..(named.end - table) / bytes).map_while(read).filter(|e| *e != 0).collect();
            let start =
                |entry: &u64| self.image.function_at(*entry).is_some_and(|f| self.image.functions[f].start == *entry);
            return entries.iter().all(start).then_some(entries);
        }
        let inside = |entry: &u64| self.function.start < *entry && *entry < self.function.end;
        let entries: Vec<u64> = (0..).map_while(read).take_while(inside).collect();
        (!entries.is_empty()).then_some(entries)
    }

    fn note(&mut self, instruction: &Instruction<'_>, parts: &[&str]) {
        if writes_memory(instruction.mnemonic) {
            return;
        }
        let Some(destination) = parts.first() else { return };
        match self.value(instruction, parts) {
            Some(value) => self.registers.insert((*destination).to_owned(), value),
            None => self.registers.remove(*destination),
        };
    }

    fn value(&self, instruction: &Instruction<'_>, parts: &[&str]) -> Option<Value> {
        let known = |name: &str| self.registers.get(name).copied();
        match (instruction.mnemonic, parts) {
            ("auipc", [_, high]) => {
                Some(Value::Constant(instruction.address.wrapping_add_signed(sign_extended(number(high)? << 12))))
            }
            ("lui" | "c.lui", [_, high]) => Some(Value::Constant(sign_extended(number(high)? << 12).cast_unsigned())),
            ("addi", [_, from, low]) | ("c.addi", [from, low]) => match known(from)? {
                Value::Constant(value) => Some(Value::Constant(value.wrapping_add_signed(number(low)?))),
                Value::Within(value) => Some(Value::Within(value.wrapping_add_signed(number(low)?))),
                _ => None,
            },
            ("c.mv", [_, from]) => known(from),
            ("add", [_, a, b]) | ("c.add", [a, b]) => match (known(a), known(b)) {
                (Some(Value::Constant(base)), None) | (None, Some(Value::Constant(base))) => Some(Value::Within(base)),
                _ => None,
            },
            ("ld" | "c.ld", [_, place]) => self.loaded(place, 8),
            ("lw" | "lwu" | "c.lw", [_, place]) => self.loaded(place, 4),
            _ => None,
        }
    }

    fn loaded(&self, place: &str, bytes: u64) -> Option<Value> {
        let (offset, register) = split_place(place)?;
        match *self.registers.get(register)? {
            Value::Constant(address) => Some(Value::WordAt(address.wrapping_add_signed(offset), bytes)),
            Value::Within(base) => Some(Value::WordOf(base.wrapping_add_signed(offset), bytes)),
            _ => None,
        }
    }
}

/// The 32-bit result of `lui` and `auipc` is widened with its sign.
fn sign_extended(value: i64) -> i64 {
    value << 32 >> 32
}

/// `0x10(ra)`: offset and register.
fn split_place(place: &str) -> Option<(i64, &str)> {
    let (offset, register) = place.trim().split_once('(')?;
    Some((number(offset)?, register.trim_end_matches(')')))
}

fn is_branch(mnemonic: &str) -> bool {
    matches!(mnemonic, "beq" | "bne" | "blt" | "bge" | "bltu" | "bgeu" | "c.beqz" | "c.bnez")
}

fn writes_memory(mnemonic: &str) -> bool {
    let plain = mnemonic.trim_start_matches("c.").trim_end_matches("sp");
    matches!(plain, "sb" | "sh" | "sw" | "sd" | "fsw" | "fsd")
}

/// What the instruction does to the stack pointer.
pub fn stack_move(instruction: &Instruction<'_>) -> StackMove {
    let Instruction { mnemonic, operands, .. } = *instruction;
    let parts: Vec<&str> = operands.split(',').map(str::trim).collect();
    if parts.first() != Some(&"sp") || writes_memory(mnemonic) || is_branch(mnemonic) {
        return StackMove::None;
    }
    let amount = parts.last().copied().and_then(number);
    match (mnemonic, parts.as_slice(), amount) {
        ("c.addi16sp" | "c.addi", _, Some(bytes)) | ("addi", [_, "sp", _], Some(bytes)) => {
            if bytes < 0 {
                StackMove::Down(bytes.unsigned_abs())
            } else {
                StackMove::None
            }
        }
        ("auipc" | "lui", ..) => StackMove::Switched,
        ("andi" | "c.andi", [_, .., _], Some(mask)) if mask < 0 => StackMove::Aligned(mask.unsigned_abs()),
        _ => StackMove::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::super::disassembly::instructions;
    use super::super::elf::Machine;
    use super::*;

    fn flows(image: &Image, text: &str) -> Vec<Flow> {
        let mut tracker = Tracker::new(image, &image.functions[0]);
        let all = instructions(text).map(|instruction| tracker.flow(&instruction));
        all.filter(|flow| *flow != Flow::Straight).collect()
    }

    #[test]
    fn far_calls_and_tail_calls_are_pairs_of_instructions() {
        let image = Image::of(Machine::RiscV, &[("f", 0x1000, 0x2000)], vec![]);
        let text = "1000:\t\tauipc\tra, 0x1\n1004:\t\tjalr\tra, -0x10(ra) <g>\n1008:\t\tauipc\tt1, 0xfffff\n\
                    100c:\t\tjalr\tzero, 0x20(t1) <h>\n1010:\t\tc.jr\tra\n1012:\t\tjal\tra, 0x3000 <g>\n1016:\t\tc.j\t0x4000 <h>\n";
        let text = text.replace(":\t\t", ": \t");
        let expected = [Flow::Call(vec![0x1ff0]), Flow::Jump(vec![0x28]), Flow::Return, Flow::Call(vec![0x3000])];
        assert_eq!(flows(&image, &text)[..4], expected);
        assert_eq!(flows(&image, &text)[4], Flow::Jump(vec![0x4000]));
    }

    const SWITCH: &str = "1000: \tauipc\ta1, 0x1\n1004: \tc.slli\ta0, 0x3\n1006: \taddi\ta1, a1, 0x0\n\
                          100a: \tc.add\ta0, a1\n100c: \tc.ld\ta0, 0x0(a0)\n100e: \tc.jr\ta0\n";

    #[test]
    fn a_switch_table_leads_into_its_own_function() {
        let words = [0x1010u64, 0x1020, 0x5000].iter().flat_map(|word| word.to_le_bytes()).collect();
        let image = Image::of(Machine::RiscV, &[("f", 0x1000, 0x2000)], vec![(0x2000, words)]);
        assert_eq!(flows(&image, SWITCH), [Flow::Jump(vec![0x1010, 0x1020])]);
    }

    #[test]
    fn a_table_that_leads_elsewhere_is_an_indirect_jump() {
        let words = 0x5000u64.to_le_bytes().to_vec();
        let image = Image::of(Machine::RiscV, &[("f", 0x1000, 0x2000)], vec![(0x2000, words)]);
        assert_eq!(flows(&image, SWITCH), [Flow::Unknown]);
        assert_eq!(flows(&image, "1000: \tc.jalr\ta5\n"), [Flow::Unknown]);
    }

    #[test]
    fn only_negative_steps_lower_the_stack() {
        let step = |mnemonic, operands| stack_move(&Instruction { address: 0, mnemonic, operands });
        assert_eq!(step("addi", "sp, sp, -0x7f0"), StackMove::Down(0x7f0));
        assert_eq!(step("c.addi16sp", "sp, -0x30"), StackMove::Down(0x30));
        assert_eq!(step("c.addi16sp", "sp, 0x30"), StackMove::None);
        assert_eq!(step("c.sdsp", "ra, 0x8(sp)"), StackMove::None);
        assert_eq!(step("andi", "sp, sp, -0x20"), StackMove::Aligned(32));
        assert_eq!(step("auipc", "sp, 0x5"), StackMove::Switched);
        assert_eq!(step("sub", "sp, sp, a0"), StackMove::Unknown);
    }
}
