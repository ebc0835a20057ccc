//! Rigs, tables and runs shared by the closed-loop tests.

// Each test program uses only some of these.
#![allow(dead_code)]

use upright::table::Law;
use upright_design::rig::{Rig, Tick};
use upright_design::simulate::{Scenario, Sensing, Summary, simulate};
use upright_design::table::{Gains, TableValues};

pub(crate) use crate::published::{certified, rig, table};

pub(crate) const LAWS: [Law; 2] = Law::ALL;

/// The rig whose gains are in `src/gains.rs`: the one with that name in `rigs/`, whatever its file is called.
pub(crate) fn rig_of_the_firmware() -> Rig {
    let wanted = crate::gains::RIG;
    std::fs::read_dir(upright_test_support::repository().join("rigs"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .filter_map(|path| Rig::from_path(&path).ok())
        .find(|rig| rig.name == wanted)
        .unwrap_or_else(|| panic!("src/gains.rs is for the rig {wanted:?}: put its rig file into rigs/"))
}

/// The paper's rig with another tick.
pub(crate) fn paper_at(period_s: f64, delay_ticks: u8) -> Rig {
    let mut rig = rig("quadruple-paper");
    rig.tick = Tick { period_s, delay_ticks };
    rig
}

/// The same as [`table`], but without the governor, which shapes steps of the set-point: the law alone, as the paper
/// simulates it.
pub(crate) fn raw_table(rig: &Rig) -> TableValues {
    table(rig).without_governor()
}

/// A table with the gains for continuous time, as in the paper.
pub(crate) fn continuous_table(rig: &Rig) -> TableValues {
    TableValues::of(rig, certified(rig), Gains::Continuous).unwrap().without_governor()
}

/// Ten seconds at rest with the whole state measured, as the paper simulates it.
pub(crate) fn at_rest(rig: &Rig, law: Law) -> Scenario {
    Scenario { sensing: Sensing::FullState, ..Scenario::at_rest(rig, law) }
}

pub(crate) fn run(rig: &Rig, table: &TableValues, scenario: &Scenario) -> Summary {
    simulate(rig, table, scenario).unwrap_or_else(|error| panic!("{}: {error}", rig.name)).1
}

/// A step of 1 m from rest.
pub(crate) fn metre_step(rig: &Rig, law: Law, duration_s: f64) -> Scenario {
    Scenario { step_m: 1.0, duration_s, ..at_rest(rig, law) }
}

/// A run that starts with the first link tilted by `angle` (rad) and no further disturbance.
pub(crate) fn lean(rig: &Rig, law: Law, angle: f64) -> Scenario {
    let mut scenario = at_rest(rig, law);
    scenario.start[2] = angle;
    scenario
}
