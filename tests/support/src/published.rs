//! The rig files of the repository, with their designs, tables and motions, each made once for all tests.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

use upright_design::design::{Certified, design};
use upright_design::motion::RaiseAndLower;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_plan::{Stored, motions, with_motions};

/// Path of the rig file `name`.
pub fn rig_path(name: &str) -> PathBuf {
    crate::repository().join("rigs").join(name).with_extension("toml")
}

/// The rig in file `name`.
pub fn rig(name: &str) -> Rig {
    Rig::from_path(&rig_path(name)).unwrap()
}

/// The rig that docs/first-hour.md describes, with a gear ratio of its own.
pub fn first_hour(gear_ratio: f64) -> Rig {
    let guide = std::fs::read_to_string(crate::repository().join("docs/first-hour.md")).unwrap();
    let (_, rest) = guide.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let geared = text.replace("gear_ratio = 6.3", &format!("gear_ratio = {gear_ratio:?}"));
    assert!(gear_ratio == 6.3 || geared != text);
    Rig::from_toml(&geared, Path::new("first-hour.toml")).unwrap()
}

/// The design of the rig in file `name`.
pub fn designed(name: &str) -> &'static Certified {
    certified(&rig(name))
}

/// Values that are made once for all tests, by the key that determines them.
type Once<K, T> = Mutex<BTreeMap<K, &'static OnceLock<T>>>;

/// The value known for `key`, or the one that `make` returns now. Tests that need another key do not wait meanwhile.
fn once<K: Ord, T>(known: &Once<K, T>, key: K, make: impl FnOnce() -> T) -> &'static T {
    let place = *known.lock().unwrap().entry(key).or_insert_with(|| Box::leak(Box::default()));
    place.get_or_init(make)
}

/// The design of `rig`, made once for all tests. Every value of a rig is in its hash.
pub fn certified(rig: &Rig) -> &'static Certified {
    static DESIGNS: Once<u64, Certified> = Mutex::new(BTreeMap::new());
    once(&DESIGNS, rig.hash(), || design(rig).unwrap_or_else(|error| panic!("{}: {error}", rig.name)))
}

/// The stored motions of the rig in file `name`, restored once for all tests.
pub fn stored_motions(name: &'static str) -> &'static RaiseAndLower {
    static RESTORED: Once<&str, RaiseAndLower> = Mutex::new(BTreeMap::new());
    let restore = || motions(&rig(name), &Stored::beside(&rig_path(name)).unwrap());
    once(&RESTORED, name, || restore().unwrap_or_else(|error| panic!("{name}: {error}")))
}

/// The rig in file `name` with its gain table, made once for all tests.
pub fn rig_and_table(name: &'static str) -> &'static (Rig, TableValues) {
    static ALL: Once<&str, (Rig, TableValues)> = Mutex::new(BTreeMap::new());
    once(&ALL, name, || {
        let rig = rig(name);
        let table = table(&rig);
        (rig, table)
    })
}

/// As [`rig_and_table`], with the stored motions in the table.
pub fn rig_and_table_with_motions(name: &'static str) -> &'static (Rig, TableValues) {
    static ALL: Once<&str, (Rig, TableValues)> = Mutex::new(BTreeMap::new());
    once(&ALL, name, || {
        let (rig, table) = rig_and_table(name).clone();
        let table = with_motions(&rig, table, stored_motions(name), &[]);
        (rig, table.unwrap_or_else(|error| panic!("{name}: {error}")))
    })
}

/// The gain table of `rig`.
pub fn table(rig: &Rig) -> TableValues {
    TableValues::of(rig, certified(rig), Gains::Sampled).unwrap()
}

/// A rig from text.
pub fn rig_of(text: &str) -> Rig {
    Rig::from_toml(text, Path::new("rig.toml")).unwrap_or_else(|error| panic!("{error}"))
}
