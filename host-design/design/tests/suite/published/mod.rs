//! The rig files of the repository.

// Each test program uses only some of these.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

use upright_design::rig::Rig;

/// Path of the rig file `name`.
pub(crate) fn rig_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs").join(name).with_extension("toml")
}

/// The rig in file `name`.
pub(crate) fn rig(name: &str) -> Rig {
    Rig::from_path(&rig_path(name)).unwrap()
}

/// A rig from text.
pub(crate) fn rig_of(text: &str) -> Rig {
    Rig::from_toml(text, Path::new("rig.toml")).unwrap_or_else(|error| panic!("{error}"))
}
