//! The image's instructions by address, read once from the disassembler's listing, and the blocks cut from it.

use super::CycleError;

/// One machine instruction in the assembler's own syntax, ready to be assembled again on its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Where it stands.
    pub address: u32,
    /// For example `vadd.f64`.
    pub mnemonic: String,
    /// For example `d0, d1, d2`; the target of a branch is [`TARGET`].
    pub operands: String,
    /// The condition under which an `it` before it makes it execute.
    pub condition: Option<&'static str>,
}

/// Stands for the target of any branch: its cost does not depend on where it goes.
pub const TARGET: &str = "elsewhere";

/// All instructions and function names of an image.
#[derive(Debug, Default)]
pub struct Listing {
    instructions: Vec<Instruction>,
    functions: Vec<(u32, String)>,
}

impl Listing {
    /// Reads what `llvm-objdump --disassemble --no-show-raw-insn` prints.
    pub fn parse(text: &str) -> Result<Self, CycleError> {
        let mut listing = Self::default();
        let mut conditions = Vec::new();
        for line in text.lines() {
            if let Some(function) = parse_function(line) {
                listing.functions.push(function);
            } else if let Some(mut instruction) = parse_instruction(line) {
                if instruction.mnemonic == "<unknown>" {
                    return Err(CycleError::Listing(line.trim().to_owned()));
                }
                if is_if_then(&instruction.mnemonic) {
                    conditions = if_then_conditions(&instruction);
                } else {
                    instruction.condition = conditions.pop();
                }
                listing.instructions.push(instruction);
            }
        }
        listing.instructions.sort_by_key(|instruction| instruction.address);
        listing.functions.sort_by_key(|function| function.0);
        Ok(listing)
    }

    /// The block of `count` instructions at an address; `None` when it is not all in the listing.
    pub fn block(&self, start: u32, count: usize) -> Option<&[Instruction]> {
        let first = self.instructions.binary_search_by_key(&start, |instruction| instruction.address).ok()?;
        self.instructions.get(first..first + count)
    }

    /// The address of a method of a type, however the compiler writes the type's parameters and trait.
    pub fn address_of_method(&self, type_name: &str, method: &str) -> Option<u32> {
        let matches = |name: &str| name.contains(type_name) && name.rsplit("::").next() == Some(method);
        self.functions.iter().find(|function| matches(&function.1)).map(|function| function.0)
    }

    /// The function that an address lies in.
    pub fn function_at(&self, address: u32) -> &str {
        let after = self.functions.partition_point(|function| function.0 <= address);
        after.checked_sub(1).map_or("(no symbol)", |index| &self.functions[index].1)
    }
}

/// `it`, `itt`, `ite`, …
pub fn is_if_then(mnemonic: &str) -> bool {
    mnemonic.strip_prefix("it").is_some_and(|rest| rest.len() <= 3 && rest.bytes().all(|b| b == b't' || b == b'e'))
}

/// `00000400 <name>:`; Rust's names are written out, without the hash that ends them.
fn parse_function(line: &str) -> Option<(u32, String)> {
    let (address, name) = line.split_once(" <")?;
    let name = name.strip_suffix(">:")?;
    Some((parse_hexadecimal(address)?, format!("{:#}", rustc_demangle::demangle(name))))
}

fn parse_hexadecimal(text: &str) -> Option<u32> {
    u32::from_str_radix(text, 16).ok()
}

/// `40c: beq 0x412 <name+0x12> @ imm = #0x2`, with tabs before mnemonic and operands; data words between functions are no instructions.
fn parse_instruction(line: &str) -> Option<Instruction> {
    let (address, rest) = line.split_once(':')?;
    let address = parse_hexadecimal(address.trim_start())?;
    let mut fields = rest.trim_start_matches(' ').strip_prefix('\t')?.splitn(2, '\t');
    let mnemonic = fields.next()?.trim();
    if mnemonic.starts_with('.') {
        return None;
    }
    let operands = plain_operands(fields.next().unwrap_or_default());
    Some(Instruction { address, mnemonic: mnemonic.to_owned(), operands, condition: None })
}

/// Operands without the disassembler's comment, and with [`TARGET`] for the target of a branch.
fn plain_operands(text: &str) -> String {
    let comment = text.find('@').unwrap_or(text.len());
    match text.find(" <") {
        Some(symbol) if symbol < comment => {
            let before_target = text[..symbol].rfind(' ').map_or(0, |space| space + 1);
            format!("{}{TARGET}", &text[..before_target])
        }
        _ => text[..comment].trim_end().to_owned(),
    }
}

/// Conditions of the instructions that an `it` covers, the first at the end of the list.
fn if_then_conditions(if_then: &Instruction) -> Vec<&'static str> {
    const PAIRS: [(&str, &str); 7] =
        [("eq", "ne"), ("hs", "lo"), ("mi", "pl"), ("vs", "vc"), ("hi", "ls"), ("ge", "lt"), ("gt", "le")];
    let given = if_then.operands.as_str();
    let pair = PAIRS.iter().find(|pair| pair.0 == given || pair.1 == given);
    let Some(&(first, second)) = pair else { return Vec::new() };
    let (then, otherwise) = if first == given { (first, second) } else { (second, first) };
    let letters = if_then.mnemonic.bytes().skip(1);
    letters.rev().map(|letter| if letter == b't' { then } else { otherwise }).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Cut from a listing of an optimised image.
    pub const LISTING: &str = "
image:	file format elf32-littlearm

Disassembly of section .text:

00000400 <_ZN4core5entry17h0123456789abcdefE>:
     400:      	bl	0x19f0 <__pre_init>     @ imm = #0x15ec
     404:      	ldr	r0, [pc, #0x38]         @ 0x440 <_ZN4core5entry17h0123456789abcdefE+0x40>
     406:      	cmp	r1, r0
     408:      	ite	hs
     40a:      	movhs	r2, #0x0
     40c:      	vmovlo.f64	d0, d1
     410:      	vadd.f64	d0, d0, d2
     414:      	cbz	r0, 0x41a <_ZN4core5entry17h0123456789abcdefE+0x1a> @ imm = #0x2
     416:      	nop
     418: 00 00 00 20  	.word	0x20000000

0000041c <_ZN79_$LT$fsw_core..probe..FrameMeter$LT$C$GT$$u20$as$u20$fsw_core..probe..Probe$GT$10frame_done17h0dfefa841300112fE>:
     41c:      	bx	lr
";

    #[test]
    fn a_block_is_cut_by_address_and_instruction_count() {
        let listing = Listing::parse(LISTING).unwrap();
        let block = listing.block(0x404, 2).unwrap();
        let text: Vec<String> = block.iter().map(|i| format!("{} {}", i.mnemonic, i.operands)).collect();
        assert_eq!(text, ["ldr r0, [pc, #0x38]", "cmp r1, r0"]);
    }

    #[test]
    fn a_block_outside_the_image_or_between_instructions_is_not_found() {
        let listing = Listing::parse(LISTING).unwrap();
        assert_eq!(listing.block(0x402, 1), None);
        assert_eq!(listing.block(0x2000_0000, 1), None);
        assert_eq!(listing.block(0x41c, 2), None);
    }

    #[test]
    fn targets_of_branches_are_replaced_and_comments_dropped() {
        let listing = Listing::parse(LISTING).unwrap();
        assert_eq!(listing.block(0x400, 1).unwrap()[0].operands, TARGET);
        assert_eq!(listing.block(0x414, 1).unwrap()[0].operands, format!("r0, {TARGET}"));
    }

    #[test]
    fn instructions_after_an_if_then_carry_their_conditions_and_the_next_carries_none() {
        let listing = Listing::parse(LISTING).unwrap();
        let conditions: Vec<_> = listing.block(0x408, 4).unwrap().iter().map(|i| i.condition).collect();
        assert_eq!(conditions, [None, Some("hs"), Some("lo"), None]);
    }

    #[test]
    fn an_address_names_its_function_and_a_method_its_address() {
        let listing = Listing::parse(LISTING).unwrap();
        assert_eq!(listing.function_at(0x410), "core::entry");
        assert_eq!(listing.function_at(0x3ff), "(no symbol)");
        assert_eq!(listing.address_of_method("probe::FrameMeter", "frame_done"), Some(0x41c));
        assert_eq!(listing.address_of_method("probe::FrameMeter", "done"), None);
    }

    #[test]
    fn an_instruction_that_the_disassembler_does_not_know_is_an_error() {
        let error = Listing::parse("     500:      	<unknown>\n").unwrap_err().to_string();
        assert!(error.contains("500"), "{error}");
    }
}
