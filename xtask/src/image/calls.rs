//! Who calls whom, read from the disassembly.

use std::collections::BTreeSet;

use super::disassembly::{Instruction, instructions};
use super::elf::{Image, Machine, demangled};
use super::flow::{Flow, StackMove};
use super::riscv::{self, Tracker};
use super::thumb;

/// What a function takes from the stack according to its own instructions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    pub bytes: u64,
    /// Bytes that a rounding of addresses may add; it matters only where the stack pointer is computed.
    pub alignment: u64,
    /// It changes to another stack.
    pub switches: bool,
    /// It also sets the stack pointer to something computed.
    pub computed: bool,
}

/// A function and what it leads to.
#[derive(Debug)]
pub struct Node {
    /// As a reader knows it.
    pub name: String,
    /// As the linker knows it.
    pub symbol: String,
    pub start: u64,
    pub calls: BTreeSet<usize>,
    /// Functions jumped to: they return to our caller.
    pub tails: BTreeSet<usize>,
    /// Addresses of the instructions whose target only the running program knows.
    pub unknown: Vec<u64>,
    pub taken: Taken,
}

/// The call graph of an image.
#[derive(Debug)]
pub struct Graph {
    pub nodes: Vec<Node>,
}

impl Graph {
    /// Reads the disassembly of an image.
    pub fn build(image: &Image, disassembly: &str) -> Self {
        let mut graph = Self { nodes: image.functions.iter().map(|f| Node::new(&f.name, f.start)).collect() };
        let mut code: Vec<Vec<Instruction<'_>>> = vec![Vec::new(); graph.nodes.len()];
        for instruction in instructions(disassembly) {
            if let Some(function) = image.function_at(instruction.address) {
                code[function].push(instruction);
            }
        }
        for (function, instructions) in code.iter().enumerate() {
            graph.read(image, function, instructions);
        }
        graph
    }

    fn read(&mut self, image: &Image, function: usize, code: &[Instruction<'_>]) {
        let mut tracker = Tracker::new(image, &image.functions[function]);
        let (mut ended, mut previous) = (true, StackMove::None);
        for (index, instruction) in code.iter().enumerate() {
            let (flow, moved) = match image.machine {
                Machine::Thumb => (thumb::flow_within(code, index), thumb::stack_move(instruction)),
                Machine::RiscV => (tracker.flow(instruction), riscv::stack_move(instruction)),
            };
            if !is_padding(instruction) {
                ended = !matches!(flow, Flow::Straight | Flow::Call(_));
            }
            let node = &mut self.nodes[function];
            match moved {
                // The second half of the address of another stack.
                StackMove::Down(_) if previous == StackMove::Switched && image.machine == Machine::RiscV => {}
                StackMove::Down(bytes) => node.taken.bytes += bytes,
                StackMove::Aligned(bytes) => node.taken.alignment = node.taken.alignment.max(bytes),
                StackMove::Switched => node.taken.switches = true,
                StackMove::Unknown => node.taken.computed = true,
                StackMove::None => {}
            }
            previous = moved;
            match flow {
                Flow::Call(targets) => node.calls.extend(targets.iter().filter_map(|to| image.function_at(*to))),
                Flow::Jump(targets) => {
                    let others = targets.iter().filter_map(|to| image.function_at(*to)).filter(|to| *to != function);
                    node.tails.extend(others);
                }
                Flow::Unknown => node.unknown.push(instruction.address),
                Flow::Straight | Flow::Return => {}
            }
        }
        // Assembly may run on into the function behind it; compiled code may end in a call that never returns.
        let next = image.functions.get(function + 1).filter(|next| next.start == image.functions[function].end);
        if !ended && !image.functions[function].sized && next.is_some() {
            self.nodes[function].tails.insert(function + 1);
        }
    }

    /// The function that starts at an address.
    pub fn at(&self, address: u64) -> Option<usize> {
        self.nodes.binary_search_by_key(&address, |node| node.start).ok()
    }

    /// Names of the functions that lead to the one at an address.
    pub fn callers(&self, address: u64) -> BTreeSet<&str> {
        let Some(index) = self.at(address) else { return BTreeSet::new() };
        let leads = |node: &&Node| node.calls.contains(&index) || node.tails.contains(&index);
        self.nodes.iter().filter(leads).map(|node| node.name.as_str()).collect()
    }

    /// Every way back to where it came from that a walk through the graph finds; empty when nothing is recursive.
    pub fn cycles(&self) -> Vec<Vec<usize>> {
        let mut walk = Walk { graph: self, done: vec![false; self.nodes.len()], path: Vec::new(), cycles: Vec::new() };
        for node in 0..self.nodes.len() {
            walk.visit(node);
        }
        walk.cycles
    }
}

impl Node {
    fn new(symbol: &str, start: u64) -> Self {
        Self {
            name: demangled(symbol),
            symbol: symbol.to_owned(),
            start,
            calls: BTreeSet::new(),
            tails: BTreeSet::new(),
            unknown: Vec::new(),
            taken: Taken::default(),
        }
    }
}

struct Walk<'a> {
    graph: &'a Graph,
    done: Vec<bool>,
    path: Vec<usize>,
    cycles: Vec<Vec<usize>>,
}

impl Walk<'_> {
    fn visit(&mut self, node: usize) {
        if let Some(at) = self.path.iter().position(|step| *step == node) {
            self.cycles.push(self.path[at..].to_vec());
            return;
        }
        if self.done[node] {
            return;
        }
        self.path.push(node);
        let graph = self.graph;
        for next in graph.nodes[node].calls.union(&graph.nodes[node].tails) {
            self.visit(*next);
        }
        self.path.pop();
        self.done[node] = true;
    }
}

fn is_padding(instruction: &Instruction<'_>) -> bool {
    let nothing = instruction.mnemonic == "addi" && instruction.operands == "zero, zero, 0x0";
    nothing || matches!(instruction.mnemonic, "nop" | "nop.w" | "c.nop" | "c.unimp")
}

#[cfg(test)]
mod tests {
    use super::*;

    const FUNCTIONS: [(&str, u64, u64); 3] = [("a", 0x100, 0x10a), ("b", 0x10a, 0x110), ("c", 0x110, 0x118)];

    fn graph(text: &str) -> Graph {
        Graph::build(&Image::of(Machine::Thumb, &FUNCTIONS, vec![]), text)
    }

    #[test]
    fn calls_tail_calls_and_loops_are_told_apart() {
        let graph = graph(
            "100: \tpush\t{r7, lr}\n102: \tbl\t0x10a <b>\n106: \tpop\t{r7, pc}\n108: \tb\t0x102\n\
             10a: \tb\t0x110 <c>\n110: \tb\t0x110 <c>\n",
        );
        assert_eq!(graph.nodes[0].calls, BTreeSet::from([1]));
        assert!(graph.nodes[0].tails.is_empty(), "a loop is no tail call");
        assert_eq!(graph.nodes[1].tails, BTreeSet::from([2]));
        assert!(graph.nodes[2].tails.is_empty());
        assert_eq!(graph.nodes[0].taken, Taken { bytes: 8, ..Taken::default() });
        assert!(graph.cycles().is_empty());
        assert_eq!(graph.callers(0x110), BTreeSet::from(["b"]));
    }

    #[test]
    fn recursion_is_found_through_calls_and_tail_calls() {
        let graph =
            graph("100: \tbl\t0x10a <b>\n104: \tbx\tlr\n10a: \tb\t0x110 <c>\n110: \tbl\t0x100 <a>\n114: \tbx\tlr\n");
        assert_eq!(graph.cycles(), [vec![0, 1, 2]]);
    }

    #[test]
    fn a_function_that_calls_itself_is_recursive() {
        assert_eq!(graph("100: \tbl\t0x100 <a>\n104: \tbx\tlr\n").cycles(), [vec![0]]);
    }

    #[test]
    fn a_function_without_an_end_runs_on_into_the_next() {
        let graph = graph("100: \tmovs\tr0, #0x0\n102: \tnop\n10a: \tbx\tlr\n");
        assert_eq!(graph.nodes[0].tails, BTreeSet::from([1]));
    }

    #[test]
    fn calls_through_registers_are_kept_with_their_place() {
        assert_eq!(graph("100: \tblx\tr3\n102: \tbx\tlr\n").nodes[0].unknown, [0x100]);
    }
}
