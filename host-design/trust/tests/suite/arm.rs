//! Arms: what they survive is what they survive in another program.

use upright::table::Law;
use upright_design::rig::Rig;
use upright_trust::verify::{AttractionSettings, largest_tilts};

use crate::published::{rig, table};

/// Largest tilts of each link alone (rad), in MuJoCo with the same table, as `arm_in_mujoco.py` prints them.
const IN_MUJOCO: [(&str, &[f64]); 3] = [
    ("single-qube-servo-2", &[0.4106]),
    ("single-srv02-rotary", &[0.4810]),
    ("double-quanser-rotary", &[0.2651, 0.1221]),
];

/// Largest tilt of each link of `machine` alone, with the law of `designed`.
fn tilts(designed: &Rig, machine: &Rig) -> Vec<f64> {
    let settings = AttractionSettings { relative: 2e-3, ..AttractionSettings::default() };
    let found = largest_tilts(machine, &table(designed), Law::Lqr, &settings).unwrap();
    found.iter().map(|tilt| tilt.edge.size).collect()
}

#[test]
fn the_largest_tilts_of_arms_are_those_of_mujoco() {
    for (name, wanted) in IN_MUJOCO {
        let rig = rig(name);
        let found = tilts(&rig, &rig);
        let close = |(found, wanted): (&f64, &f64)| (found / wanted - 1.0).abs() < 0.01;
        assert!(found.len() == wanted.len() && found.iter().zip(wanted).all(close), "{name}: {found:?}");
        // Negative control: links farther from the axis are another machine.
        let mut farther = rig.clone();
        farther.chain_mut().unwrap().links.iter_mut().for_each(|link| link.radius_m *= 1.3);
        let other = tilts(&rig, &farther);
        assert!(!close((&other[0], &wanted[0])), "{name}: {other:?}");
    }
}
