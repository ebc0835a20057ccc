//! The firmware in this process: the tasks of the image, one after the other.
//!
//! The numbers of states and sensors are parameters of the firmware's type, so each pair is compiled separately. This
//! applies only to the code in this file; everything around a [`Target`] is compiled once.

use heapless::spsc::Queue;
use upright::board::{BadSamples, Board, Inputs, Output};
use upright::control::encoder::CounterWidth;
use upright::firmware::Firmware;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::protocol::frame::FrameError;
use upright::protocol::message::{Command, Message, Reset};
use upright::protocol::serial_link::SerialLink;
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::table::{GainTable, SwingUp};

use super::error::HarnessError;
use super::target::{Pins, Target};
use upright_design::simulate::{Bench, SimulationError};
use upright_design::table::{SwingUpValues, TableValues, WithSize, with_firmware_size};

/// Starts the firmware of `table` in this process, after a power-on reset, and runs `action` with it.
///
/// # Errors
/// [`HarnessError`] if the firmware refuses the table, or is not compiled for its size.
pub fn with_firmware<R>(
    table: &TableValues,
    action: impl FnOnce(&mut dyn Target) -> R,
) -> Result<R, HarnessError> {
    let (mut action, mut result) = (Some(action), None);
    start(table, &mut |target| result = action.take().map(|action| action(target)))?;
    let (states, sensors) = (table.states(), table.sensors());
    result.ok_or_else(|| SimulationError::Size { states, sensors }.into())
}

/// [`with_firmware`] without a type parameter from the caller, so that all sizes of the firmware are compiled once, in
/// this crate.
fn start(table: &TableValues, run: &mut dyn FnMut(&mut dyn Target)) -> Result<(), HarnessError> {
    let (states, sensors) = (table.states(), table.sensors());
    with_firmware_size(states, sensors, WithFirmware { table, run })
        .ok_or(SimulationError::Size { states, sensors })?
}

/// As [`with_firmware`], with tables whose size is known at compile time: those of a firmware crate.
///
/// # Errors
/// [`HarnessError`] if the firmware refuses a table.
pub fn with_table<R, S: SwingUp<NX, NY>, const NX: usize, const NY: usize>(
    table: &GainTable<NX, NY>,
    swing_up: &S,
    action: impl FnOnce(&mut dyn Target) -> R,
) -> Result<R, HarnessError> {
    let (mut commands, mut messages) = (Commands::new(), Messages::<NX, NY>::new());
    Ok(action(&mut InProcess::start(table, swing_up, (&mut commands, &mut messages))?))
}

/// Starts the firmware of `table` in this process, where nothing ends it: for a page, which runs some ticks at a time.
/// Its memory, some kilobytes, is never given back.
///
/// # Errors
/// As for [`with_firmware`].
pub fn endless_firmware(table: &'static TableValues) -> Result<&'static mut dyn Target, HarnessError> {
    let (states, sensors) = (table.states(), table.sensors());
    with_firmware_size(states, sensors, Endless(table)).ok_or(SimulationError::Size { states, sensors })?
}

struct WithFirmware<'a> {
    table: &'a TableValues,
    run: &'a mut dyn FnMut(&mut dyn Target),
}

impl WithSize for WithFirmware<'_> {
    type Output = Result<(), HarnessError>;

    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> Self::Output {
        let table = self.table.table::<NX, NY>();
        let others = self.table.swing_up.as_ref().map(SwingUpValues::transitions).unwrap_or_default();
        let swing_up = self.table.swing_up.as_ref().map(|values| values.table::<NY, N>(&others));
        with_table(&table, &swing_up, self.run)
    }
}

struct Endless(&'static TableValues);

impl WithSize for Endless {
    type Output = Result<&'static mut dyn Target, HarnessError>;

    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> Self::Output {
        let swing_up = self.0.swing_up.as_ref().map(|values| {
            let others = Box::leak(Box::new(values.transitions()));
            values.table::<NY, N>(others)
        });
        let (table, swing_up) =
            (Box::leak(Box::new(self.0.table::<NX, NY>())), Box::leak(Box::new(swing_up)));
        let (commands, messages) =
            (Box::leak(Box::new(Commands::new())), Box::leak(Box::new(Messages::<NX, NY>::new())));
        Ok(Box::leak(Box::new(InProcess::start(table, swing_up, (commands, messages))?)))
    }
}

type Commands = Queue<Command, COMMANDS>;
type Messages<const NX: usize, const NY: usize> = Queue<Message<NX, NY>, MESSAGES>;

/// The image's tasks without an image.
struct InProcess<'q, 't, S, const NX: usize, const NY: usize> {
    control: ControlTask<'q, 't, Wires<NY>, NX, NY, S>,
    link: SerialLink<'q, NX, NY>,
    /// Bytes on the serial line: the host receives what was sent about a tick with the next one, as from an image.
    sent: Vec<u8>,
    /// Whether the host reads the serial line.
    is_read: bool,
}

impl<'q, 't, S: SwingUp<NX, NY>, const NX: usize, const NY: usize> InProcess<'q, 't, S, NX, NY> {
    fn start(
        table: &'t GainTable<NX, NY>,
        swing_up: &'t S,
        (commands, messages): (&'q mut Commands, &'q mut Messages<NX, NY>),
    ) -> Result<Self, HarnessError> {
        table.check()?;
        swing_up.check(table)?;
        let firmware = Firmware::new(table, swing_up, Wires::<NY>::WIDTHS, Reset::Power);
        let (to_control, commands) = commands.split();
        let (messages, to_link) = messages.split();
        let inputs = Inputs { raw_counts: [0; NY], supply_v: 0.0, contacts: Default::default() };
        let wires = Wires { inputs, bad: BadSamples::default(), output: Output::OFF, tick_s: table.tick_s };
        Ok(Self {
            control: ControlTask::new(firmware, wires, commands, messages),
            link: SerialLink::new(to_control, to_link),
            sent: Vec::new(),
            is_read: true,
        })
    }
}

/// The board: inputs and output in memory.
struct Wires<const NY: usize> {
    inputs: Inputs<NY>,
    bad: BadSamples<NY>,
    output: Output,
    tick_s: f32,
}

impl<const NY: usize> Board<NY> for Wires<NY> {
    const WIDTHS: [CounterWidth; NY] = Bench::widths();
    const GIVES_PULSES: bool = true;

    fn inputs(&mut self) -> Inputs<NY> {
        // The cart's counter has 32 bits.
        let links = self.inputs.raw_counts.iter().enumerate().skip(1);
        let is_bad = |(sensor, reading): (usize, &u32)| u32::from(reading & BAD_SAMPLE != 0) << sensor;
        self.bad.now = links.map(is_bad).sum();
        self.inputs
    }

    fn bad_samples(&mut self) -> Option<&mut BadSamples<NY>> {
        Some(&mut self.bad)
    }

    fn tick_s(&self) -> f32 {
        self.tick_s
    }

    fn drive(&mut self, output: &Output) {
        self.output = *output;
    }

    fn feed_watchdog(&mut self) {}

    fn cycles(&self) -> u32 {
        0
    }
}

impl<S: SwingUp<NX, NY>, const NX: usize, const NY: usize> Target for InProcess<'_, '_, S, NX, NY> {
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError> {
        let raw_counts = pins.raw_counts.as_slice().try_into().map_err(|_| FrameError::Message)?;
        self.control.board().inputs = Inputs { raw_counts, supply_v: pins.supply_v, contacts: pins.contacts };
        self.control.tick();
        serial.append(&mut self.sent);
        for &byte in &pins.received {
            self.link.receive(byte);
        }
        while self.is_read
            && let Some(frame) = self.link.transmit()
        {
            self.sent.extend_from_slice(frame);
        }
        Ok(self.control.board().output)
    }

    fn stop_reading(&mut self) -> Result<(), HarnessError> {
        self.is_read = false;
        Ok(())
    }
}
