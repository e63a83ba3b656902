//! The house stands in layers: who may name whom, and what the flight core must never name.

use system_tests::shipped_sources;

/// Modules of the core, ground floor first; each may import from itself and from those above it here.
const CORE_LAYERS: [&str; 15] = [
    "slot", "time", "probe", "units", "planet", "math", "frames", "model", "link", "sensors", "nav", "control",
    "guidance", "fault", "config",
];
/// The top floor may import everything.
const TOP: &str = "executive";
/// What the truth simulator may name of the core: constants, frames, time and packets, and the parameter tree, of which
/// its ground end keeps a copy to know the digest and the ranges. Never an equation.
const SHARED_WITH_TRUTH: [&str; 6] = ["time", "units", "planet", "frames", "link", "config"];

fn named_modules<'a>(text: &'a str, root: &str) -> Vec<&'a str> {
    let mut names = Vec::new();
    for (at, _) in text.match_indices(root) {
        let rest = &text[at + root.len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let end = group.find('}').expect("closed import group");
            names.extend(
                group[..end].split(',').filter_map(|item| item.trim().split("::").next()).filter(|n| !n.is_empty()),
            );
        } else {
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            names.push(&rest[..end]);
        }
    }
    names
}

fn code_lines(text: &str) -> String {
    text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_module_of_the_core_imports_only_from_the_floors_below_it() {
    let mut wrong = Vec::new();
    for (path, text) in shipped_sources("fsw-core/src") {
        let inside = path.trim_start_matches("fsw-core/src/");
        let module = inside.split(['/', '.']).next().expect("a file name");
        if module == TOP || module == "lib" {
            continue;
        }
        let floor = CORE_LAYERS.iter().position(|m| *m == module);
        let floor = floor.unwrap_or_else(|| panic!("{path}: module {module} has no floor"));
        for name in named_modules(&code_lines(&text), "crate::") {
            let other = CORE_LAYERS.iter().position(|m| *m == name);
            if other.is_none_or(|other| other > floor) {
                wrong.push(format!("{path} names crate::{name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_truth_simulator_never_names_the_flight_equations() {
    let mut wrong = Vec::new();
    for (path, text) in shipped_sources("hil-sim/src") {
        for name in named_modules(&code_lines(&text), "fsw_core::") {
            if !SHARED_WITH_TRUTH.contains(&name) {
                wrong.push(format!("{path} names fsw_core::{name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_core_depends_on_nothing_of_ours_but_the_square_root() {
    let manifest = std::fs::read_to_string(system_tests::workspace().join("fsw-core/Cargo.toml")).expect("manifest");
    for ours in ["hil-sim", "fsw-study", "fsw-host", "system-tests", "xtask"] {
        assert!(!manifest.contains(ours), "fsw-core names {ours}");
    }
}

#[test]
fn the_core_names_neither_std_nor_alloc_nor_a_clock() {
    for (path, text) in shipped_sources("fsw-core/src") {
        let code = code_lines(&text).replace("#[cfg(test)]\nextern crate std;", "");
        for word in ["std::", "extern crate", "alloc::", "Instant", "SystemTime", "unsafe ", "static mut"] {
            assert!(!code.contains(word), "{path} contains `{word}`");
        }
    }
}

#[test]
fn transcendental_functions_and_comparisons_go_through_one_module_each() {
    // Methods such as f64::sin do not exist without std: the bare-metal build proves that part.
    for (path, text) in shipped_sources("fsw-core/src") {
        if path.starts_with("fsw-core/src/math/") {
            continue;
        }
        let code = code_lines(&text);
        assert!(!code.contains("libm::"), "{path} calls libm past math::fun");
        for function in ["f64::max", "f64::min", "f64::clamp", ".mul_add("] {
            assert!(!code.contains(function), "{path} contains `{function}`");
        }
    }
}

#[test]
fn nalgebra_never_gets_its_std_feature() {
    // With it the matrix product is another one, with fused multiply-add on some machines: other bits.
    let output = std::process::Command::new(env!("CARGO"))
        .args([
            "tree",
            "--workspace",
            "--edges",
            "normal,build,dev,features",
            "--invert",
            "nalgebra",
            "--prefix",
            "none",
        ])
        .current_dir(system_tests::workspace())
        .output()
        .expect("cargo tree runs");
    let tree = String::from_utf8_lossy(&output.stdout);
    assert!(tree.contains("nalgebra v"), "cargo tree printed: {tree}{}", String::from_utf8_lossy(&output.stderr));
    for feature in ["nalgebra feature \"std\"", "nalgebra feature \"matrixmultiply\"", "nalgebra feature \"default\""] {
        assert!(!tree.contains(feature), "{feature} is switched on");
    }
}
