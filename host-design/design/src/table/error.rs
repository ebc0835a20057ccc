//! Why no table can be made.

use super::any_size::{MAX_MODEL_SENSORS, MAX_STATES};

/// Why no table can be made from a design.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoTable {
    /// The rig file asks for no control law.
    #[error("the rig file asks for no control law: add [lqr] or [pole_placement]")]
    NoLaw,
    /// A value is outside the range of single precision.
    #[error("{what} = {value:e} does not fit into single precision: choose units in which it does")]
    Range {
        /// Which value.
        what: &'static str,
        /// The value as `f32`.
        value: f32,
    },
    /// There is no swing-up for this rig.
    #[error("no table of a swing-up: {0}")]
    SwingUp(&'static str),
    /// The firmware's types are not compiled for these dimensions.
    #[error(
        "no gain table for {states} states and {sensors} sensors: a table holds up to {MAX_STATES} states; the controller of \
         a chain needs encoders on the cart and on every link, that of a model 1 to {MAX_MODEL_SENSORS} sensors"
    )]
    Size {
        /// States of the rig.
        states: usize,
        /// Sensors of the rig.
        sensors: usize,
    },
}

/// `value`, if `f32` can hold it.
pub(super) fn finite(what: &'static str, value: f32) -> Result<f32, NoTable> {
    if value.is_finite() { Ok(value) } else { Err(NoTable::Range { what, value }) }
}
