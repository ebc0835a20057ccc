//! The control task: a hardware timer starts it every tick, at the highest priority.

use heapless::spsc::{Consumer, Producer};

use crate::board::{Board, Inputs, Output};
use crate::firmware::Firmware;
use crate::protocol::message::{Command, Message};
use crate::protocol::queue;
use crate::table::{NoSwingUp, SwingUp};

/// Length of the queue of commands; it holds one less. One command is taken per tick.
pub const COMMANDS: usize = 4;
/// Length of the queue of telemetry and replies for the serial link; it holds one less.
pub const MESSAGES: usize = 8;

/// Firmware, board, and this task's ends of the queues to the
/// [`SerialLink`](crate::protocol::serial_link::SerialLink). It never waits.
pub struct ControlTask<'q, 't, B, const NX: usize, const NY: usize, S = NoSwingUp> {
    firmware: Firmware<'t, NX, NY, S>,
    board: B,
    commands: Consumer<'q, Command>,
    messages: Producer<'q, Message<NX, NY>>,
    cycles: u32,
}

impl<'q, 't, B: Board<NY>, const NX: usize, const NY: usize, S: SwingUp<NX, NY>>
    ControlTask<'q, 't, B, NX, NY, S>
{
    /// The task before its first tick. If the board's timer is set to another tick than the gain table is for, or the
    /// table's drive needs pulses that the board does not give, the motor stays off:
    /// [`Fault::Table`](crate::supervision::fault::Fault::Table); if its image is damaged,
    /// [`Fault::Image`](crate::supervision::fault::Fault::Image). `commands` and `messages` lead from and to the serial
    /// link.
    pub fn new(
        mut firmware: Firmware<'t, NX, NY, S>,
        board: B,
        commands: Consumer<'q, Command>,
        messages: Producer<'q, Message<NX, NY>>,
    ) -> Self {
        // The first fault is the one that is latched.
        firmware.compare_memory(B::CHECKS_TABLES, board.image_is_damaged());
        firmware.compare_board(board.tick_s(), B::GIVES_PULSES);
        Self { firmware, board, commands, messages, cycles: 0 }
    }

    /// One tick.
    pub fn tick(&mut self) {
        self.tick_with(Firmware::act, Firmware::predict);
    }

    /// One tick, with the caller's own compiled versions of [`Firmware::act`] and [`Firmware::predict`].
    #[inline(always)]
    pub fn tick_with(
        &mut self,
        act: impl for<'f> FnOnce(&'f mut Firmware<'t, NX, NY, S>, &Inputs<NY>) -> &'f Output,
        predict: impl FnOnce(&mut Firmware<'t, NX, NY, S>),
    ) {
        let begin = self.board.cycles();
        let mut inputs = self.board.inputs();
        let bad = self.board.bad_samples();
        let lost = bad.and_then(|bad| self.firmware.replace_bad_samples(&mut inputs, bad));
        self.firmware.accept(&inputs);
        if let Some(found) = lost {
            self.firmware.lose_sensor(found);
        }
        let output = act(&mut self.firmware, &inputs);
        self.board.drive(output);
        let log = self.firmware.log_tick();
        let command = queue::take(&mut self.commands);
        let telemetry = self.firmware.report(self.cycles);
        predict(&mut self.firmware);
        let reply = self.firmware.complete(command.as_ref());
        // The reply goes first: it is sent only once, telemetry again and again.
        if let Some(reply) = reply {
            self.send(Message::Reply(reply));
        }
        if let Some(telemetry) = telemetry {
            self.send(Message::Telemetry(telemetry));
        }
        if let Some(log) = log {
            self.send(Message::Log(log));
        }
        self.board.end_tick();
        if !self.firmware.is_late() {
            self.board.feed_watchdog();
        }
        self.cycles = self.board.cycles().wrapping_sub(begin);
    }

    // Inlined: a message is copied once less.
    #[inline(always)]
    fn send(&mut self, message: Message<NX, NY>) {
        if queue::put(&mut self.messages, message).is_err() {
            self.firmware.message_dropped();
        }
    }

    /// The firmware, read-only.
    pub fn firmware(&self) -> &Firmware<'t, NX, NY, S> {
        &self.firmware
    }

    /// The board, for example to start its watchdog.
    pub fn board(&mut self) -> &mut B {
        &mut self.board
    }
}

#[cfg(test)]
mod tests;
