//! What the tests of the innovation find.

use crate::supervision::fault::Fault;

/// This many implausible measurements in a row are a fault.
pub const IN_A_ROW: u32 = 3;

/// What the tests of a tick have found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Finding {
    /// [`Fault::Encoder`], [`Fault::Frozen`], [`Fault::Motor`] or [`Fault::Disturbed`].
    pub fault: Fault,
    /// The sensor (0: cart, 1: first link …).
    pub sensor: u8,
}
