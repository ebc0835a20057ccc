//! The serial line, below the control task: bytes to commands, telemetry and replies to bytes.
//!
//! The control task and this one share nothing but two single-producer, single-consumer queues, so that neither can wait
//! for the other: a command is taken, and telemetry left, without a lock; a full queue drops.

use heapless::spsc::{Consumer, Producer};
use serde::Serialize;

use crate::protocol::frame::{self, Receiver};
use crate::protocol::message::{Answer, Command, Message};
use crate::protocol::queue;

/// Longest frame from the host (bytes).
pub const MAX_COMMAND: usize = 32;
/// Longest frame to the host for `NX` states and `NY` sensors: see the test (bytes).
pub const MAX_MESSAGE: usize = 320;

/// The link's end of the queues, and its counters.
pub struct Link<'q, const NX: usize, const NY: usize> {
    commands: Producer<'q, Command>,
    messages: Consumer<'q, Message<NX, NY>>,
    receiver: Receiver<MAX_COMMAND>,
    last_id: u64,
    malformed: u32,
    replayed: u32,
    scratch: [u8; MAX_MESSAGE],
    out: [u8; MAX_MESSAGE],
}

impl<'q, const NX: usize, const NY: usize> Link<'q, NX, NY> {
    /// A link between these queues.
    pub fn new(commands: Producer<'q, Command>, messages: Consumer<'q, Message<NX, NY>>) -> Self {
        Self {
            commands,
            messages,
            receiver: Receiver::new(),
            last_id: 0,
            malformed: 0,
            replayed: 0,
            scratch: [0; MAX_MESSAGE],
            out: [0; MAX_MESSAGE],
        }
    }

    /// Takes a byte from the line.
    pub fn receive(&mut self, byte: u8) {
        let Some(command) = self.receiver.push::<Command>(byte) else {
            return;
        };
        match command {
            Err(_) => self.malformed = self.malformed.saturating_add(1),
            Ok(command) if command.id <= self.last_id => self.replayed = self.replayed.saturating_add(1),
            Ok(command) => {
                // A host that sends faster than one command per tick gets no answer to what is too much.
                if queue::put(&mut self.commands, command).is_ok() {
                    self.last_id = command.id;
                }
            }
        }
    }

    /// The next frame for the line, if there is one.
    pub fn transmit(&mut self) -> Option<&[u8]> {
        let mut message = queue::take(&mut self.messages)?;
        if let Message::Reply { answer: Answer::Statistics(statistics), .. } = &mut message {
            (statistics.malformed, statistics.replayed) = (self.malformed, self.replayed);
        }
        send(&message, &mut self.scratch, &mut self.out)
    }
}

fn send<'a, T: Serialize>(message: &T, scratch: &mut [u8], out: &'a mut [u8]) -> Option<&'a [u8]> {
    frame::encode(message, scratch, out).ok()
}
