//! What the tests of several crates share.

#![forbid(unsafe_code)]

pub mod equipment;
pub mod limits;
pub mod published;

use std::path::PathBuf;

/// The folder of the repository.
pub fn repository() -> PathBuf {
    let mut folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    assert!(folder.pop() && folder.pop(), "tests/support/ in the repository");
    folder
}
