//! Small images with one fault each, compiled here, that the inspection must find; and one without.

use std::collections::HashMap;

use xshell::{Shell, cmd};

use super::{Inspection, Rule, Target, inspect};

const M7: Target = super::TARGETS[0];
const RV64: Target = super::TARGETS[1];

const HEAD: &str = r#"
#![no_std]
#![no_main]
use core::hint::black_box;

#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

#[repr(C)]
pub struct Vectors(u32, extern "C" fn() -> !);

#[unsafe(link_section = ".vector_table")]
#[unsafe(no_mangle)]
pub static VECTORS: Vectors = Vectors(0x2000_4000, start);

#[unsafe(no_mangle)]
pub extern "C" fn _start_trap() {}

#[unsafe(no_mangle)]
pub extern "C" fn start() -> ! {
    loop {
        black_box(work(black_box(3)));
    }
}
"#;

const SCRIPT: &str =
    "ENTRY(start) EXTERN(_start_trap) SECTIONS { . = 0; .vector_table : { KEEP(*(.vector_table)) } .text : { *(.text .text.*) }
.rodata : { *(.rodata .rodata.*) } .data 0x20000000 : { *(.data .data.*) } .bss : { *(.bss .bss.*) }
/DISCARD/ : { *(.ARM.exidx*) *(.eh_frame*) } }";

/// Compiles the head with the given rest for a target and inspects the image.
fn inspected(target: Target, body: &str, options: &[&str]) -> Inspection {
    let inspection = inspected_with(target, body, options, super::stack::frames_in_notes);
    let steps = inspection.stack.iter().flat_map(|bound| &bound.paths).flat_map(|path| &path.steps);
    assert!(steps.clone().next().is_none() || steps.clone().any(|step| step.source == super::stack::Source::Compiler));
    inspection
}

fn inspected_with(
    target: Target,
    body: &str,
    options: &[&str],
    frames: impl Fn(&str) -> HashMap<String, u64>,
) -> Inspection {
    let shell = Shell::new().unwrap();
    shell.change_dir(crate::workspace_root());
    let folder = shell.create_temp_dir().unwrap();
    let (source, script, image) =
        (folder.path().join("image.rs"), folder.path().join("image.x"), folder.path().join("image"));
    shell.write_file(&source, format!("{HEAD}{body}")).unwrap();
    shell.write_file(&script, SCRIPT).unwrap();
    let (triple, link) = (target.triple, format!("link-arg=-T{}", script.display()));
    let fixed = ["--edition=2024", "-Copt-level=2", "-Cpanic=abort", "-Ccodegen-units=1", "-Cremark=prologepilog"];
    let build = cmd!(shell, "rustc {fixed...} {options...} --target {triple} -C {link} -o {image} {source}").quiet();
    let output = build.ignore_status().output().unwrap();
    let notes = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{notes}");
    inspect(&shell, &image, &frames(&notes)).unwrap()
}

fn found(inspection: &Inspection) -> Vec<Rule> {
    let mut rules: Vec<Rule> = inspection.violations.iter().map(|violation| violation.rule).collect();
    rules.dedup();
    rules
}

const DOUBLE: [&str; 1] = ["-Ctarget-cpu=cortex-m7"];

const CLEAN: &str = "
#[inline(never)]
fn inner(x: u32) -> f64 { let mut area = [f64::from(x); 64]; black_box(&mut area); area[5] * 2.0 }
#[inline(never)]
fn work(x: u32) -> f64 {
    let mut area = [1u32; 16];
    black_box(&mut area);
    let picked = match black_box(x) { 0 => inner(4), 1 => 1.5, 2 => inner(7), 3 => 4.0, 4 => inner(9), _ => 9.0 };
    picked + inner(area[3])
}
static mut COUNT: u32 = 7;
#[unsafe(no_mangle)]
pub extern \"C\" fn count() -> u32 { unsafe { COUNT += 1; COUNT } }
";

#[test]
fn an_image_without_faults_passes_and_its_stack_is_bounded_on_both_targets() {
    for (target, options) in [(M7, &DOUBLE[..]), (RV64, &[])] {
        let inspection = inspected(target, CLEAN, options);
        assert_eq!(inspection.violations, [], "{}", target.name);
        let bound = inspection.stack.unwrap();
        // 512 bytes of `inner` below 64 bytes of `work`, and saved registers.
        let thread = bound.paths[0].bytes();
        assert!((576..720).contains(&thread), "{}: {thread}", target.name);
        assert!(bound.paths[0].steps.last().unwrap().name.contains("inner"), "{:?}", bound.paths[0]);
    }
}

#[test]
fn frames_told_by_the_compiler_and_read_from_the_instructions_agree() {
    for (target, options) in [(M7, &DOUBLE[..]), (RV64, &[])] {
        let told = inspected(target, CLEAN, options);
        let read = inspected_with(target, CLEAN, options, |_| HashMap::new());
        assert_eq!(told.stack.unwrap().bytes(), read.stack.unwrap().bytes(), "{}", target.name);
    }
}

#[test]
fn a_panic_is_found() {
    let body = "#[inline(never)] fn work(x: u32) -> u32 { let table = black_box([1u32, 2, 3]); table[x as usize] }";
    let inspection = inspected(M7, body, &DOUBLE);
    assert_eq!(found(&inspection)[0], Rule::Panic);
    let texts: Vec<_> = inspection.violations.iter().map(|violation| violation.text.as_str()).collect();
    assert!(texts.iter().any(|text| text.ends_with("panic_bounds_check, called by image::work")), "{texts:?}");
}

#[test]
fn software_floating_point_is_found() {
    let body = "#[inline(never)] fn work(x: u32) -> f64 { f64::from(x) * 1.5 }";
    let inspection = inspected(M7, body, &["-Ctarget-cpu=cortex-m4"]);
    assert_eq!(found(&inspection), [Rule::SoftFloat], "{:?}", inspection.violations);
    let wide = "#[inline(never)] fn work(x: u64) -> f64 { black_box(x) as f64 }";
    let inspection = inspected(M7, wide, &DOUBLE);
    assert_eq!(found(&inspection), [Rule::SoftFloat], "{:?}", inspection.violations);
    assert!(inspection.violations.iter().any(|violation| violation.text.contains("conversion between integer")));
}

#[test]
fn recursion_is_found_and_printed_as_a_cycle() {
    let body = "
#[inline(never)] fn odd(x: u32) -> u32 { if x == 0 { 0 } else { black_box(even(black_box(x - 1))) + 1 } }
#[inline(never)] fn even(x: u32) -> u32 { if x == 0 { 1 } else { black_box(odd(black_box(x - 1))) + 1 } }
#[inline(never)] fn work(x: u32) -> u32 { black_box(odd(x)) + 1 }";
    for (target, options) in [(M7, &DOUBLE[..]), (RV64, &[])] {
        let inspection = inspected(target, body, options);
        assert_eq!(found(&inspection), [Rule::Recursion], "{:?}", inspection.violations);
        let text = &inspection.violations[0].text;
        assert!(text.contains("image::odd → ") && text.contains("image::even → "), "{text}");
        assert!(inspection.stack.is_none());
    }
}

#[test]
fn an_indirect_call_is_found() {
    let body = "
fn one(x: u32) -> u32 { x + 1 }
fn two(x: u32) -> u32 { x + 2 }
#[inline(never)] fn work(x: u32) -> u32 { let f: fn(u32) -> u32 = if x > 2 { one } else { two }; black_box(f)(x) + 1 }";
    for (target, options) in [(M7, &DOUBLE[..]), (RV64, &[])] {
        let inspection = inspected(target, body, options);
        assert_eq!(found(&inspection), [Rule::IndirectCall], "{:?}", inspection.violations);
        assert!(inspection.violations[0].text.ends_with("in image::work"), "{:?}", inspection.violations);
    }
}

#[test]
fn an_allocator_is_found() {
    let body = "
extern crate alloc;
struct Bump;
unsafe impl core::alloc::GlobalAlloc for Bump {
    unsafe fn alloc(&self, _: core::alloc::Layout) -> *mut u8 { black_box(0x2000_0000 as *mut u8) }
    unsafe fn dealloc(&self, _: *mut u8, _: core::alloc::Layout) {}
}
#[global_allocator]
static HEAP: Bump = Bump;
#[inline(never)] fn work(x: u32) -> u32 { *black_box(alloc::boxed::Box::new(x)) }";
    let inspection = inspected(M7, body, &DOUBLE);
    assert!(found(&inspection).contains(&Rule::Heap), "{:?}", inspection.violations);
}

#[test]
fn flash_holds_initial_values_and_ram_holds_variables() {
    let inspection = inspected(M7, CLEAN, &DOUBLE);
    let section =
        |name: &str| inspection.sections.iter().find(|section| section.name == name).map(|s| (s.flash, s.ram));
    assert_eq!(section(".vector_table"), Some((8, 0)));
    assert!(section(".text").is_some_and(|(flash, ram)| flash > 0 && ram == 0));
    assert_eq!(inspection.flash, inspection.sections.iter().map(|section| section.flash).sum::<u64>());
}
