//! What QEMU calls: installation, each translation, the frame markers, the end.

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::fs::File;
use std::io::{self, BufWriter};
use std::sync::{Mutex, MutexGuard, OnceLock};

use crate::qemu::{self, Info, PluginId, Tb};
use crate::recorder::Recorder;

/// Version of the plugin interface that QEMU must speak; it refuses to load the plugin otherwise.
#[unsafe(no_mangle)]
pub static qemu_plugin_version: c_int = 1;

struct Session {
    recorder: Mutex<Recorder<BufWriter<File>>>,
    begin: u64,
    end: u64,
    close: u64,
}

static SESSION: OnceLock<Session> = OnceLock::new();

/// Called by QEMU once, before the guest starts. A result other than 0 makes QEMU refuse to start.
///
/// # Safety
/// Called by QEMU, which passes `argc` valid C strings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn qemu_plugin_install(
    id: PluginId,
    _info: *const Info,
    argc: c_int,
    argv: *const *const c_char,
) -> c_int {
    // SAFETY: QEMU passes `argc` valid C strings.
    let session = match Session::open(&unsafe { qemu::arguments(argc, argv) }) {
        Ok(session) => session,
        Err(reason) => {
            eprintln!("qemu-blocks: {reason}");
            return 1;
        }
    };
    if SESSION.set(session).is_err() {
        eprintln!("qemu-blocks: the plugin is loaded twice");
        return 1;
    }
    // SAFETY: `id` is ours, and the callbacks are functions of the types that QEMU calls.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
        qemu::qemu_plugin_register_atexit_cb(id, on_exit, std::ptr::null_mut());
    }
    0
}

impl Session {
    fn open(arguments: &[String]) -> Result<Self, String> {
        let find = |key: &str| {
            let value = arguments.iter().find_map(|argument| argument.strip_prefix(key)?.strip_prefix('='));
            value.ok_or(format!("argument {key}=… is missing"))
        };
        let address = |key: &str| {
            let text = find(key)?;
            let digits = text.strip_prefix("0x").unwrap_or(text);
            u64::from_str_radix(digits, 16).map_err(|_| format!("{key}={text} is no hexadecimal address"))
        };
        let path = find("out")?;
        let file = File::create(path).map_err(|error| format!("cannot create {path}: {error}"))?;
        let recorder = Recorder::new(BufWriter::new(file)).map_err(|error| format!("cannot write {path}: {error}"))?;
        let recorder = Mutex::new(recorder);
        Ok(Self { recorder, begin: address("begin")?, end: address("end")?, close: address("close")? })
    }

    fn recorder(&self) -> MutexGuard<'_, Recorder<BufWriter<File>>> {
        self.recorder.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Counts that cannot be written are worth nothing: the guest need not go on.
fn or_stop<T>(result: io::Result<T>) -> T {
    result.unwrap_or_else(|error| {
        eprintln!("qemu-blocks: cannot write the counts: {error}");
        std::process::abort()
    })
}

extern "C" fn on_translation(_id: PluginId, tb: *mut Tb) {
    let Some(session) = SESSION.get() else { return };
    // SAFETY: `tb` is valid during this call, and the instructions asked for are below its count.
    unsafe {
        let instructions = qemu::qemu_plugin_tb_n_insns(tb);
        let start = qemu::qemu_plugin_tb_vaddr(tb);
        let counter = or_stop(session.recorder().counter(start, instructions as u64));
        // The counter lives as long as the process; translated code is its only writer.
        qemu::qemu_plugin_register_vcpu_tb_exec_inline(tb, qemu::INLINE_ADD_U64, counter.as_ptr().cast(), 1);
        for index in 0..instructions {
            let instruction = qemu::qemu_plugin_tb_get_insn(tb, index);
            let address = qemu::qemu_plugin_insn_vaddr(instruction);
            let marker = if address == session.begin {
                on_begin
            } else if address == session.end {
                on_end
            } else if address == session.close {
                on_close
            } else {
                continue;
            };
            let nothing = std::ptr::null_mut();
            qemu::qemu_plugin_register_vcpu_insn_exec_cb(instruction, marker, qemu::CB_NO_REGS, nothing);
        }
    }
}

extern "C" fn on_begin(_vcpu: c_uint, _data: *mut c_void) {
    if let Some(session) = SESSION.get() {
        session.recorder().begin_span();
    }
}

extern "C" fn on_end(_vcpu: c_uint, _data: *mut c_void) {
    if let Some(session) = SESSION.get() {
        session.recorder().end_span();
    }
}

extern "C" fn on_close(_vcpu: c_uint, _data: *mut c_void) {
    if let Some(session) = SESSION.get() {
        or_stop(session.recorder().close_frame());
    }
}

extern "C" fn on_exit(_id: PluginId, _data: *mut c_void) {
    if let Some(session) = SESSION.get() {
        or_stop(session.recorder().finish());
    }
}
