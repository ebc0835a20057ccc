//! The task that a hardware timer starts at every tick, above everything else.

use heapless::spsc::{Consumer, Producer};

use crate::board::Board;
use crate::firmware::Firmware;
use crate::protocol::message::{Command, Message};
use crate::protocol::queue;

/// Commands that may wait for the next ticks; one is taken per tick. (A queue of 4 holds 3.)
pub const COMMANDS: usize = 4;
/// Telemetry and replies that may wait for the line.
pub const MESSAGES: usize = 8;

/// Firmware, board, and this task's ends of the queues to the [`Link`](crate::protocol::link::Link). It waits for nobody.
pub struct ControlTask<'q, 't, B, const NX: usize, const NY: usize> {
    firmware: Firmware<'t, NX, NY>,
    board: B,
    commands: Consumer<'q, Command>,
    messages: Producer<'q, Message<NX, NY>>,
    cycles: u32,
}

impl<'q, 't, B: Board<NY>, const NX: usize, const NY: usize> ControlTask<'q, 't, B, NX, NY> {
    /// The task before its first tick.
    pub fn new(
        firmware: Firmware<'t, NX, NY>,
        board: B,
        commands: Consumer<'q, Command>,
        messages: Producer<'q, Message<NX, NY>>,
    ) -> Self {
        Self { firmware, board, commands, messages, cycles: 0 }
    }

    /// One tick.
    pub fn tick(&mut self) {
        let begin = self.board.cycles();
        let inputs = self.board.inputs();
        let output = self.firmware.control(&inputs);
        self.board.drive(&output);
        let command = queue::take(&mut self.commands);
        let (telemetry, reply) = self.firmware.finish(command.as_ref(), self.cycles);
        // A reply goes first: telemetry comes again, it does not.
        for message in [reply, telemetry.map(Message::Telemetry)].into_iter().flatten() {
            if queue::put(&mut self.messages, message).is_err() {
                self.firmware.message_dropped();
            }
        }
        self.board.feed_watchdog();
        self.cycles = self.board.cycles().wrapping_sub(begin);
    }

    /// The firmware, to look at.
    pub fn firmware(&self) -> &Firmware<'t, NX, NY> {
        &self.firmware
    }

    /// The board, to look at.
    pub fn board(&mut self) -> &mut B {
        &mut self.board
    }
}
