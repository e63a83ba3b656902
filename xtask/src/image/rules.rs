//! What a flight image must not hold.

use std::collections::{BTreeMap, BTreeSet};

use super::calls::Graph;
use super::elf::{Image, demangled};

/// Kinds of things that must not be there; each is a metric of the budgets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rule {
    Panic,
    Formatting,
    Heap,
    SoftFloat,
    Recursion,
    IndirectCall,
}

impl Rule {
    pub const ALL: [Self; 6] =
        [Self::Panic, Self::Formatting, Self::Heap, Self::SoftFloat, Self::Recursion, Self::IndirectCall];

    /// Its name in `budgets.toml`.
    pub const fn metric(self) -> &'static str {
        match self {
            Self::Panic => "panicking_symbols",
            Self::Formatting => "formatting_symbols",
            Self::Heap => "heap_symbols",
            Self::SoftFloat => "soft_float_symbols",
            Self::Recursion => "recursive_cycles",
            Self::IndirectCall => "indirect_calls",
        }
    }
}

/// One thing found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    pub rule: Rule,
    /// A sentence for the developer.
    pub text: String,
}

/// Everything in an image that must not be there.
pub fn violations(image: &Image, graph: &Graph) -> Vec<Violation> {
    let mut found = Vec::new();
    let mut by_rule: BTreeMap<(Rule, String), BTreeSet<&str>> = BTreeMap::new();
    for symbol in image.symbols.keys() {
        if let Some((rule, what)) = forbidden(symbol) {
            by_rule
                .entry((rule, format!("{what}: {}", demangled(symbol))))
                .or_default()
                .extend(graph.callers(image.symbols[symbol]));
        }
    }
    for ((rule, text), callers) in by_rule {
        let by = if callers.is_empty() { String::new() } else { format!(", called by {}", listed(&callers)) };
        found.push(Violation { rule, text: format!("{text}{by}") });
    }
    for cycle in graph.cycles() {
        let names: Vec<&str> = cycle.iter().chain(cycle.first()).map(|node| graph.nodes[*node].name.as_str()).collect();
        found.push(Violation { rule: Rule::Recursion, text: format!("recursion: {}", names.join(" → ")) });
    }
    for node in &graph.nodes {
        for address in &node.unknown {
            let text = format!("indirect call or jump at {address:#x} in {}", node.name);
            found.push(Violation { rule: Rule::IndirectCall, text });
        }
    }
    found
}

/// Integer routines of the compiler's run-time library that the image holds: allowed, but each costs a call.
pub fn integer_helpers(image: &Image, graph: &Graph) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for symbol in image.symbols.keys().filter(|symbol| is_integer_helper(symbol)) {
        let callers = graph.callers(image.symbols[symbol]);
        if !callers.is_empty() {
            found.push(format!("{symbol}, called by {}", listed(&callers)));
        }
    }
    found
}

fn listed(names: &BTreeSet<&str>) -> String {
    names.iter().copied().collect::<Vec<_>>().join(", ")
}

fn forbidden(symbol: &str) -> Option<(Rule, &'static str)> {
    let name = demangled(symbol);
    let holds = |texts: &[&str]| texts.iter().any(|text| name.contains(text));
    if holds(&["core::panicking", "core::panic::", "rust_begin_unwind", "rust_panic"]) {
        Some((Rule::Panic, "panic"))
    } else if holds(&["core::fmt::"]) {
        Some((Rule::Formatting, "text formatting"))
    } else if name.starts_with("alloc::")
        || holds(&["__rust_alloc", "__rust_dealloc", "__rust_realloc", "__rg_alloc", "__rdl_alloc", "<alloc::"])
        || matches!(name.as_str(), "malloc" | "calloc" | "realloc" | "free")
    {
        Some((Rule::Heap, "heap"))
    } else {
        soft_float(&name).map(|what| (Rule::SoftFloat, what))
    }
}

/// Types of the run-time library's floating-point routines, as their names abbreviate them.
const FLOATS: [&str; 4] = ["hf", "sf", "df", "tf"];

/// What a floating-point routine of the compiler's run-time library does, when the symbol is one.
fn soft_float(name: &str) -> Option<&'static str> {
    const ARITHMETIC: &str = "floating-point arithmetic in software";
    const CONVERSION: &str = "conversion between integer and floating point in software (go through 32 bits)";
    if let Some(routine) = name.strip_prefix("__aeabi_") {
        let from_integer = ["i2", "ui2", "l2", "ul2"].iter().any(|prefix| routine.starts_with(prefix));
        let to_integer = ["d2", "f2"].iter().any(|p| routine.strip_prefix(p).is_some_and(|r| r.contains(['i', 'l'])));
        let compares = routine.starts_with("cd") || routine.starts_with("cf");
        return if from_integer || to_integer {
            Some(CONVERSION)
        } else if routine.starts_with(['d', 'f']) || routine.starts_with("h2") || compares {
            Some(ARITHMETIC)
        } else {
            None
        };
    }
    if name.starts_with("compiler_builtins::float") || name.starts_with("compiler_builtins::math") {
        return Some(ARITHMETIC);
    }
    if ["fma", "fmaf", "fmod", "fmodf", "sqrt", "sqrtf", "fmin", "fmax"].contains(&name) {
        return Some("mathematical function in software");
    }
    let routine = name.strip_prefix("__")?.trim_end_matches(char::is_numeric);
    let of_floats = FLOATS.iter().any(|float| routine.contains(float));
    if of_floats && ["fix", "float"].iter().any(|prefix| routine.starts_with(prefix)) {
        return Some(CONVERSION);
    }
    let operations = [
        "add", "sub", "mul", "div", "neg", "pow", "cmp", "eq", "ne", "lt", "le", "gt", "ge", "unord", "extend", "trunc",
    ];
    let operates = operations.iter().any(|operation| {
        routine
            .strip_prefix(operation)
            .is_some_and(|rest| FLOATS.iter().any(|float| rest.starts_with(float)) || rest == "idf2")
    });
    operates.then_some(ARITHMETIC)
}

fn is_integer_helper(symbol: &str) -> bool {
    let aeabi = ["uldivmod", "ldivmod", "lmul", "llsl", "llsr", "lasr", "uidiv", "idiv", "uidivmod", "idivmod"];
    let plain =
        ["div", "mod", "udiv", "umod", "udivmod", "divmod", "mul", "ashl", "ashr", "lshr", "clz", "ctz", "popcount"];
    if let Some(routine) = symbol.strip_prefix("__aeabi_") {
        return aeabi.contains(&routine);
    }
    let routine = symbol.strip_prefix("__").map(|name| name.trim_end_matches(char::is_numeric));
    routine.is_some_and(|routine| {
        ["si", "di", "ti"].iter().any(|int| routine.strip_suffix(int).is_some_and(|name| plain.contains(&name)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_formatting_and_allocators_are_named() {
        let rule = |symbol| forbidden(symbol).map(|(rule, _)| rule);
        assert_eq!(rule("_ZN4core9panicking18panic_bounds_check17h0123456789abcdefE"), Some(Rule::Panic));
        assert_eq!(rule("_ZN4core3fmt9Formatter3pad17h0123456789abcdefE"), Some(Rule::Formatting));
        assert_eq!(rule("__rust_alloc"), Some(Rule::Heap));
        assert_eq!(rule("_ZN5alloc7raw_vec12handle_error17h0123456789abcdefE"), Some(Rule::Heap));
        assert_eq!(rule("_ZN8fsw_core5model7orbiter7stepped17h0123456789abcdefE"), None);
    }

    #[test]
    fn software_floating_point_is_told_from_integer_helpers() {
        let floats = [
            "__aeabi_dadd",
            "__aeabi_fmul",
            "__aeabi_dcmplt",
            "__aeabi_cdcmple",
            "__adddf3",
            "__muldf3",
            "__ltdf2",
            "__aeabi_d2ulz",
            "__aeabi_l2d",
            "__floatundidf",
            "__fixdfdi",
            "__extendsfdf2",
            "__truncdfsf2",
            "fmod",
        ];
        for symbol in floats {
            assert_eq!(forbidden(symbol).map(|(rule, _)| rule), Some(Rule::SoftFloat), "{symbol}");
        }
        for symbol in ["__aeabi_uldivmod", "__udivdi3", "__aeabi_lmul", "__clzsi2", "__multi3"] {
            assert_eq!(forbidden(symbol), None, "{symbol}");
            assert!(is_integer_helper(symbol), "{symbol}");
        }
        for symbol in ["__aeabi_memcpy", "memcpy", "main", "__pre_init"] {
            assert_eq!(forbidden(symbol), None, "{symbol}");
            assert!(!is_integer_helper(symbol), "{symbol}");
        }
    }
}
