//! The one protocol client of the host: numbers, repeats and encodes commands, decodes what the firmware sends, finds
//! the request to each answer, and keeps the firmware's dead-man timer from running out.
//!
//! A [`Session`](crate::harness::Session) talks through it to a firmware in lock step; monitor, commissioning, twin and
//! identification talk through it over a line.
//!
//! ```
//! use std::time::Duration;
//! use upright::protocol::message::Request;
//! use upright_closed_loop::client::{Client, PATIENCE};
//!
//! let (mut client, start) = (Client::default(), Duration::ZERO);
//! client.send(Request::Info, start);
//! assert!(!client.take_outgoing().is_empty() && client.is_waiting());
//! // Nobody answers: the client says so once.
//! let unanswered = client.poll(start + PATIENCE * 2);
//! assert_eq!(unanswered.len(), 1);
//! assert_eq!(unanswered[0].request, Request::Info);
//! ```

mod mismatch;

use std::collections::VecDeque;
use std::time::Duration;

use upright::protocol::KEEP_ALIVE;
use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{Answer, Command, Message, Reply, Request, Telemetry};
use upright::protocol::serial_link::{MAX_COMMAND, MAX_MESSAGE};
use upright::protocol::tick_log::TickLog;

use upright_design::table::{MAX_SENSORS, MAX_STATES};

pub use mismatch::{ExpectedRig, Mismatch};

/// Telemetry of a firmware of any size: its frames are the same bytes whatever the capacity of the lists.
pub type AnyTelemetry = Telemetry<MAX_STATES, MAX_SENSORS>;

/// A part of the tick log (a record of every tick), of a firmware of any size.
pub type AnyTickLog = TickLog<MAX_SENSORS>;

/// A request that has no answer after this time is reported.
pub const PATIENCE: Duration = Duration::from_secs(1);
/// Largest number of commands sent only once whose answers are awaited.
const MOST_ONCE: usize = 32;

/// The bytes of a command on the serial line.
pub fn command_frame(command: &Command) -> Vec<u8> {
    // Every command fits, as a test of the messages checks.
    frame::encode(command, &mut [0; MAX_COMMAND], &mut [0; MAX_COMMAND]).unwrap_or_default().to_vec()
}

/// A request without an answer.
struct Waiting {
    request: Request,
    since: Duration,
    sent: Option<Sent>,
    is_reported: bool,
}

/// Transmissions of a request so far.
#[derive(Clone, Copy)]
struct Sent {
    /// Number of the first command with this request.
    first_id: u64,
    /// The last command with this request.
    command: Command,
    /// Time of the next transmission.
    next: Duration,
}

/// A request that is not answered in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unanswered {
    /// The request.
    pub request: Request,
    /// Whether it is no longer sent.
    pub is_given_up: bool,
}

/// Whether the firmware may carry out a request late and more than once: questions, and motor off. Every other request
/// keeps its number when it is repeated, so that it is carried out once, and is given up after a while: what a person
/// wanted long ago must not happen when the line is plugged in again.
fn may_come_late(request: Request) -> bool {
    use Request::{Cause, Crash, Disarm, Info, Statistics, Telemetry};
    matches!(request, Disarm | Info | Cause | Crash | Statistics | Telemetry(_))
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
    bytes: Vec<u8>,
    last_id: u64,
    /// Only the first one is sent: the firmware treats a number that is smaller than the last one as a replay.
    waiting: VecDeque<Waiting>,
    /// Commands that were sent only once.
    once: VecDeque<Command>,
    receiver: Receiver<MAX_MESSAGE>,
    keeps_alive: bool,
    next_keep_alive: Duration,
    /// Frames that could not be read.
    pub damaged: u32,
}

impl Client {
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
        let unanswered = self.repeat(now);
        if self.keeps_alive && now >= self.next_keep_alive {
            self.hold(Request::KeepAlive, now);
            self.next_keep_alive = now + KEEP_ALIVE;
        }
        unanswered
    }

    /// Takes a received byte; returns the message that it completes, if any.
    pub fn receive(&mut self, byte: u8, now: Duration) -> Option<Received> {
        if self.receiver.completes_frame(byte) { self.received(now) } else { None }
    }

    /// The message whose frame is complete. Kept out of [`receive`](Self::receive), which nearly every byte leaves at
    /// once: with it inlined, a campaign takes 17 % longer.
    #[inline(never)]
    fn received(&mut self, now: Duration) -> Option<Received> {
        match self.receiver.decoded::<Message<MAX_STATES, MAX_SENSORS>>() {
            Ok(Message::Telemetry(telemetry)) => Some(Received::Telemetry(telemetry)),
            Ok(Message::Reply(Reply { id, answer })) => {
                Some(Received::Answer { id, request: self.answered(id, now), answer })
            }
            Ok(Message::Log(log)) => Some(Received::Log(log)),
            Err(_) => {
                self.damaged = self.damaged.saturating_add(1);
                None
            }
        }
    }

    /// Number of the last command.
    pub fn last_id(&self) -> u64 {
        self.last_id
    }

    /// Numbers the next commands from above `id`, because somebody else has sent commands with numbers up to it.
    pub fn count_from(&mut self, id: u64) {
        self.last_id = self.last_id.max(id);
    }

    /// Sends a request as soon as those before it are answered. Disarming is sent at once, and replaces what a person
    /// has asked for before; returns what was given up for it.
    pub fn send(&mut self, request: Request, now: Duration) -> Vec<Unanswered> {
        let new = Waiting { request, since: now, sent: None, is_reported: false };
        let mut given_up = Vec::new();
        match request {
            Request::Disarm => {
                given_up = self
                    .give_up(|before| before.request == Request::Disarm || !may_come_late(before.request));
                given_up.retain(|before| before.request != Request::Disarm);
                // Their numbers are now too small: they are sent again with new ones.
                self.waiting.iter_mut().for_each(|before| before.sent = None);
                self.waiting.push_front(new);
            }
            Request::Setpoint(_) => {
                // Replaces a set-point that has not been sent.
                self.waiting.retain(|before| {
                    before.sent.is_some() || !matches!(before.request, Request::Setpoint(_))
                });
                self.waiting.push_back(new);
            }
            _ => self.waiting.push_back(new),
        }
        self.send_first(now);
        given_up
    }

    /// Sends a request at once, whatever waits for its answer. It is not repeated. Returns its number.
    pub fn send_once(&mut self, request: Request, now: Duration) -> u64 {
        let command = self.number(request, now);
        self.bytes.extend(command_frame(&command));
        self.once.push_back(command);
        if self.once.len() > MOST_ONCE {
            self.once.pop_front();
        }
        command.id
    }

    /// Takes the number of an answer; returns its request, and sends the next one.
    fn answered(&mut self, id: u64, now: Duration) -> Option<Request> {
        if let Some(place) = self.once.iter().position(|command| command.id == id) {
            return self.once.remove(place).map(|command| command.request);
        }
        let Waiting { request, sent: Some(sent), .. } = self.waiting.front()? else { return None };
        let request = *request;
        if !(sent.first_id..=sent.command.id).contains(&id) {
            return None;
        }
        self.waiting.pop_front();
        self.send_first(now);
        Some(request)
    }

    /// Whether a request has no answer yet.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Repeats the request that waits for its answer; returns those that have waited too long, each once.
    fn repeat(&mut self, now: Duration) -> Vec<Unanswered> {
        let late = |waiting: &Waiting| now >= waiting.since + PATIENCE;
        let mut unanswered = self.give_up(|waiting| late(waiting) && !may_come_late(waiting.request));
        if let Some(first) = self.waiting.front_mut()
            && late(first)
            && !std::mem::replace(&mut first.is_reported, true)
        {
            unanswered.push(Unanswered { request: first.request, is_given_up: false });
        }
        self.send_first(now);
        if let Some(&Waiting { request, sent: Some(sent), .. }) = self.waiting.front()
            && now >= sent.next
        {
            let command = if may_come_late(request) { self.number(request, now) } else { sent.command };
            self.transmit(Sent { command, ..sent }, now);
        }
        unanswered
    }

    /// Drops everything: nothing more is sent or awaited.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.waiting.clear();
        self.once.clear();
        self.keeps_alive = false;
    }

    /// Takes the bytes to be sent over the line.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    /// Drops the requests for which `which` holds; returns them as given up.
    fn give_up(&mut self, which: impl Fn(&Waiting) -> bool) -> Vec<Unanswered> {
        let (dropped, kept): (VecDeque<_>, VecDeque<_>) = self.waiting.drain(..).partition(which);
        self.waiting = kept;
        dropped.iter().map(|waiting| Unanswered { request: waiting.request, is_given_up: true }).collect()
    }

    /// Sends the first request for the first time.
    fn send_first(&mut self, now: Duration) {
        if let Some(&Waiting { request, sent: None, .. }) = self.waiting.front() {
            let command = self.number(request, now);
            self.transmit(Sent { first_id: command.id, command, next: now }, now);
        }
    }

    /// Transmits the first request. A keep-alive pauses meanwhile, so this comes as often.
    fn transmit(&mut self, sent: Sent, now: Duration) {
        self.bytes.extend(command_frame(&sent.command));
        if let Some(first) = self.waiting.front_mut() {
            first.sent = Some(Sent { next: now + KEEP_ALIVE, ..sent });
        }
    }

    /// A command with the next number.
    fn number(&mut self, request: Request, now: Duration) -> Command {
        self.last_id = (now.as_micros() as u64).max(self.last_id + 1);
        Command { id: self.last_id, request }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(time: u64) -> Duration {
        Duration::from_millis(1_000 + time)
    }

    fn id(time: u64) -> u64 {
        ms(time).as_micros() as u64
    }

    #[test]
    fn a_command_is_repeated_until_it_is_answered() {
        let mut client = Client::default();
        client.send(Request::Home, ms(0));
        let first = client.take_outgoing();
        assert!(!first.is_empty());
        client.repeat(ms(24));
        assert!(client.take_outgoing().is_empty());
        client.repeat(ms(25));
        assert_eq!(client.take_outgoing(), first, "the same frame, with the same number");
        assert_eq!(client.answered(id(1), ms(30)), None, "that answers another command");
        assert_eq!(client.answered(id(0), ms(30)), Some(Request::Home));
        assert_eq!(client.answered(id(0), ms(31)), None, "the answer to its second transmission");
        client.repeat(ms(2_000));
        assert!(client.take_outgoing().is_empty());
    }

    #[test]
    fn what_is_not_answered_is_reported_once_and_not_done_later() {
        let mut client = Client::default();
        client.send(Request::Arm, ms(0));
        client.send(Request::Statistics, ms(0));
        assert_eq!(client.repeat(ms(999)), []);
        client.take_outgoing();
        let told = |request, is_given_up| Unanswered { request, is_given_up };
        assert_eq!(client.repeat(ms(1_000)), [told(Request::Arm, true), told(Request::Statistics, false)]);
        assert!(!client.take_outgoing().is_empty());
        assert_eq!(client.repeat(ms(10_000)), []);
        assert!(!client.take_outgoing().is_empty(), "a question is repeated for ever");
        assert_eq!(client.answered(id(0), ms(10_001)), None, "an answer that comes too late");
        assert_eq!(client.answered(id(10_000), ms(10_001)), Some(Request::Statistics));
    }

    #[test]
    fn disarming_waits_for_nothing() {
        let mut client = Client::default();
        for request in [Request::Info, Request::Home, Request::Arm] {
            client.send(request, ms(0));
        }
        client.take_outgoing();
        let given_up = client.send(Request::Disarm, ms(2));
        assert_eq!(
            given_up.iter().map(|given_up| given_up.request).collect::<Vec<_>>(),
            [Request::Home, Request::Arm]
        );
        assert!(!client.take_outgoing().is_empty());
        assert_eq!(client.answered(id(2), ms(3)), Some(Request::Disarm));
        assert!(!client.take_outgoing().is_empty(), "the question is asked again, with a new number");
        assert_eq!(client.answered(id(3), ms(4)), Some(Request::Info));
        assert!(!client.is_waiting() && client.take_outgoing().is_empty(), "arming is dropped");
    }

    #[test]
    fn a_set_point_replaces_one_that_was_not_sent_and_what_is_sent_once_is_not_repeated() {
        let mut client = Client::default();
        for tenths in 0..4_u8 {
            client.send(Request::Setpoint(f32::from(tenths) / 10.0), ms(1));
        }
        assert_eq!(client.answered(id(1), ms(3)), Some(Request::Setpoint(0.0)));
        assert_eq!(client.answered(id(3), ms(4)), Some(Request::Setpoint(0.3)));
        assert!(!client.is_waiting());
        client.take_outgoing();
        assert_eq!(client.send_once(Request::Jog { along: true }, ms(5)), id(5));
        assert!(!client.take_outgoing().is_empty());
        client.repeat(ms(1_000));
        assert!(client.take_outgoing().is_empty());
        assert_eq!(client.answered(id(5), ms(1_001)), Some(Request::Jog { along: true }));
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
