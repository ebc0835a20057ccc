//! Commands to the firmware: sent one at a time, each repeated until it is answered.

use std::collections::VecDeque;
use std::time::Duration;

use upright::protocol::frame;
use upright::protocol::message::{Command, Request};
use upright::protocol::serial_link::MAX_COMMAND;

/// Time between two transmissions of a request: the period of the keep-alive, which pauses meanwhile.
const REPEAT: Duration = Duration::from_millis(25);
/// A request that has no answer after this time is reported.
const PATIENCE: Duration = Duration::from_secs(1);
/// Largest number of keep-alives whose answers are awaited.
const MOST_BEATS: usize = 32;

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
pub(super) struct Unanswered {
    pub(super) request: Request,
    /// Whether it is no longer sent.
    pub(super) is_given_up: bool,
}

/// Queue of requests, and the bytes to be sent.
#[derive(Default)]
pub(super) struct Outgoing {
    bytes: Vec<u8>,
    last_id: u64,
    /// Only the first one is sent: the firmware treats a number that is smaller than the last one as a replay.
    waiting: VecDeque<Waiting>,
    beats: VecDeque<Command>,
}

/// Whether the firmware may carry out a request late and more than once: questions, and motor off. Every other request
/// keeps its number when it is repeated, so that it is carried out once, and is given up after a while: what a person
/// wanted long ago must not happen when the line is plugged in again.
fn may_come_late(request: Request) -> bool {
    use Request::{Cause, Crash, Disarm, Info, Statistics, Telemetry};
    matches!(request, Disarm | Info | Cause | Crash | Statistics | Telemetry(_))
}

impl Outgoing {
    /// Sends a request as soon as those before it are answered. Disarming is sent at once, and replaces what a person
    /// has asked for before; returns what was given up for it.
    pub(super) fn send(&mut self, request: Request, now: Duration) -> Vec<Unanswered> {
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

    /// Sends a request that the next one replaces: a keep-alive, or a held key. It is not repeated, and it is skipped
    /// while another command waits for its answer.
    pub(super) fn beat(&mut self, request: Request, now: Duration) {
        if self.waiting.is_empty() {
            let command = self.number(request, now);
            self.encode(&command);
            self.beats.push_back(command);
            if self.beats.len() > MOST_BEATS {
                self.beats.pop_front();
            }
        }
    }

    /// Takes the number of an answer; returns its request, and sends the next one.
    pub(super) fn answered(&mut self, id: u64, now: Duration) -> Option<Request> {
        if let Some(place) = self.beats.iter().position(|beat| beat.id == id) {
            return self.beats.remove(place).map(|beat| beat.request);
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
    pub(super) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Repeats the request that waits for its answer; returns those that have waited too long, each once.
    pub(super) fn repeat(&mut self, now: Duration) -> Vec<Unanswered> {
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
    pub(super) fn clear(&mut self) {
        self.bytes.clear();
        self.waiting.clear();
        self.beats.clear();
    }

    /// Takes the bytes to be sent over the line.
    pub(super) fn take(&mut self) -> Vec<u8> {
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

    /// Transmits the first request.
    fn transmit(&mut self, sent: Sent, now: Duration) {
        self.encode(&sent.command);
        if let Some(first) = self.waiting.front_mut() {
            first.sent = Some(Sent { next: now + REPEAT, ..sent });
        }
    }

    /// A command with the next number.
    fn number(&mut self, request: Request, now: Duration) -> Command {
        self.last_id = (now.as_micros() as u64).max(self.last_id + 1);
        Command { id: self.last_id, request }
    }

    fn encode(&mut self, command: &Command) {
        let (mut scratch, mut out) = ([0; MAX_COMMAND], [0; MAX_COMMAND]);
        // Every command fits: a test of the messages checks it.
        if let Ok(frame) = frame::encode(command, &mut scratch, &mut out) {
            self.bytes.extend_from_slice(frame);
        }
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
        let mut outgoing = Outgoing::default();
        outgoing.send(Request::Home, ms(0));
        let first = outgoing.take();
        assert!(!first.is_empty());
        outgoing.repeat(ms(24));
        assert!(outgoing.take().is_empty());
        outgoing.repeat(ms(25));
        assert_eq!(outgoing.take(), first, "the same frame, with the same number");
        assert_eq!(outgoing.answered(id(1), ms(30)), None, "that answers another command");
        assert_eq!(outgoing.answered(id(0), ms(30)), Some(Request::Home));
        assert_eq!(outgoing.answered(id(0), ms(31)), None, "the answer to its second transmission");
        outgoing.repeat(ms(2_000));
        assert!(outgoing.take().is_empty());
    }

    #[test]
    fn what_is_not_answered_is_reported_once_and_not_done_later() {
        let mut outgoing = Outgoing::default();
        outgoing.send(Request::Arm, ms(0));
        outgoing.send(Request::Statistics, ms(0));
        assert_eq!(outgoing.repeat(ms(999)), []);
        outgoing.take();
        let told = |request, is_given_up| Unanswered { request, is_given_up };
        assert_eq!(outgoing.repeat(ms(1_000)), [told(Request::Arm, true), told(Request::Statistics, false)]);
        assert!(!outgoing.take().is_empty());
        assert_eq!(outgoing.repeat(ms(10_000)), []);
        assert!(!outgoing.take().is_empty(), "a question is repeated for ever");
        assert_eq!(outgoing.answered(id(0), ms(10_001)), None, "an answer that comes too late");
        assert_eq!(outgoing.answered(id(10_000), ms(10_001)), Some(Request::Statistics));
    }

    #[test]
    fn disarming_waits_for_nothing() {
        let mut outgoing = Outgoing::default();
        for request in [Request::Info, Request::Home, Request::Arm] {
            outgoing.send(request, ms(0));
        }
        outgoing.take();
        let given_up = outgoing.send(Request::Disarm, ms(2));
        assert_eq!(
            given_up.iter().map(|given_up| given_up.request).collect::<Vec<_>>(),
            [Request::Home, Request::Arm]
        );
        assert!(!outgoing.take().is_empty());
        assert_eq!(outgoing.answered(id(2), ms(3)), Some(Request::Disarm));
        assert!(!outgoing.take().is_empty(), "the question is asked again, with a new number");
        assert_eq!(outgoing.answered(id(3), ms(4)), Some(Request::Info));
        assert!(!outgoing.is_waiting() && outgoing.take().is_empty(), "arming is dropped");
    }

    #[test]
    fn beats_make_way_for_commands_and_set_points_for_the_last_one() {
        let mut outgoing = Outgoing::default();
        outgoing.beat(Request::KeepAlive, ms(0));
        assert!(!outgoing.take().is_empty());
        for tenths in 0..4_u8 {
            outgoing.send(Request::Setpoint(f32::from(tenths) / 10.0), ms(1));
        }
        outgoing.take();
        outgoing.beat(Request::Jog { along: true }, ms(2));
        assert!(outgoing.take().is_empty());
        assert_eq!(outgoing.answered(id(1), ms(3)), Some(Request::Setpoint(0.0)));
        assert_eq!(outgoing.answered(id(3), ms(4)), Some(Request::Setpoint(0.3)));
        assert!(!outgoing.is_waiting());
        outgoing.take();
        outgoing.beat(Request::Jog { along: true }, ms(5));
        assert!(!outgoing.take().is_empty());
        outgoing.repeat(ms(1_000));
        assert!(outgoing.take().is_empty(), "a key that is let go sends nothing");
        assert_eq!(outgoing.answered(id(5), ms(1_001)), Some(Request::Jog { along: true }));
    }
}
