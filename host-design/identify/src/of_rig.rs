//! Whether a log was recorded on a rig.

use std::path::Path;

use upright_design::number::significant;
use upright_design::rig::{Actuator, Rig};

use crate::error::IdentifyError;
use crate::log::{DriveScale, Log};

/// Checks that a log was recorded on the rig.
pub(crate) fn is_of(rig: &Rig, log: &Log, file: &Path) -> Result<(), IdentifyError> {
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
    let [found, wanted] = [DriveKind::of_log(header.drive), DriveKind::of_rig(rig)];
    if found != wanted {
        return other(
            format!("a machine that commands {}", found.commands()),
            found.wanted(wanted).to_owned(),
            "describe the motor in [actuator] as when it was recorded",
        );
    }
    if let (DriveScale::Steps(step_m), Some(drive)) = (header.drive, rig.actuator.pulses())
        && (step_m / drive.step_m - 1.0).abs() > SAME_STEP
    {
        return other(
            format!("a drive with {} µm per pulse", significant(1e6 * step_m, 6)),
            format!("for {} µm", significant(1e6 * drive.step_m, 6)),
            "correct step_m in [actuator], or record again",
        );
    }
    Ok(())
}

/// Largest relative difference of two travels per pulse that are the same.
const SAME_STEP: f64 = 1e-6;

/// What a drive is commanded.
#[derive(Clone, Copy, PartialEq)]
enum DriveKind {
    Duty,
    Force,
    Pulses,
}

impl DriveKind {
    fn of_log(scale: DriveScale) -> Self {
        match scale {
            DriveScale::Duty => Self::Duty,
            DriveScale::Force(_) => Self::Force,
            DriveScale::Steps(_) => Self::Pulses,
        }
    }

    fn of_rig(rig: &Rig) -> Self {
        match &rig.actuator {
            Actuator::Force(_) => Self::Force,
            Actuator::Motor(..) => Self::Duty,
            Actuator::Pulses(_) => Self::Pulses,
        }
    }

    fn commands(self) -> &'static str {
        match self {
            Self::Duty => "duties",
            Self::Force => "forces",
            Self::Pulses => "pulses",
        }
    }

    /// How a rig file with this drive differs from one with `other`.
    fn wanted(self, other: Self) -> &'static str {
        match other {
            Self::Duty => "with a motor",
            Self::Force if self == Self::Duty => "without a motor",
            Self::Force => "with kind = \"force\"",
            Self::Pulses => "with kind = \"acceleration\"",
        }
    }
}
