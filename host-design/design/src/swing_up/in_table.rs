//! From motions to the table of the firmware.

use super::SwingUpError;
use super::motion::SwingUp;
use crate::rig::Rig;
use crate::simulate::set_motion_thresholds;
use crate::table::{SwingUpValues, TableValues};

/// The table with the motions in it, and the thresholds with which the firmware supervises them.
///
/// # Errors
/// [`SwingUpError::Table`] if the motions do not fit the table; [`SwingUpError::Simulation`] if the runs for the thresholds
/// cannot be made.
pub fn with_motions(
    rig: &Rig,
    mut table: TableValues,
    motions: &SwingUp,
) -> Result<TableValues, SwingUpError> {
    table.swing_up = Some(SwingUpValues::of(rig, &table, motions)?);
    set_motion_thresholds(rig, &mut table)?;
    Ok(table)
}
