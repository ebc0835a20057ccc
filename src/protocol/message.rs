//! What the firmware and the host say to each other. [`crate::protocol::frame`] puts it into frames.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::control::controller::Rejected;
use crate::supervision::fault::{Cause, Fault};
use crate::supervision::homing::Homing;
use crate::supervision::inhibits::Reasons;
use crate::supervision::sign_check::Signs;
use crate::supervision::supervisor::State;
use crate::table::Law;

/// Version of these messages; a host that speaks another one must not send commands.
pub const PROTOCOL: u8 = 1;

/// A command, host to firmware.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Larger than that of every command before, over restarts of the host too (microseconds since 1970 are): a command
    /// that is not is a replay and ignored.
    pub id: u64,
    /// What to do.
    pub request: Request,
}

/// What the host may ask for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Nothing; tells that the host is there.
    Beat,
    /// Take positions from here: cart at its zero, links hanging still.
    Home,
    /// Take the cart's position from the limit switches, to which it is pushed by hand, then as for [`Request::Home`].
    HomeRail,
    /// Check the encoders' signs: see [`crate::supervision::sign_check`].
    CheckSigns,
    /// Balance as soon as all links have been upright and slow for the time set in the rig file.
    Arm,
    /// Motor off.
    Disarm,
    /// Forget a latched fault.
    Clear,
    /// Move the cart to this position (m).
    Setpoint(f32),
    /// Use this control law.
    Select(Law),
    /// Tell what this firmware is.
    Info,
    /// Tell the first cause of the fault, or of the last reset.
    Cause,
    /// Tell the counters of [`Statistics`].
    Statistics,
    /// Set these counters to 0.
    ResetStatistics,
    /// Send telemetry of every so many ticks; 0: of none.
    Telemetry(u16),
}

/// Firmware to host.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
// The larger one is the frequent one.
#[allow(clippy::large_enum_variant)]
pub enum Message<const NX: usize, const NY: usize> {
    /// One tick.
    Telemetry(Telemetry<NX, NY>),
    /// The answer to the command with this id.
    Reply {
        /// [`Command::id`].
        id: u64,
        /// The answer.
        answer: Answer,
    },
}

/// The answer to a command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// Done.
    Done,
    /// Not done, because of all of these.
    NotNow(Reasons),
    /// Not done: a request that makes no sense.
    Rejected(Rejected),
    /// [`Request::Info`]
    Info(Info),
    /// [`Request::Cause`]
    Cause(Option<Cause>),
    /// [`Request::Statistics`]
    Statistics(Statistics),
}

/// What a firmware is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// [`PROTOCOL`].
    pub protocol: u8,
    /// Version of this crate: major, minor, patch.
    pub version: [u8; 3],
    /// Hash of the rig file's values.
    pub rig_hash: u64,
    /// Control period (s).
    pub tick_s: f32,
    /// Number of states.
    pub states: u8,
    /// Number of sensors.
    pub sensors: u8,
    /// Why the microcontroller started.
    pub reset: Reset,
}

/// Why the microcontroller started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Reset {
    /// Power was switched on, or the reset pin was used.
    #[default]
    Power,
    /// The independent watchdog: ticks stopped.
    Watchdog,
    /// Software: a panic or a processor fault.
    Software,
}

impl Reset {
    /// The fault behind it, if it was one.
    pub fn fault(self) -> Option<Fault> {
        match self {
            Reset::Power => None,
            Reset::Watchdog => Some(Fault::Watchdog),
            Reset::Software => Some(Fault::Crash),
        }
    }
}

/// What has happened since the start, or since [`Request::ResetStatistics`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Statistics {
    /// Ticks.
    pub ticks: u32,
    /// Longest execution of a tick (processor cycles).
    pub worst_cycles: u32,
    /// Ticks that were not finished in time.
    pub overruns: u32,
    /// Single measurements that were rejected as implausible.
    pub rejected_samples: u32,
    /// Telemetry that found the buffer full.
    pub dropped: u32,
    /// Frames that could not be read.
    pub malformed: u32,
    /// Commands that came again, or late.
    pub replayed: u32,
}

/// One tick, in the firmware's own units and bits; conversion is the host's work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Telemetry<const NX: usize, const NY: usize> {
    /// Number of the tick since the start of the firmware.
    pub tick: u32,
    /// State of the supervisor.
    pub state: State,
    /// The latched fault.
    pub fault: Option<Fault>,
    /// Tick of its first cause; 0 without.
    pub cause_tick: u32,
    /// How far homing is.
    pub homing: Homing,
    /// How far the check of the encoders' signs is.
    pub signs: Signs,
    /// What stands against arming now.
    pub against: Reasons,
    /// Encoder counts from position 0.
    pub counts: Vec<i32, NY>,
    /// Current estimate x̂.
    pub estimate: Vec<f32, NX>,
    /// Innovation e (m or rad).
    pub innovation: Vec<f32, NY>,
    /// Governed set-point (m).
    pub setpoint: f32,
    /// Force the law asked for (N).
    pub requested: f32,
    /// Force within all limits (N).
    pub applied: f32,
    /// Command to the power stage: duty (1), or force (N) for a rig without motor data.
    pub drive: f32,
    /// Execution time of the tick before (processor cycles).
    pub cycles: u32,
}
