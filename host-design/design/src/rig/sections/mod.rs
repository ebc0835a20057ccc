//! The sections of a rig file, one file each: its structure, the rows of its keys, and the checks that involve several
//! keys.
//!
//! A section of scalars is a structure declared with `keys!`; a new scalar key is one more row there. A section with
//! lists keeps its rows and its structure separate. A new section needs its file, an entry in [`SECTIONS`], and a
//! field of [`Rig`](super::Rig).

pub(super) mod actuator;
pub(super) mod chain;
pub(super) mod friction;
pub(super) mod imperfections;
pub(super) mod integral;
pub(super) mod kalman;
pub(super) mod limits;
pub(super) mod link;
pub(super) mod lqr;
pub(super) mod model;
pub(super) mod pole_placement;
pub(super) mod reality;
pub(super) mod robust;
pub(super) mod swing_up;
pub(super) mod tick;
pub(super) mod verify;

use super::key::{Absent, Key, Section};
use super::rule::Rule;

/// The keys above the first section.
pub static TOP: Section = Section {
    name: "",
    title: "the file",
    meaning: "at the top of the file",
    absent: Absent::Required,
    keys: &[&[Key {
        name: "name",
        unit: "",
        rule: Rule::checked_by_its_section("1 to 64 bytes of printable text"),
        meaning: "name of the rig",
        absent: Absent::Required,
    }]],
};

/// All sections, in the order of the documentation.
pub static SECTIONS: [&Section; 16] = [
    &chain::CART,
    &link::LINK,
    &chain::GRAVITY,
    &actuator::ACTUATOR,
    &tick::TICK,
    &lqr::LQR,
    &pole_placement::POLE_PLACEMENT,
    &kalman::KALMAN,
    &integral::INTEGRAL,
    &friction::FRICTION,
    &limits::LIMITS,
    &verify::VERIFY,
    &reality::REALITY,
    &robust::ROBUST,
    &swing_up::SWING_UP,
    &model::MODEL,
];
