//! What an image holds: sections, functions, tables, and the memory that it takes.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
use object::{Architecture, Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind, elf};

/// Instruction sets of the flight computers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// Cortex-M.
    Thumb,
    /// `riscv64gc`.
    RiscV,
}

/// An allocated section.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    pub name: String,
    /// Bytes loaded from ROM, the initial values of `.data` included.
    pub flash: u64,
    /// Bytes of static RAM.
    pub ram: u64,
}

/// A named stretch of code or data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// As in the symbol table, mangled.
    pub name: String,
    pub start: u64,
    pub end: u64,
    /// The symbol table knows where it ends: so of everything that is compiled, not of all assembly.
    pub sized: bool,
}

impl Named {
    fn holds(&self, address: u64) -> bool {
        (self.start..self.end).contains(&address)
    }
}

/// An image, read.
#[derive(Debug)]
pub struct Image {
    pub machine: Machine,
    pub entry: u64,
    pub sections: Vec<Section>,
    /// In the order of their addresses, without overlap.
    pub functions: Vec<Named>,
    /// Every symbol with its address, aliases and undefined ones included.
    pub symbols: BTreeMap<String, u64>,
    tables: Vec<Named>,
    memory: Vec<(u64, Vec<u8>)>,
}

/// Sections that reserve the rest of the RAM for the run-time stack; their use is measured by other means.
const STACK_SECTION: &str = ".stack";
/// Bytes of a Cortex-M vector.
const VECTOR_BYTES: u64 = 4;

impl Image {
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        Self::parse(&bytes).with_context(|| path.display().to_string())
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let file = object::File::parse(bytes)?;
        let machine = match file.architecture() {
            Architecture::Arm => Machine::Thumb,
            Architecture::Riscv64 => Machine::RiscV,
            other => bail!("an image for {other:?}, expected ARM or 64-bit RISC-V"),
        };
        let allocated = || file.sections().filter(|section| has(section, elf::SHF_ALLOC));
        let memory = allocated().map(|s| Ok((s.address(), s.data()?.to_vec()))).collect::<Result<_>>()?;
        let named = |symbol: object::Symbol<'_, '_>| {
            Some((symbol.name().ok()?.to_owned(), symbol.address() & !thumb_bit(machine)))
        };
        Ok(Self {
            machine,
            entry: file.entry() & !thumb_bit(machine),
            sections: allocated().filter_map(|section| sized(&section)).collect(),
            functions: functions(&file, machine),
            symbols: file.symbols().filter_map(named).collect(),
            tables: tables(&file),
            memory,
        })
    }

    /// All bytes loaded from ROM.
    pub fn flash(&self) -> u64 {
        self.sections.iter().map(|section| section.flash).sum()
    }

    /// All bytes of static RAM.
    pub fn ram(&self) -> u64 {
        self.sections.iter().map(|section| section.ram).sum()
    }

    /// The function that holds an address, as an index into [`Self::functions`].
    pub fn function_at(&self, address: u64) -> Option<usize> {
        let after = self.functions.partition_point(|function| function.start <= address);
        let index = after.checked_sub(1)?;
        self.functions[index].holds(address).then_some(index)
    }

    /// The table of data that holds an address.
    pub fn table_at(&self, address: u64) -> Option<&Named> {
        self.tables.iter().find(|table| table.holds(address))
    }

    /// The stretch of data whose name, as a reader knows it, ends so.
    pub fn table_named(&self, end: &str) -> Option<&Named> {
        self.tables.iter().find(|table| demangled(&table.name).ends_with(end))
    }

    /// A little-endian word of the loaded image.
    pub fn word(&self, address: u64, bytes: u64) -> Option<u64> {
        let (start, data) =
            self.memory.iter().find(|(start, data)| (*start..start + data.len() as u64).contains(&address))?;
        let from = usize::try_from(address - start).ok()?;
        let word = data.get(from..from + usize::try_from(bytes).ok()?)?;
        Some(word.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
    }

    /// Entry addresses in the vector table of a Cortex-M, by exception number from 1 (reset); empty for other machines.
    pub fn vectors(&self) -> Vec<(u64, u64)> {
        let Some(table) = self.vector_table() else { return Vec::new() };
        let count = (table.end - table.start) / VECTOR_BYTES;
        let entry = |number| Some((number, self.word(table.start + number * VECTOR_BYTES, VECTOR_BYTES)? & !1));
        (1..count).filter_map(entry).filter(|(_, address)| *address != 0).collect()
    }

    fn vector_table(&self) -> Option<Named> {
        if self.machine != Machine::Thumb {
            return None;
        }
        // The architecture puts the table where the image starts.
        let (start, data) = self.memory.iter().filter(|(_, data)| !data.is_empty()).min_by_key(|(start, _)| *start)?;
        Some(Named { name: "vectors".into(), start: *start, end: start + data.len() as u64, sized: true })
    }
}

fn thumb_bit(machine: Machine) -> u64 {
    u64::from(machine == Machine::Thumb)
}

fn has<'a>(section: &impl ObjectSection<'a>, flag: elf::SectionFlags) -> bool {
    matches!(section.flags(), SectionFlags::Elf { sh_flags, .. } if sh_flags.contains(flag))
}

fn sized<'a>(section: &impl ObjectSection<'a>) -> Option<Section> {
    let name = section.name().ok()?.to_owned();
    let writable = has(section, elf::SHF_WRITE);
    let loaded = section.kind() != SectionKind::UninitializedData;
    let size = section.size();
    let flash = if loaded { size } else { 0 };
    let ram = if (writable || !loaded) && name != STACK_SECTION { size } else { 0 };
    (flash + ram > 0).then_some(Section { name, flash, ram })
}

/// Functions by address. Symbols without a type are taken where no sized function covers them: assembly has such ones.
fn functions(file: &object::File<'_>, machine: Machine) -> Vec<Named> {
    let code: Vec<_> =
        file.sections().filter(|s| s.kind() == SectionKind::Text).map(|s| (s.address(), s.size())).collect();
    let mut found: Vec<Named> = Vec::new();
    let mut labels: Vec<Named> = Vec::new();
    for symbol in file.symbols() {
        let (Ok(name), address) = (symbol.name(), symbol.address() & !thumb_bit(machine)) else { continue };
        let in_code = code.iter().any(|(start, size)| (*start..start + size).contains(&address));
        if !in_code || name.is_empty() || name.starts_with(['$', '.']) {
            continue;
        }
        let named =
            Named { name: name.to_owned(), start: address, end: address + symbol.size(), sized: symbol.size() > 0 };
        match symbol.kind() {
            SymbolKind::Text if symbol.size() > 0 => found.push(named),
            SymbolKind::Text | SymbolKind::Label | SymbolKind::Unknown => labels.push(named),
            _ => {}
        }
    }
    labels.retain(|label| !found.iter().any(|function| function.holds(label.start)));
    found.extend(labels);
    // The first name of an address wins; linker script labels (`__stext`) come last.
    found.sort_by_key(|function| (function.start, function.name.starts_with("__s"), function.end == function.start));
    found.dedup_by_key(|function| function.start);
    stretch(&mut found, &code);
    found
}

/// A function without a size reaches to the next one or to the end of its section.
fn stretch(functions: &mut [Named], code: &[(u64, u64)]) {
    for index in 0..functions.len() {
        let start = functions[index].start;
        if functions[index].end > start {
            continue;
        }
        let section_end = code.iter().map(|(from, size)| (*from, from + size)).find(|(a, b)| (*a..*b).contains(&start));
        let section_end = section_end.map_or(start, |(_, end)| end);
        let next = functions.get(index + 1).map_or(section_end, |function| function.start);
        functions[index].end = next.min(section_end);
    }
}

fn tables(file: &object::File<'_>) -> Vec<Named> {
    let data = file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Data && symbol.size() > 0);
    let named = data.filter_map(|symbol| {
        let (name, start) = (symbol.name().ok()?.to_owned(), symbol.address());
        Some(Named { name, start, end: start + symbol.size(), sized: true })
    });
    named.collect()
}

/// A symbol as a reader knows it.
pub fn demangled(symbol: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(symbol))
}

#[cfg(test)]
impl Image {
    /// An image of nothing but functions and words of memory.
    pub fn of(machine: Machine, functions: &[(&str, u64, u64)], memory: Vec<(u64, Vec<u8>)>) -> Self {
        let named = |(name, start, end): &(&str, u64, u64)| Named {
            name: (*name).into(),
            start: *start,
            end: *end,
            sized: false,
        };
        Self {
            machine,
            entry: 0,
            sections: Vec::new(),
            functions: functions.iter().map(named).collect(),
            symbols: functions.iter().map(|(name, start, _)| ((*name).into(), *start)).collect(),
            tables: Vec::new(),
            memory,
        }
    }
}
