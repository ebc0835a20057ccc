//! The boards, one file each. The cargo feature with the name of a board selects it.

pub(crate) mod data;
#[allow(dead_code, reason = "only one board is selected")]
mod discovery_f407;
#[allow(dead_code, reason = "only one board is selected")]
mod feather_f405;
#[allow(dead_code, reason = "only one board is selected")]
mod nucleo_f446;
#[allow(dead_code, reason = "only one board is selected")]
mod olimex_h405;
#[allow(dead_code, reason = "only one board is selected")]
mod weact_f405;

use data::BoardData;

/// All boards.
#[cfg_attr(target_os = "none", allow(dead_code, reason = "for the table of the documentation"))]
pub(crate) const ALL: [&BoardData; 5] = [
    &weact_f405::BOARD,
    &olimex_h405::BOARD,
    &feather_f405::BOARD,
    &discovery_f407::BOARD,
    &nucleo_f446::BOARD,
];

#[cfg(feature = "discovery-f407")]
pub(crate) use discovery_f407::BOARD;
#[cfg(feature = "feather-f405")]
pub(crate) use feather_f405::BOARD;
#[cfg(feature = "nucleo-f446")]
pub(crate) use nucleo_f446::BOARD;
#[cfg(feature = "olimex-h405")]
pub(crate) use olimex_h405::BOARD;
#[cfg(feature = "weact-f405")]
pub(crate) use weact_f405::BOARD;
