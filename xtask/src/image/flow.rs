//! What an instruction means for the call graph and for the stack.

/// Where control goes after an instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Flow {
    /// To the next instruction.
    Straight,
    /// To one of these and back.
    Call(Vec<u64>),
    /// To one of these, or past a condition to the next instruction.
    Jump(Vec<u64>),
    /// Back to the caller, or nowhere: a trap.
    Return,
    /// To a place that only the running program knows.
    Unknown,
}

/// What an instruction does to the stack pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StackMove {
    /// Nothing, or it gives back.
    None,
    /// Takes so many bytes.
    Down(u64),
    /// Rounds an address down to a multiple of so many bytes, perhaps for the stack pointer.
    Aligned(u64),
    /// Changes to another stack.
    Switched,
    /// Sets it to a value that only the running program knows.
    Unknown,
}
