//! The messages between host and firmware. [`frame`](crate::protocol::frame) puts them into frames.
//!
//! A new request is a variant of [`Request`], with an answer in `firmware/commands.rs`; a new value to report is a
//! field of [`Telemetry`] or [`Statistics`]. Any change of these types raises [`PROTOCOL`].

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::board::Contacts;
use crate::control::controller::Rejected;
use crate::protocol::tick_log::TickLog;
use crate::supervision::fault::{Cause, Fault};
use crate::supervision::homing::Homing;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::jog::MotorSign;
use crate::supervision::shaking::{FORCES, Shaking};
use crate::supervision::sign_check::Signs;
use crate::supervision::supervisor::State;
use crate::table::{Equilibrium, Law};

/// Version of these messages; a host with another version must not send commands.
pub const PROTOCOL: u8 = 10;

/// A command, host to firmware.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Has to be larger than the id of every earlier command, even after a restart of the host (microseconds since
    /// 1970 are). A command with any other id is taken for a replay and ignored; but if the last command is repeated,
    /// its reply is sent again.
    pub id: u64,
    /// The request.
    pub request: Request,
}

/// The host's requests.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Heartbeat: shows that the host is alive, and does nothing else.
    KeepAlive,
    /// Home here: the cart is at its zero, and the links hang still or [swing](crate::supervision::swinging).
    Home,
    /// Home by the limit switches: a person pushes the cart to both and then lets the links hang still or swing.
    HomeRail,
    /// Start the [sign check](crate::supervision::sign_check).
    CheckSigns,
    /// Start balancing as soon as all links have been upright and slow for `arm_time_s` of the rig file.
    Arm,
    /// Motor off.
    Disarm,
    /// Clear a latched fault.
    Clear,
    /// Move the cart to this position (m).
    Setpoint(f32),
    /// Use this control law; only with the motor off.
    Select(Law),
    /// Report [`Info`].
    Info,
    /// Report the first cause of the fault, or of the last reset.
    Cause,
    /// Report where the program crashed the last time.
    Crash,
    /// Report [`Statistics`].
    Statistics,
    /// Set the counters of [`Statistics`] to 0, except those of the serial link.
    ResetStatistics,
    /// Send telemetry every n ticks; 0: never.
    Telemetry(u16),
    /// Bring the links to this equilibrium by a planned motion: raise those that hang, or lower those that balance. If
    /// all of them hang at the end, the motor is turned off; otherwise they are balanced there.
    Goto(Equilibrium),
    /// A key is held: push the cart a little with the motor, for as long as this is repeated. See
    /// [jog](crate::supervision::jog).
    Jog {
        /// Whether to push along +x, or against it.
        along: bool,
    },
    /// Shake the hanging rig with the forces that follow.
    Shake(Shaking),
    /// Forces for coming ticks, relative to the largest one: [`FULL`](crate::supervision::shaking::FULL) stands for
    /// all of it.
    Forces {
        /// Low 16 bits of the number of the tick that the first force is for.
        first: u16,
        /// One force for each tick.
        forces: [i8; FORCES],
    },
    /// Start sending a log of every tick (`true`), or stop (`false`).
    Log(bool),
    /// [Still](crate::supervision::stilling) links that swing or tumble.
    Still,
}

/// A message, firmware to host.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
// The larger variant is the frequent one.
#[allow(clippy::large_enum_variant)]
pub enum Message<const NX: usize, const NY: usize> {
    /// The state of one tick.
    Telemetry(Telemetry<NX, NY>),
    /// The answer to a command.
    Reply(Reply),
    /// Consecutive ticks of the log.
    Log(TickLog<NY>),
}

/// The reply to one command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// [`Command::id`] of the command.
    pub id: u64,
    /// The answer to it.
    pub answer: Answer,
}

/// The answer to a command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// The request was carried out.
    Done,
    /// Refused for now, because of these inhibits.
    NotNow(Inhibits),
    /// Refused: the request is invalid.
    Rejected(InvalidRequest),
    /// Answer to [`Request::Info`].
    Info(Info),
    /// Answer to [`Request::Cause`].
    Cause(Option<Cause>),
    /// Answer to [`Request::Crash`]; `None` if there was no crash since power-on, or the hardware keeps no record.
    Crash(Option<CrashRecord>),
    /// Answer to [`Request::Statistics`].
    Statistics(Statistics),
}

/// Why a request is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum InvalidRequest {
    /// The controller rejects it.
    Controller(Rejected),
    /// Invalid parameters for shaking: the largest force is not positive or exceeds the force limit, or the spring or
    /// damper constant is negative or not finite.
    Shaking,
}

impl core::fmt::Display for InvalidRequest {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            InvalidRequest::Controller(rejected) => rejected.fmt(f),
            InvalidRequest::Shaking => f.write_str("the rig cannot be shaken with these forces"),
        }
    }
}

/// Identity of a firmware: version, rig and image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// Its [`PROTOCOL`].
    pub protocol: u8,
    /// Version of this crate: major, minor, patch.
    pub version: [u8; 3],
    /// Hash of the rig file's values.
    pub rig_hash: u64,
    /// Control period (s): the gain table's, or, if the board's timer is set to another one, the timer's.
    pub tick_s: f32,
    /// Number of states.
    pub states: u8,
    /// Number of sensors.
    pub sensors: u8,
    /// Why the microcontroller started.
    pub reset: Reset,
    /// [Checksum](crate::flash_image) of the image in flash, which `upright firmware build` prints, too; 0 for a
    /// firmware that is not in flash.
    pub image: u32,
}

/// What a board knows when the firmware starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Start {
    /// Why the microcontroller started.
    pub reset: Reset,
    /// Where the program crashed the last time, if it has crashed since power-on.
    pub crash: Option<CrashRecord>,
    /// As [`Info::image`].
    pub image: u32,
}

impl From<Reset> for Start {
    fn from(reset: Reset) -> Self {
        Self { reset, ..Self::default() }
    }
}

/// What the board recorded of a crash, in words that only those who know its processor can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CrashRecord(pub [u32; 5]);

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
    /// The fault that caused the reset, if one did.
    pub fn fault(self) -> Option<Fault> {
        match self {
            Reset::Power => None,
            Reset::Watchdog => Some(Fault::Watchdog),
            Reset::Software => Some(Fault::Crash),
        }
    }
}

/// Counters since the start of the firmware, or since [`Request::ResetStatistics`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Statistics {
    /// Number of ticks.
    pub ticks: u32,
    /// Ticks that were not finished in time.
    pub overruns: u32,
    /// Single measurements that were rejected as implausible.
    pub rejected_samples: u32,
    /// Messages dropped because their queue was full.
    pub dropped: u32,
    /// Frames that could not be read.
    pub malformed: u32,
    /// Commands ignored because their id was not larger than the last one.
    pub replayed: u32,
}

/// State of the firmware in one tick. The values are exactly those that it computes with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Telemetry<const NX: usize, const NY: usize> {
    /// Number of the tick since the start of the firmware.
    pub tick: u32,
    /// State of the supervisor.
    pub state: State,
    /// The control law in use.
    pub law: Law,
    /// The latched fault.
    pub fault: Option<Fault>,
    /// Tick of the fault's first cause; 0 if there is none.
    pub cause_tick: u32,
    /// Progress of homing.
    pub homing: Homing,
    /// Progress of the sign check.
    pub signs: Signs,
    /// What is known about the motor's sign.
    pub motor: MotorSign,
    /// Inhibits of arming that hold now.
    pub arming_inhibits: Inhibits,
    /// Inhibits of the next motion that hold now: of lowering while the rig balances, otherwise of raising.
    pub swing_up_inhibits: Inhibits,
    /// Ticks since the beginning of the motion; 0 if there is none. After a motion that was cut short, where it ended.
    pub motion_tick: u32,
    /// Contacts and flags of this tick, as read.
    pub contacts: Contacts,
    /// Supply voltage of the power stage (V).
    pub supply_v: f32,
    /// Encoder counts, from position 0.
    pub counts: Vec<i32, NY>,
    /// Corrected estimate x̂ (m, m/s, rad, rad/s …).
    pub estimate: Vec<f32, NX>,
    /// Innovation e: measurement minus prediction (m or rad).
    pub innovation: Vec<f32, NY>,
    /// Governed set-point (m).
    pub setpoint_m: f32,
    /// Force requested by the control law (N).
    pub requested_n: f32,
    /// Force applied after all limits (N).
    pub applied_n: f32,
    /// Command to the power stage: a duty cycle from -1 to 1, or a force (N) for a rig without motor data.
    pub drive: f32,
    /// Execution time of the previous tick (processor cycles).
    pub cycles: u32,
    /// Longest execution time of a tick since the start of the firmware, in whatever state (processor cycles).
    pub worst_cycles: u32,
}
