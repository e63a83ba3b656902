//! Tests of the parameter tree as a whole.

use super::*;

#[test]
fn the_defaults_are_valid() {
    assert_eq!(Config::DEFAULT.validate(), Ok(()));
}
