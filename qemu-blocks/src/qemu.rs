//! The functions of QEMU's plugin interface, version 1, that this plugin calls: own declarations, because QEMU's header
//! is in no Debian package that the build could ask for. QEMU resolves them when it loads the plugin.

use std::ffi::{c_char, c_int, c_uint, c_void};

/// Identifies the plugin to QEMU.
pub type PluginId = u64;

/// A translation block, while it is being translated.
#[repr(C)]
pub struct Tb {
    _opaque: [u8; 0],
}

/// An instruction of such a block.
#[repr(C)]
pub struct Insn {
    _opaque: [u8; 0],
}

/// Callbacks of this plugin read no guest registers.
pub const CB_NO_REGS: c_int = 0;
/// The inline operation "add an immediate to a 64-bit word".
pub const INLINE_ADD_U64: c_int = 0;

unsafe extern "C" {
    pub fn qemu_plugin_register_vcpu_tb_trans_cb(id: PluginId, callback: extern "C" fn(PluginId, *mut Tb));
    pub fn qemu_plugin_register_atexit_cb(
        id: PluginId,
        callback: extern "C" fn(PluginId, *mut c_void),
        data: *mut c_void,
    );
    pub fn qemu_plugin_tb_n_insns(tb: *const Tb) -> usize;
    pub fn qemu_plugin_tb_vaddr(tb: *const Tb) -> u64;
    pub fn qemu_plugin_tb_get_insn(tb: *const Tb, index: usize) -> *mut Insn;
    pub fn qemu_plugin_insn_vaddr(insn: *const Insn) -> u64;
    pub fn qemu_plugin_register_vcpu_tb_exec_inline(tb: *mut Tb, operation: c_int, word: *mut c_void, immediate: u64);
    pub fn qemu_plugin_register_vcpu_insn_exec_cb(
        insn: *mut Insn,
        callback: extern "C" fn(c_uint, *mut c_void),
        flags: c_int,
        data: *mut c_void,
    );
}

/// What QEMU tells about itself at the start; the plugin needs none of it.
#[repr(C)]
pub struct Info {
    _opaque: [u8; 0],
}

/// `key=value` arguments as QEMU hands them over.
///
/// # Safety
/// `argv` must hold `argc` pointers to C strings, as QEMU guarantees to `qemu_plugin_install`.
pub unsafe fn arguments(argc: c_int, argv: *const *const c_char) -> Vec<String> {
    (0..usize::try_from(argc).unwrap_or(0))
        .map(|index| {
            // SAFETY: the caller vouches for `argc` valid C strings.
            let text = unsafe { std::ffi::CStr::from_ptr(*argv.add(index)) };
            text.to_string_lossy().into_owned()
        })
        .collect()
}
