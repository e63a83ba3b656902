//! What can be wrong with a scenario; every message is one clear sentence.

/// Why a scenario cannot be flown.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ScenarioError {
    /// The sentence: file, line, field, value, allowed range.
    pub message: String,
}
