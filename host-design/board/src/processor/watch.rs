//! What is remembered of a loop that may only wait.

use super::registers::Registers;
use crate::clock::Time;

/// The last iteration of a loop.
#[derive(Debug, Clone, Default)]
pub(crate) struct Watch {
    pub(crate) head: u32,
    pub(crate) since: Option<(Box<Registers>, Time, u64)>,
    pub(crate) turn: Option<(Time, u64)>,
    pub(crate) stored: bool,
}

impl Watch {
    pub(crate) fn forget(&mut self) {
        self.head = 0;
    }

    #[inline]
    pub(crate) fn stored(&mut self) {
        self.stored = true;
    }
}
