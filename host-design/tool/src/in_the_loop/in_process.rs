//! The firmware on the host: the tasks of the image, one after the other.

use heapless::spsc::Queue;
use upright::board::{Board, Inputs, Output};
use upright::control::encoder::CounterWidth;
use upright::firmware::Firmware;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::protocol::message::{Command, Message, Reset};
use upright::protocol::serial_link::SerialLink;
use upright::protocol::simulated_pins::PinsIn;
use upright::table::{Build, GainTable};

use super::target::{Target, TargetError};
use upright_design::simulate::Bench;

/// The image's tasks without an image.
pub struct InProcess<'q, 't, const NX: usize, const NY: usize> {
    control: ControlTask<'q, 't, Wires<NY>, NX, NY>,
    link: SerialLink<'q, NX, NY>,
    /// On the serial line: the host hears of a tick with the next one, as from an image.
    sent: Vec<u8>,
    /// Nobody takes bytes from the serial line from so many ticks after the first with the motor on: its buffers fill up.
    pub stuck_from: Option<usize>,
    ticks_on: usize,
}

/// The board: inputs and output in memory.
struct Wires<const NY: usize> {
    inputs: Inputs<NY>,
    output: Output,
}

impl<const NY: usize> Board<NY> for Wires<NY> {
    const WIDTHS: [CounterWidth; NY] = Bench::widths();

    fn inputs(&mut self) -> Inputs<NY> {
        self.inputs
    }

    fn drive(&mut self, output: &Output) {
        self.output = *output;
    }

    fn feed_watchdog(&mut self) {}

    fn cycles(&self) -> u32 {
        0
    }
}

/// The queues between the tasks.
pub struct Queues<const NX: usize, const NY: usize> {
    commands: Queue<Command, COMMANDS>,
    messages: Queue<Message<NX, NY>, MESSAGES>,
}

impl<const NX: usize, const NY: usize> Default for Queues<NX, NY> {
    fn default() -> Self {
        Self { commands: Queue::new(), messages: Queue::new() }
    }
}

impl<'q, 't, const NX: usize, const NY: usize> InProcess<'q, 't, NX, NY> {
    /// The firmware after a reset, with its table.
    ///
    /// # Errors
    /// [`TargetError::Table`] if it refuses the table.
    pub fn new(
        queues: &'q mut Queues<NX, NY>,
        table: &'t GainTable<NX, NY>,
        build: &Build,
    ) -> Result<Self, TargetError> {
        let firmware = Firmware::new(table, build, Wires::WIDTHS, Reset::Power)?;
        let (to_control, commands) = queues.commands.split();
        let (messages, to_link) = queues.messages.split();
        let contacts = Default::default();
        let wires =
            Wires { inputs: Inputs { raw_counts: [0; NY], supply_v: 0.0, contacts }, output: Output::OFF };
        Ok(Self {
            control: ControlTask::new(firmware, wires, commands, messages),
            link: SerialLink::new(to_control, to_link),
            sent: Vec::new(),
            stuck_from: None,
            ticks_on: 0,
        })
    }
}

impl<const NX: usize, const NY: usize> Target<NY> for InProcess<'_, '_, NX, NY> {
    fn tick(&mut self, pins: &PinsIn<NY>, serial: &mut Vec<u8>) -> Result<Output, TargetError> {
        if let Some(inputs) = pins.inputs() {
            self.control.board().inputs = inputs;
        }
        self.control.tick();
        serial.append(&mut self.sent);
        for &byte in &pins.received {
            self.link.receive(byte);
        }
        self.ticks_on += usize::from(self.control.board().output.enable || self.ticks_on > 0);
        let stuck = self.stuck_from.is_some_and(|from| self.ticks_on > from);
        while !stuck && let Some(frame) = self.link.transmit() {
            self.sent.extend_from_slice(frame);
        }
        Ok(self.control.board().output)
    }
}
