//! The two ways: up and down.

use serde::Serialize;

use super::setting::hanging;

/// Which of the two motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// From hanging to upright; then it balances.
    Up,
    /// From upright to hanging; then the motor is off.
    Down,
}

impl Way {
    /// Both, in the order of a session.
    pub const BOTH: [Self; 2] = [Self::Up, Self::Down];

    /// States of rest at the start and the end of the motion.
    pub(super) fn ends(self, states: usize) -> [Vec<f64>; 2] {
        let (hanging, upright) = (hanging(states), vec![0.0; states]);
        match self {
            Self::Up => [hanging, upright],
            Self::Down => [upright, hanging],
        }
    }
}

impl core::fmt::Display for Way {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Up => "raising",
            Self::Down => "lowering",
        })
    }
}
