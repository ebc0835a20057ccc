//! Rigs of the repository with their tables, designed once for all tests of a run.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, OnceLock};

use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};

/// Rig and table, of a rig file that is named without its ending.
pub(crate) fn designed(name: &'static str) -> &'static (Rig, TableValues) {
    type Designs = BTreeMap<&'static str, &'static OnceLock<(Rig, TableValues)>>;
    static ALL: Mutex<Designs> = Mutex::new(BTreeMap::new());
    let design_of_it = *ALL.lock().unwrap().entry(name).or_insert_with(|| Box::leak(Box::default()));
    // Outside the lock: others go on meanwhile.
    design_of_it.get_or_init(|| {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs"));
        let rig = Rig::from_path(&folder.join(format!("{name}.toml"))).unwrap();
        let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
        (rig, table)
    })
}
