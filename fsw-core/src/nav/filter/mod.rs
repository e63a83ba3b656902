//! Error-state filter.
