//! The serial link, which runs below the control task: turns bytes into commands, and telemetry and replies into
//! bytes.
//!
//! Control task and serial link share only two single-producer, single-consumer queues, so neither ever waits for the
//! other: there is no lock, and a message that finds its queue full is dropped. A command that is repeated with the
//! same id is not carried out again, but its reply is sent again: the host repeats a command until it has the reply.

use heapless::spsc::{Consumer, Producer};
use serde::Serialize;

use crate::protocol::frame::{self, Receiver};
use crate::protocol::message::{Answer, Command, Message, Reply};
use crate::protocol::queue;

/// Longest frame from the host (bytes).
pub const MAX_COMMAND: usize = 32;
/// Longest frame to the host (bytes): enough for 30 states and 15 sensors.
pub const MAX_MESSAGE: usize = 340;

/// Receiver and transmitter of frames, with this side's ends of the queues to the control task.
pub struct SerialLink<'q, const NX: usize, const NY: usize> {
    commands: Producer<'q, Command>,
    messages: Consumer<'q, Message<NX, NY>>,
    receiver: Receiver<MAX_COMMAND>,
    last_id: u64,
    malformed: u32,
    replayed: u32,
    /// The last reply, and whether the host has asked for it again.
    last_reply: Option<Reply>,
    is_asked_again: bool,
    scratch: [u8; MAX_MESSAGE],
    out: [u8; MAX_MESSAGE],
}

impl<'q, const NX: usize, const NY: usize> SerialLink<'q, NX, NY> {
    /// A link that puts commands into one queue and takes messages from the other.
    pub fn new(commands: Producer<'q, Command>, messages: Consumer<'q, Message<NX, NY>>) -> Self {
        Self {
            commands,
            messages,
            receiver: Receiver::new(),
            last_id: 0,
            malformed: 0,
            replayed: 0,
            last_reply: None,
            is_asked_again: false,
            scratch: [0; MAX_MESSAGE],
            out: [0; MAX_MESSAGE],
        }
    }

    /// Takes a byte from the serial line; a complete command goes to the control task.
    pub fn receive(&mut self, byte: u8) {
        let Some(command) = self.receiver.push::<Command>(byte) else {
            return;
        };
        match command {
            Err(_) => self.malformed = self.malformed.saturating_add(1),
            Ok(command) if command.id <= self.last_id => {
                self.replayed = self.replayed.saturating_add(1);
                // Its reply may have been lost. The command itself is not carried out twice.
                self.is_asked_again |= self.last_reply.is_some_and(|reply| reply.id == command.id);
            }
            Ok(command) => {
                // A host that sends more than one command per tick gets no answer to those that find the queue full.
                if queue::put(&mut self.commands, command).is_ok() {
                    self.last_id = command.id;
                }
            }
        }
    }

    /// The next frame for the line, if there is one.
    pub fn transmit(&mut self) -> Option<&[u8]> {
        let again = core::mem::take(&mut self.is_asked_again).then_some(self.last_reply).flatten();
        let mut message = match again {
            Some(reply) => Message::Reply(reply),
            None => queue::take(&mut self.messages)?,
        };
        if let Message::Reply(reply) = &mut message {
            if let Answer::Statistics(statistics) = &mut reply.answer {
                (statistics.malformed, statistics.replayed) = (self.malformed, self.replayed);
            }
            self.last_reply = Some(*reply);
        }
        send(&message, &mut self.scratch, &mut self.out)
    }
}

fn send<'a, T: Serialize>(message: &T, scratch: &mut [u8], out: &'a mut [u8]) -> Option<&'a [u8]> {
    frame::encode(message, scratch, out).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Contacts;
    use crate::protocol::message::Telemetry;
    use crate::supervision::fault::Fault;
    use crate::supervision::homing::Homing;
    use crate::supervision::inhibits::Inhibits;
    use crate::supervision::jog::MotorSign;
    use crate::supervision::sign_check::Signs;
    use crate::supervision::supervisor::State;
    use crate::table::Law;
    use heapless::Vec;

    #[test]
    fn the_longest_telemetry_fits_into_a_frame() {
        let all = Inhibits::ALL.iter().fold(Inhibits::NONE, |all, (inhibit, _)| all.union(*inhibit));
        let telemetry = Message::Telemetry(Telemetry::<30, 15> {
            tick: u32::MAX,
            state: State::Fault,
            law: Law::PolePlacement,
            fault: Some(Fault::Clock),
            cause_tick: u32::MAX,
            homing: Homing::Touch { low: true, high: true },
            signs: Signs::Swapped { asked: u8::MAX, moved: u8::MAX },
            motor: MotorSign::Reversed,
            arming_inhibits: all,
            swing_up_inhibits: all,
            motion_tick: u32::MAX,
            contacts: Contacts::default(),
            supply_v: f32::MAX,
            counts: Vec::from_array([i32::MIN; 15]),
            estimate: Vec::from_array([f32::MAX; 30]),
            innovation: Vec::from_array([f32::MAX; 15]),
            setpoint_m: f32::MAX,
            requested_n: f32::MAX,
            applied_n: f32::MAX,
            drive: f32::MAX,
            cycles: u32::MAX,
            worst_cycles: u32::MAX,
        });
        let (mut scratch, mut out) = ([0; MAX_MESSAGE], [0; MAX_MESSAGE]);
        assert!(send(&telemetry, &mut scratch, &mut out).is_some());
        let (mut scratch, mut out) = ([0; MAX_MESSAGE], [0; MAX_MESSAGE - 20]);
        assert!(send(&telemetry, &mut scratch, &mut out).is_none(), "not even without 20 bytes");
    }

    #[test]
    fn a_repeated_command_is_answered_again_and_carried_out_once() {
        use crate::protocol::message::Request;
        use heapless::spsc::Queue;
        let (mut commands, mut messages) = (Queue::<Command, 4>::new(), Queue::<Message<2, 1>, 4>::new());
        let ((to_control, mut from_link), (mut to_link, from_control)) = (commands.split(), messages.split());
        let mut link = SerialLink::new(to_control, from_control);
        let say = |link: &mut SerialLink<'_, 2, 1>, id| {
            let command = Command { id, request: Request::Home };
            let (mut scratch, mut out) = ([0; MAX_COMMAND], [0; MAX_COMMAND]);
            send(&command, &mut scratch, &mut out).unwrap().iter().for_each(|&byte| link.receive(byte));
        };
        say(&mut link, 7);
        assert_eq!(from_link.dequeue().map(|command| command.id), Some(7));
        // Not answered yet: nothing to send again.
        say(&mut link, 7);
        assert_eq!((from_link.dequeue(), link.transmit()), (None, None));
        to_link.enqueue(Message::Reply(Reply { id: 7, answer: Answer::Done })).unwrap();
        let reply: Vec<u8, 64> = Vec::from_slice(link.transmit().unwrap()).unwrap();
        assert_eq!(link.transmit(), None);
        say(&mut link, 7);
        assert_eq!(from_link.dequeue(), None, "carried out once");
        assert_eq!(link.transmit(), Some(&reply[..]));
        // The negative control: an older command is a replay, and not answered.
        say(&mut link, 6);
        assert_eq!((from_link.dequeue(), link.transmit()), (None, None));
    }
}
