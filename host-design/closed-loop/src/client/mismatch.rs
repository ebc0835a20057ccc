//! Whether the firmware is the one that the host believes to talk to.

use upright::protocol::message::{Info, PROTOCOL};

use upright_design::rig::Rig;
use upright_design::table::TableValues;

/// The rig that the host believes to talk to, by the facts that the firmware reports in [`Info`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedRig {
    /// Hash of the rig file's values.
    pub hash: u64,
    /// Control period (s).
    pub tick_s: f32,
}

impl From<&Rig> for ExpectedRig {
    fn from(rig: &Rig) -> Self {
        Self { hash: rig.hash(), tick_s: rig.tick.period_s as f32 }
    }
}

impl From<&TableValues> for ExpectedRig {
    fn from(table: &TableValues) -> Self {
        Self { hash: table.rig_hash, tick_s: table.tick_s }
    }
}

/// The firmware is not the one that the host believes to talk to.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Mismatch {
    /// It uses another version of the messages.
    #[error(
        "the firmware speaks version {0} of the messages, this tool version {PROTOCOL}: build and flash the firmware \
         again, or use its own tool"
    )]
    Protocol(u8),
    /// It was built for another rig.
    #[error(
        "the firmware was built for a rig with hash {:016x} and runs at a tick of {} s, the rig file has {:016x} and \
         {} s: build and flash the firmware again, or give its own rig file",
        .found.hash, .found.tick_s, .wanted.hash, .wanted.tick_s
    )]
    Rig {
        /// The firmware's rig.
        found: ExpectedRig,
        /// The rig file's.
        wanted: ExpectedRig,
    },
    /// It was built for the rig, but its timer makes another tick.
    #[error(
        "the firmware was built for this rig, but its board's timer makes a tick of {found_s} s instead of {wanted_s} s: \
         set the timer to TICK_S of the gain table, and flash the firmware again"
    )]
    Tick {
        /// Tick of the timer (s).
        found_s: f32,
        /// Tick of the rig file (s).
        wanted_s: f32,
    },
}

impl Mismatch {
    /// Checks the version of the messages.
    ///
    /// # Errors
    /// [`Mismatch::Protocol`]
    pub fn check_protocol(info: &Info) -> Result<(), Self> {
        if info.protocol == PROTOCOL { Ok(()) } else { Err(Self::Protocol(info.protocol)) }
    }

    /// Checks the version of the messages, and that the firmware is that of the rig `wanted`.
    ///
    /// # Errors
    /// [`Mismatch`]
    pub fn check(info: &Info, wanted: ExpectedRig) -> Result<(), Self> {
        Self::check_protocol(info)?;
        let found = ExpectedRig { hash: info.rig_hash, tick_s: info.tick_s };
        if found.hash != wanted.hash {
            return Err(Self::Rig { found, wanted });
        }
        if found.tick_s != wanted.tick_s {
            return Err(Self::Tick { found_s: found.tick_s, wanted_s: wanted.tick_s });
        }
        Ok(())
    }
}
