//! Puts motions into the gain table of the firmware.

use super::SwingUpError;
use super::supervision::set_limits;
use upright_design::design::design;
use upright_design::motion::{PlannedMotion, RaiseAndLower, Transition};
use upright_design::rig::Rig;
use upright_design::table::{Gains, SwingUpValues, TableValues};

/// Adds to `table` raising and lowering, motions between other equilibria if there are any, and the limits and
/// thresholds with which the firmware supervises them.
///
/// # Errors
/// [`SwingUpError::Table`] if the motions do not fit the table; [`SwingUpError::Simulation`] if the runs for the limits
/// cannot be made.
pub fn with_motions(
    rig: &Rig,
    mut table: TableValues,
    motions: &RaiseAndLower,
    transitions: &[(Transition, PlannedMotion)],
) -> Result<TableValues, SwingUpError> {
    let mut swing_up = SwingUpValues::of(rig, &table, motions)?;
    for (transition, motion) in transitions {
        swing_up.add(&table, *transition, motion)?;
    }
    table.swing_up = Some(swing_up);
    set_limits(rig, &mut table)?;
    Ok(table)
}

/// The rig's gain table with the motions in it.
///
/// # Errors
/// As for [`with_motions`]; [`SwingUpError::Design`] if the rig has no gains.
pub fn designed_table(rig: &Rig, motions: &RaiseAndLower) -> Result<TableValues, SwingUpError> {
    designed_table_with(rig, motions, &[])
}

/// As [`designed_table`], also with motions between other equilibria.
///
/// # Errors
/// As for [`designed_table`].
pub fn designed_table_with(
    rig: &Rig,
    motions: &RaiseAndLower,
    transitions: &[(Transition, PlannedMotion)],
) -> Result<TableValues, SwingUpError> {
    with_motions(rig, TableValues::of(rig, &design(rig)?, Gains::Sampled)?, motions, transitions)
}
