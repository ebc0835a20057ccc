//! The host's end of a conversation with a firmware.

use std::time::Duration;

use upright::protocol::KEEP_ALIVE;
use upright::protocol::frame::Receiver;
use upright::protocol::message::{Answer, Info, Message, PROTOCOL, Reply, Request, Telemetry};
use upright::protocol::serial_link::MAX_MESSAGE;
use upright::protocol::tick_log::TickLog;

use super::request_queue::{RequestQueue, Unanswered};
use crate::table::{MAX_SENSORS, MAX_STATES};

/// Telemetry of a firmware of any size: its frames are the same bytes whatever the capacity of the lists.
pub type AnyTelemetry = Telemetry<MAX_STATES, MAX_SENSORS>;

/// A part of the tick log (a record of every tick), of a firmware of any size.
pub type AnyTickLog = TickLog<MAX_SENSORS>;

/// The firmware is not the one that the host believes to talk to.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mismatch {
    /// It uses another version of the messages.
    #[error(
        "the firmware speaks version {0} of the messages, this tool version {PROTOCOL}: build and flash the firmware \
         again, or use its own tool"
    )]
    Protocol(u8),
    /// It was built for another rig.
    #[error(
        "the firmware was built for a rig with hash {found:016x}, the rig file has {wanted:016x}: build and flash the \
         firmware again, or give its own rig file"
    )]
    Rig {
        /// Hash in the firmware.
        found: u64,
        /// Hash of the rig file.
        wanted: u64,
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

    /// Checks the version of the messages, and that the firmware is that of the rig with the hash `wanted`.
    ///
    /// # Errors
    /// [`Mismatch`]
    pub fn check(info: &Info, wanted: u64) -> Result<(), Self> {
        Self::check_protocol(info)?;
        let found = info.rig_hash;
        if found == wanted { Ok(()) } else { Err(Self::Rig { found, wanted }) }
    }
}

/// What a firmware has sent.
#[derive(Debug, Clone, PartialEq)]
// The larger variant is the frequent one.
#[allow(clippy::large_enum_variant)]
pub enum Received {
    /// The state of one tick.
    Telemetry(AnyTelemetry),
    /// The answer to a command.
    Answer {
        /// Number of the command.
        id: u64,
        /// Its request; none if it was answered before, was given up, or is somebody else's.
        request: Option<Request>,
        /// The answer.
        answer: Answer,
    },
    /// Consecutive ticks of the log.
    Log(AnyTickLog),
}

/// The host's end of a serial line. Nothing here reads or writes the line: received bytes go in, bytes to send come
/// out. Commands are numbered by the time since 1970 (`now`), so that numbers grow from one program to the next; where
/// it stays 0, they are numbered from 1.
#[derive(Default)]
pub struct Client {
    requests: RequestQueue,
    receiver: Receiver<MAX_MESSAGE>,
    keeps_alive: bool,
    next_keep_alive: Duration,
    /// Frames that could not be read.
    pub damaged: u32,
}

impl Client {
    /// Sends a request as soon as those before it are answered, and repeats it until it is answered. Disarming is sent
    /// at once, and replaces what a person has asked for before; returns what was given up for it.
    pub fn send(&mut self, request: Request, now: Duration) -> Vec<Unanswered> {
        self.requests.send(request, now)
    }

    /// Sends a request at once, whatever waits for its answer. It is not repeated. Returns its number.
    pub fn send_once(&mut self, request: Request, now: Duration) -> u64 {
        self.requests.send_once(request, now)
    }

    /// Sends a request that the next one replaces: a keep-alive, or a held key. It is not repeated, and it is skipped
    /// while another command waits for its answer.
    pub fn hold(&mut self, request: Request, now: Duration) {
        if !self.is_waiting() {
            self.send_once(request, now);
        }
    }

    /// From now on, [`poll`](Self::poll) sends keep-alives.
    pub fn keep_alive(&mut self) {
        self.keeps_alive = true;
    }

    /// Sends what is due: a request again that waits for its answer, the keep-alive. Returns the requests that have
    /// waited for too long, each once.
    pub fn poll(&mut self, now: Duration) -> Vec<Unanswered> {
        let unanswered = self.requests.repeat(now);
        if self.keeps_alive && now >= self.next_keep_alive {
            self.hold(Request::KeepAlive, now);
            self.next_keep_alive = now + KEEP_ALIVE;
        }
        unanswered
    }

    /// Takes a received byte; returns the message that it completes, if any.
    pub fn receive(&mut self, byte: u8, now: Duration) -> Option<Received> {
        match self.receiver.push::<Message<MAX_STATES, MAX_SENSORS>>(byte)? {
            Ok(Message::Telemetry(telemetry)) => Some(Received::Telemetry(telemetry)),
            Ok(Message::Reply(Reply { id, answer })) => {
                Some(Received::Answer { id, request: self.requests.answered(id, now), answer })
            }
            Ok(Message::Log(log)) => Some(Received::Log(log)),
            Err(_) => {
                self.damaged = self.damaged.saturating_add(1);
                None
            }
        }
    }

    /// Takes the bytes to be sent over the line.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        self.requests.take()
    }

    /// Whether a request has no answer yet.
    pub fn is_waiting(&self) -> bool {
        self.requests.is_waiting()
    }

    /// Drops everything: nothing more is sent or awaited.
    pub fn clear(&mut self) {
        self.requests.clear();
        self.keeps_alive = false;
    }

    /// Number of the last command.
    pub fn last_id(&self) -> u64 {
        self.requests.last_id
    }

    /// Numbers the next commands from above `id`, because somebody else has sent commands with numbers up to it.
    pub fn count_from(&mut self, id: u64) {
        self.requests.last_id = self.requests.last_id.max(id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(time: u64) -> Duration {
        Duration::from_millis(1_000 + time)
    }

    #[test]
    fn keep_alives_and_held_keys_make_way_for_commands() {
        let mut client = Client::default();
        client.poll(ms(0));
        assert!(client.take_outgoing().is_empty());
        client.keep_alive();
        client.poll(ms(0));
        assert!(!client.take_outgoing().is_empty());
        client.poll(ms(24));
        assert!(client.take_outgoing().is_empty());
        client.send(Request::Arm, ms(25));
        client.take_outgoing();
        client.poll(ms(26));
        client.hold(Request::Jog { along: true }, ms(26));
        assert!(client.take_outgoing().is_empty());
    }
}
