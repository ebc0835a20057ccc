//! The rig files of the repository.

// Each test program uses only some of these.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

use upright_design::design::{Certified, design};
use upright_design::rig::Rig;
use upright_design::swing_up::{Stored, SwingUp, motions};
use upright_design::table::{Gains, TableValues};

/// Path of the rig file `name`.
pub(crate) fn rig_path(name: &str) -> PathBuf {
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("rigs"));
    folders.find(|rigs| rigs.is_dir()).unwrap().join(name).with_extension("toml")
}

/// The rig in file `name`.
pub(crate) fn rig(name: &str) -> Rig {
    Rig::from_path(&rig_path(name)).unwrap()
}

/// The design of the rig in file `name`.
pub(crate) fn designed(name: &str) -> &'static Certified {
    certified(&rig(name))
}

/// The design of `rig`, made once for all tests. Every value of a rig is in its hash.
pub(crate) fn certified(rig: &Rig) -> &'static Certified {
    static DESIGNS: Mutex<BTreeMap<u64, &OnceLock<Certified>>> = Mutex::new(BTreeMap::new());
    let place = *DESIGNS.lock().unwrap().entry(rig.hash()).or_insert_with(|| Box::leak(Box::default()));
    place.get_or_init(|| design(rig).unwrap_or_else(|error| panic!("{}: {error}", rig.name)))
}

/// The stored motions of the rig in file `name`, restored once for all tests.
pub(crate) fn stored_motions(name: &'static str) -> &'static SwingUp {
    static RESTORED: Mutex<BTreeMap<&str, &OnceLock<SwingUp>>> = Mutex::new(BTreeMap::new());
    let place = *RESTORED.lock().unwrap().entry(name).or_insert_with(|| Box::leak(Box::default()));
    let restore = || motions(&rig(name), &Stored::beside(&rig_path(name)).unwrap());
    place.get_or_init(|| restore().unwrap_or_else(|error| panic!("{name}: {error}")))
}

/// The gain table of `rig`.
pub(crate) fn table(rig: &Rig) -> TableValues {
    TableValues::of(rig, certified(rig), Gains::Sampled).unwrap()
}

/// A rig from text.
pub(crate) fn rig_of(text: &str) -> Rig {
    Rig::from_toml(text, Path::new("rig.toml")).unwrap_or_else(|error| panic!("{error}"))
}
