//! The first exchange: both ends say which protocol and which packet shapes they speak.

use core::fmt;

use super::packet::{Hello, PROTOCOL_VERSION};
use super::schema::SCHEMA_HASH;

/// Why a peer is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HelloError {
    /// The peer speaks another version of the protocol.
    Version {
        /// The peer's version; ours is [`PROTOCOL_VERSION`].
        theirs: u16,
    },
    /// Same version, but the packets have other shapes: the peer is of another build.
    Schema {
        /// The peer's hash; ours is [`SCHEMA_HASH`].
        theirs: u64,
    },
}

impl fmt::Display for HelloError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version { theirs } => {
                write!(f, "the peer speaks protocol version {theirs}, this program version {PROTOCOL_VERSION}")
            }
            Self::Schema { theirs } => write!(
                f,
                "the peer's packets have another shape (schema hash {theirs:#018x}, here {SCHEMA_HASH:#018x}): \
                 build both ends from the same sources"
            ),
        }
    }
}

impl core::error::Error for HelloError {}

/// Identity of a build as it says hello: its version, hashed (FNV-1a).
#[must_use]
pub const fn build_id(version: &str) -> u64 {
    let (mut text, mut hash) = (version.as_bytes(), 0xcbf2_9ce4_8422_2325u64);
    while let [byte, rest @ ..] = text {
        hash = (hash ^ *byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
        text = rest;
    }
    hash
}

impl Hello {
    /// What this build says of itself.
    #[must_use]
    pub const fn ours(build_id: u64) -> Self {
        Self { protocol_version: PROTOCOL_VERSION, schema_hash: SCHEMA_HASH, build_id }
    }

    /// Whether a peer that says this can be talked to. The build may differ.
    ///
    /// # Errors
    /// What differs, the protocol version first: with another version the hash means nothing.
    pub const fn check(&self) -> Result<(), HelloError> {
        if self.protocol_version != PROTOCOL_VERSION {
            Err(HelloError::Version { theirs: self.protocol_version })
        } else if self.schema_hash != SCHEMA_HASH {
            Err(HelloError::Schema { theirs: self.schema_hash })
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn another_build_of_the_same_protocol_is_welcome() {
        assert_eq!(Hello::ours(42).check(), Ok(()));
    }

    #[test]
    fn another_version_is_refused_and_named() {
        let hello = Hello { protocol_version: PROTOCOL_VERSION + 1, schema_hash: 0, build_id: 0 };
        let error = hello.check().unwrap_err();
        assert_eq!(error, HelloError::Version { theirs: PROTOCOL_VERSION + 1 });
        assert!(error.to_string().contains("version 2"), "{error}");
    }

    #[test]
    fn another_schema_is_refused() {
        let hello = Hello { schema_hash: SCHEMA_HASH ^ 1, ..Hello::ours(0) };
        assert_eq!(hello.check(), Err(HelloError::Schema { theirs: SCHEMA_HASH ^ 1 }));
    }
}
