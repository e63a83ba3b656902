//! The deepest stack that an image can need: sizes of the functions' frames along the deepest path of the call graph,
//! plus what exceptions put on top.

use std::collections::HashMap;

use anyhow::{Result, bail, ensure};

use super::calls::Graph;
use super::elf::{Image, Machine};

/// Who told the size of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The compiler, when it laid the frame out.
    Compiler,
    /// The function's own instructions: assembly and precompiled library routines have no other record.
    Instructions,
}

/// One function on a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    pub name: String,
    pub bytes: u64,
    pub source: Source,
}

/// The deepest path from one entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    pub entry: String,
    /// What the processor itself puts on the stack on entry.
    pub hardware_bytes: u64,
    pub steps: Vec<Step>,
    /// A handler that first changes to another stack: of the thread's it takes only what the processor puts there.
    pub on_own_stack: bool,
}

impl Path {
    pub fn bytes(&self) -> u64 {
        self.hardware_bytes + self.software_bytes()
    }

    /// The thread's stack is the one that start-up code changes to.
    fn of_thread(self) -> Self {
        Self { on_own_stack: false, ..self }
    }

    fn software_bytes(&self) -> u64 {
        self.steps.iter().map(|step| step.bytes).sum()
    }
}

/// The bound: the thread and the handlers that may stand on top of it and of each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bound {
    pub paths: Vec<Path>,
}

impl Bound {
    /// Of the thread's stack.
    pub fn bytes(&self) -> u64 {
        self.paths.iter().map(|path| if path.on_own_stack { path.hardware_bytes } else { path.bytes() }).sum()
    }

    /// Of the other stack, to which handlers change; each begins at its top, and one may interrupt another.
    pub fn own_bytes(&self) -> u64 {
        self.paths.iter().filter(|path| path.on_own_stack).map(Path::bytes).max().unwrap_or(0)
    }
}

/// Frame of a Cortex-M exception with floating-point registers (26 words) and the word that may align it.
const M7_EXCEPTION_BYTES: u64 = 27 * 4;
/// Cortex-M exception numbers with fixed priorities: they interrupt every other handler.
const RESET: u64 = 1;
const NMI: u64 = 2;
const HARD_FAULT: u64 = 3;
/// riscv-rt's common entry of interrupts and exceptions; it saves the registers in its own frame.
const RISCV_TRAP: &str = "_start_trap";
/// An interrupt, and a fault inside its handler: interrupts are off there.
const RISCV_TRAP_LEVELS: usize = 2;

/// Sizes of frames by symbol, from the compiler's notes: `… 24 stack bytes in function 'symbol'`.
pub fn frames_in_notes(notes: &str) -> HashMap<String, u64> {
    let parse = |line: &str| {
        let (before, after) = line.split_once(" stack bytes in function '")?;
        let bytes = before.rsplit(' ').next()?.parse().ok()?;
        Some((after.split('\'').next()?.to_owned(), bytes))
    };
    notes.lines().filter_map(parse).collect()
}

/// The bound of an image without recursion.
pub fn bound(image: &Image, graph: &Graph, frames: &HashMap<String, u64>) -> Result<Bound> {
    let mut depths = Depths { graph, frames, known: vec![None; graph.nodes.len()] };
    let mut paths = Vec::new();
    match image.machine {
        Machine::Thumb => {
            let mut deepest_of = |entry: &str, hardware, wanted: &dyn Fn(u64) -> bool| -> Result<Option<Path>> {
                let mut deepest: Option<Path> = None;
                for (number, address) in image.vectors().into_iter().filter(|(number, _)| wanted(*number)) {
                    let Some(start) = graph.at(address) else { bail!("vector {number} leads to no function") };
                    let path = depths.path(&format!("{entry} {number}"), hardware, start)?;
                    if deepest.as_ref().is_none_or(|best| best.bytes() < path.bytes()) {
                        deepest = Some(path);
                    }
                }
                Ok(deepest)
            };
            let thread = deepest_of("thread, vector", 0, &|number| number == RESET)?;
            paths.extend(thread.map(Path::of_thread));
            paths.extend(deepest_of("handlers with a priority, deepest: vector", M7_EXCEPTION_BYTES, &|n| {
                n > HARD_FAULT
            })?);
            paths.extend(deepest_of("hard fault, vector", M7_EXCEPTION_BYTES, &|number| number == HARD_FAULT)?);
            paths.extend(deepest_of("watchdog and other NMI, vector", M7_EXCEPTION_BYTES, &|number| number == NMI)?);
        }
        Machine::RiscV => {
            let Some(start) = graph.at(image.entry) else { bail!("the entry address leads to no function") };
            paths.push(depths.path("thread", 0, start)?.of_thread());
            let trap = image.symbols.get(RISCV_TRAP).and_then(|address| graph.at(*address));
            let Some(trap) = trap else { bail!("the image has no {RISCV_TRAP}, the entry of every trap") };
            for level in 1..=RISCV_TRAP_LEVELS {
                paths.push(depths.path(&format!("trap, level {level}"), 0, trap)?);
            }
        }
    }
    ensure!(!paths.is_empty(), "the image has no entry to measure the stack from");
    Ok(Bound { paths })
}

/// Deepest need below each function, found once.
struct Depths<'a> {
    graph: &'a Graph,
    frames: &'a HashMap<String, u64>,
    known: Vec<Option<Depth>>,
}

#[derive(Clone, Copy)]
struct Depth {
    bytes: u64,
    /// Where the deepest path goes on, and whether our frame stays below it.
    next: Option<(usize, bool)>,
}

impl Depths<'_> {
    fn path(&mut self, entry: &str, hardware_bytes: u64, start: usize) -> Result<Path> {
        let mut steps = Vec::new();
        let (mut here, mut on_own_stack) = (Some((start, true)), false);
        while let Some((node, is_entry)) = here {
            let depth = self.below(node, is_entry)?;
            let (bytes, source) = self.frame(node, is_entry)?;
            on_own_stack |= is_entry && self.graph.nodes[node].taken.switches;
            let stays = depth.next.is_none_or(|(_, stays)| stays);
            here = depth.next.map(|(next, _)| (next, is_entry && self.is_assembly_jump(node, next)));
            let name = self.graph.nodes[node].name.clone();
            steps.push(Step { name, bytes: if stays { bytes } else { 0 }, source });
        }
        Ok(Path { entry: entry.to_owned(), hardware_bytes, steps, on_own_stack })
    }

    fn frame(&self, node: usize, is_entry: bool) -> Result<(u64, Source)> {
        let node = &self.graph.nodes[node];
        if let Some(bytes) = self.frames.get(&node.symbol) {
            // The compiler does not count what it loses by aligning. Where the instructions take more, they are right.
            let taken = if node.taken.computed { bytes + node.taken.alignment } else { node.taken.bytes };
            return Ok((taken.max(*bytes), Source::Compiler));
        }
        // An entry sets the stack up.
        ensure!(
            !node.taken.computed || is_entry,
            "{} computes its stack pointer and has no record of its frame",
            node.name
        );
        Ok((node.taken.bytes + node.taken.alignment, Source::Instructions))
    }

    /// Start-up code in assembly may jump in several steps until the stack is set up.
    fn is_assembly_jump(&self, from: usize, to: usize) -> bool {
        let node = &self.graph.nodes[from];
        node.tails.contains(&to) && !self.frames.contains_key(&node.symbol)
    }

    fn below(&mut self, node: usize, is_entry: bool) -> Result<Depth> {
        if let Some(depth) = self.known[node] {
            return Ok(depth);
        }
        let (own, source) = self.frame(node, is_entry)?;
        let graph = self.graph;
        let mut deepest = Depth { bytes: own, next: None };
        // A compiled function gives its frame back before it jumps to another; of assembly nothing is known.
        let calls = graph.nodes[node].calls.iter().map(|next| (*next, true));
        let tails = graph.nodes[node].tails.iter().map(|next| (*next, source == Source::Instructions));
        for (next, stays) in calls.chain(tails) {
            let still_entry = is_entry && self.is_assembly_jump(node, next);
            let bytes = self.below(next, still_entry)?.bytes + if stays { own } else { 0 };
            if bytes > deepest.bytes || (bytes == deepest.bytes && deepest.next.is_none()) {
                deepest = Depth { bytes, next: Some((next, stays)) };
            }
        }
        self.known[node] = Some(deepest);
        Ok(deepest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_read_from_the_compilers_notes() {
        let notes = "note: src/main.rs:42:0 prologepilog (analysis): 24 stack bytes in function '_ZN1a1bE'\n\n\
                     note: <unknown>:0:0 prologepilog (analysis): 0 stack bytes in function 'main'\nwarning: else\n";
        assert_eq!(frames_in_notes(notes), HashMap::from([("_ZN1a1bE".into(), 24), ("main".into(), 0)]));
    }

    /// A vector table with reset at `a` and hard fault at `d`; `a` calls `b`, which jumps to `c`.
    fn image() -> (Image, Graph) {
        let vectors = [0x2000_0000u32, 0x101, 0, 0x131].iter().flat_map(|word| word.to_le_bytes()).collect();
        let functions = [("a", 0x100, 0x110), ("b", 0x110, 0x120), ("c", 0x120, 0x130), ("d", 0x130, 0x140)];
        let image = Image::of(Machine::Thumb, &functions, vec![(0, vectors)]);
        let text = "100: \tmsr\tmsp, r0\n102: \tbl\t0x110 <b>\n106: \tudf\t#0x0\n110: \tpush\t{r4, lr}\n\
                    112: \tb\t0x120 <c>\n120: \tsub\tsp, #0x20\n122: \tbx\tlr\n130: \tpush\t{r4, lr}\n132: \tb\t0x132\n";
        let graph = Graph::build(&image, text);
        (image, graph)
    }

    #[test]
    fn the_bound_adds_the_deepest_path_and_the_handlers() {
        let (image, graph) = image();
        let bound = bound(&image, &graph, &HashMap::new()).unwrap();
        let names: Vec<_> = bound.paths[0].steps.iter().map(|step| (step.name.as_str(), step.bytes)).collect();
        assert_eq!(names, [("a", 0), ("b", 8), ("c", 32)], "frames of assembly stay over a jump");
        assert_eq!(bound.bytes(), 40 + M7_EXCEPTION_BYTES + 8);
    }

    #[test]
    fn a_handler_on_a_stack_of_its_own_costs_the_thread_only_what_the_processor_saves() {
        let (image, _) = image();
        let text = "100: \tudf\t#0x0\n130: \tmsr\tmsp, r1\n132: \tpush\t{r4, lr}\n134: \tb\t0x134\n";
        let bound = bound(&image, &Graph::build(&image, text), &HashMap::new()).unwrap();
        assert_eq!((bound.bytes(), bound.own_bytes()), (M7_EXCEPTION_BYTES, M7_EXCEPTION_BYTES + 8));
    }

    #[test]
    fn a_compiled_function_gives_its_frame_back_before_it_jumps() {
        let (image, graph) = image();
        let frames = HashMap::from([("b".into(), 16), ("c".into(), 100)]);
        let bound = bound(&image, &graph, &frames).unwrap();
        assert_eq!(bound.paths[0].bytes(), 100);
        assert!(bound.paths[0].steps.iter().skip(1).all(|step| step.source == Source::Compiler));
    }

    #[test]
    fn a_computed_stack_pointer_without_a_record_is_an_error() {
        let functions = [("a", 0x100, 0x110), ("b", 0x110, 0x120)];
        let vectors = [0u32, 0x101].iter().flat_map(|word| word.to_le_bytes()).collect();
        let image = Image::of(Machine::Thumb, &functions, vec![(0, vectors)]);
        let graph = Graph::build(&image, "100: \tbl\t0x110 <b>\n104: \tudf\t#0x0\n110: \tmov\tsp, r4\n112: \tbx\tlr\n");
        let error = bound(&image, &graph, &HashMap::new()).unwrap_err();
        assert!(error.to_string().starts_with("b computes its stack pointer"), "{error}");
    }
}
