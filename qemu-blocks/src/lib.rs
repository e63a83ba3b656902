//! A plugin for QEMU that counts how often every translation block of the guest ran, frame by frame.
//!
//! QEMU translates the guest's code into blocks: straight runs of instructions that end at a branch. The plugin adds
//! one inline counter to each, which costs a host instruction or two and no call, and callbacks only at the first
//! instructions of three functions of the guest: where a span of measured work begins, where it ends, and where a
//! frame, the sum of its spans, is closed. What a block costs is no concern of its: it writes executions,
//! and the host (`fsw_host::cycles`) puts cycles to them, so that one run serves any number of cost models.
//!
//! ```text
//! qemu-system-arm … -plugin libqemu_blocks.so,out=counts.bin,begin=0x1234,end=0x1300,close=0x1400
//! ```
//! `begin`, `end` and `close` are the addresses of those functions. The file's format is described in `recorder`.
//!
//! Two properties of QEMU that a reader of the counts should know. Under `-icount` a block that touches a device in its
//! middle is rolled back and cut there, so it counts once too often; measured frames touch none. And a block may be
//! translated again, cut short at the end of a time slice: it is then another block, with its own count.

mod recorder;

/// The plugin proper. Its functions of QEMU exist only inside QEMU, so tests, which are programs, leave it out.
#[cfg(all(unix, not(test)))]
mod plugin;
#[cfg(all(unix, not(test)))]
mod qemu;
