//! Where the firmware runs, and how it is started there.

use upright_board::Conditions;
use upright_closed_loop::harness::{HarnessError, Recording, Target, record, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_identify::{Log, shake_with};

use super::board::{Compared, VirtualBoard};
use super::error::RunError;

/// Where the firmware runs.
#[derive(Debug, Clone, Copy)]
pub enum RunPlace<'a> {
    /// In this process.
    Host,
    /// As the image that is flashed, on the virtual board.
    Board {
        /// The image.
        image: &'a upright_board::Image,
        /// Chip, wiring, clocks and supply of this board.
        conditions: Conditions,
    },
}

impl RunPlace<'_> {
    /// Its name, as shown to the user.
    pub fn name(self) -> &'static str {
        match self {
            RunPlace::Host => "this computer",
            RunPlace::Board { .. } => "the virtual board",
        }
    }

    /// Starts the firmware with `table` and runs `action` with it. The firmware is stopped when the action ends.
    ///
    /// # Errors
    /// Those of the start, and of `action`.
    pub fn with_target<R, E>(
        self,
        table: &TableValues,
        action: impl FnOnce(&mut dyn Target) -> Result<R, E>,
    ) -> Result<R, E>
    where
        E: From<HarnessError>,
    {
        match self {
            RunPlace::Host => with_firmware(table, action)?,
            RunPlace::Board { image, conditions } => {
                action(&mut VirtualBoard::start(image, &conditions, table)?)
            }
        }
    }
}

/// Runs `scenario` with the firmware of `table` against the plant of `rig`: see [`record`].
///
/// # Errors
/// [`RunError`] if the firmware does not run, or does not begin to balance.
pub fn run(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    place: RunPlace<'_>,
) -> Result<Recording, RunError> {
    place.with_target(table, |target| Ok(record(rig, table, scenario, target)?))
}

/// The log of the simulated machine of `rig`, which the firmware of `table` shakes: see [`shake_with`].
///
/// # Errors
/// [`RunError`] if the firmware does not run or turns the motor off, or the cart does not follow.
pub fn run_shaken(
    rig: &Rig,
    table: &TableValues,
    duration_s: f64,
    seed: u64,
    place: RunPlace<'_>,
) -> Result<Log, RunError> {
    place.with_target(table, |target| Ok(shake_with(rig, table, target, duration_s, seed)?))
}

/// Runs `scenario` on the virtual board as [`run`] does, and in each tick the firmware on the host with the inputs
/// that the board's image has latched. The duty must agree to the timer's clock, the number of pulses exactly, estimate
/// and telemetry in every bit. Returns the recording, and the numbers of ticks and of telemetry messages that were
/// compared.
///
/// # Errors
/// [`RunError`] as for [`run`], and if the two differ.
pub fn run_compared(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    board: &mut VirtualBoard,
) -> Result<(Recording, [u64; 2]), RunError> {
    with_firmware(table, |host| {
        let mut compared = Compared::new(board, host);
        let recording = record(rig, table, scenario, &mut compared)?;
        Ok((recording, [compared.ticks, compared.messages]))
    })?
}
