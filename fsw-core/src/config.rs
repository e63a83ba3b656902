//! The parameter tree.
