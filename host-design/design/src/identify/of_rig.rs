//! Whether a log was recorded on a rig.

use std::path::Path;

use super::error::IdentifyError;
use super::log::{DriveScale, Log};
use crate::rig::Rig;

/// Checks that a log was recorded on the rig.
pub(super) fn is_of(rig: &Rig, log: &Log, file: &Path) -> Result<(), IdentifyError> {
    let other = |found: String, wanted: String, remedy: &str| {
        Err(IdentifyError::OtherRig { file: file.to_owned(), found, wanted, remedy: remedy.to_owned() })
    };
    let (header, channels) = (&log.header, rig.sensors().len());
    if header.rig != rig.name {
        return other(
            format!("{:?}", header.rig),
            format!("that of {:?}", rig.name),
            "name the rig file of this machine",
        );
    }
    if log.channels() != channels {
        return other(
            format!("{} encoders", log.channels()),
            format!("for {channels}"),
            "name the rig file that the firmware was built from",
        );
    }
    let period_ns = (rig.tick.period_s * 1e9).round();
    if f64::from(header.period_ns) != period_ns {
        return other(
            format!("a machine with a tick of {} ns", header.period_ns),
            format!("for {period_ns} ns"),
            "correct period_s in [tick], or record again",
        );
    }
    let has_motor = rig.actuator.motor.is_some();
    if has_motor != (header.drive == DriveScale::Duty) {
        let names = ["a machine that commands forces", "a machine that commands duties"];
        let (found, wanted) =
            (names[usize::from(!has_motor)], ["without a motor", "with a motor"][usize::from(has_motor)]);
        return other(
            found.to_owned(),
            wanted.to_owned(),
            "describe the motor in [actuator] as when it was recorded",
        );
    }
    Ok(())
}
