//! Replays a recorded run of the firmware: reads the pins of each tick from a file of the emulator, and writes what
//! the firmware does to another.
//!
//! | file | bytes |
//! |---|---|
//! | `replay.in` | one byte that selects rig and arithmetic ([`Selection`]), then a frame of [`PinsIn`] for each tick |
//! | `replay.out` | after each tick, a frame of [`PinsOut`] and the bytes on the serial line; at the end, [`Spent`] |

#![no_std]
#![no_main]

mod host;
#[cfg_attr(target_arch = "arm", path = "arm.rs")]
#[cfg_attr(target_arch = "riscv32", path = "riscv.rs")]
mod processor;

use core::panic::PanicInfo;

use heapless::spsc::Queue;
use upright::board::{Board, Inputs, Output};
use upright::control::encoder::CounterWidth;
use upright::firmware::Firmware;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{Command, Reset};
use upright::protocol::serial_link::SerialLink;
use upright::protocol::simulated_pins::{MAX_PINS_IN, MAX_PINS_OUT, PinsIn, PinsOut};
use upright::table::{GainTable, SwingUp};

use host::{Host, exit};

/// The rig with four links.
#[allow(dead_code)]
mod quadruple {
    include!(env!("UPRIGHT_QUADRUPLE"));
}

/// The rig with one link.
#[allow(dead_code)]
mod single {
    include!(env!("UPRIGHT_SINGLE"));
}

/// Bits of the first byte of the input.
struct Selection;

impl Selection {
    /// The rig with one link, not the one with four.
    const SINGLE: u8 = 1;
    /// Results too small for a normal number become 0: a wrong setting, which the comparison has to notice.
    const FLUSH: u8 = 2;
}

/// Pins in memory.
struct Wires<const NY: usize> {
    inputs: Inputs<NY>,
    output: Output,
    tick_s: f32,
}

impl<const NY: usize> Board<NY> for Wires<NY> {
    // As in a simulation on the host.
    const WIDTHS: [CounterWidth; NY] = {
        let mut widths = [CounterWidth::Bits16; NY];
        widths[0] = CounterWidth::Bits32;
        widths
    };

    fn inputs(&mut self) -> Inputs<NY> {
        self.inputs
    }

    fn tick_s(&self) -> f32 {
        self.tick_s
    }

    fn drive(&mut self, output: &Output) {
        self.output = *output;
    }

    fn feed_watchdog(&mut self) {}

    // 0 as on the host, because it is sent.
    fn cycles(&self) -> u32 {
        0
    }
}

/// Time spent in ticks with the motor on, in the units of [`processor::time`].
#[derive(Default)]
struct Spent {
    ticks: u32,
    sum: u64,
    longest: u32,
}

impl Spent {
    fn add(&mut self, time: u32) {
        self.ticks += 1;
        self.sum += u64::from(time);
        self.longest = self.longest.max(time);
    }

    fn write(&self, host: &mut Host) {
        host.write(&self.ticks.to_le_bytes());
        host.write(&self.sum.to_le_bytes());
        host.write(&self.longest.to_le_bytes());
    }
}

/// Where the processor starts, with a stack.
extern "C" fn main() -> ! {
    let mut host = Host::new();
    let selection = host.read().unwrap_or_default();
    if selection & Selection::FLUSH != 0 {
        processor::flush_subnormals();
    }
    if selection & Selection::SINGLE != 0 {
        replay(host, &single::TABLE, &single::SWING_UP)
    } else {
        replay(host, &quadruple::TABLE, &quadruple::SWING_UP)
    }
}

fn replay<S: SwingUp<NX, NY>, const NX: usize, const NY: usize>(
    mut host: Host,
    table: &GainTable<NX, NY>,
    swing_up: &S,
) -> ! {
    let (mut commands, mut messages) = (Queue::<Command, COMMANDS>::new(), Queue::<_, MESSAGES>::new());
    let (to_control, commands) = commands.split();
    let (messages, to_link) = messages.split();
    let firmware = Firmware::new(table, swing_up, Wires::<NY>::WIDTHS, Reset::Power);
    let inputs = Inputs { raw_counts: [0; NY], supply_v: 0.0, contacts: Default::default() };
    let wires = Wires { inputs, output: Output::OFF, tick_s: table.tick_s };
    let mut control = ControlTask::new(firmware, wires, commands, messages);
    let mut link = SerialLink::new(to_control, to_link);
    let (mut frames, mut sent, mut spent) = (Receiver::<MAX_PINS_IN>::new(), 0, Spent::default());
    processor::start_clock();
    while let Some(byte) = host.read() {
        let Some(Ok(pins)) = frames.push::<PinsIn<NY>>(byte) else { continue };
        let Some(inputs) = pins.inputs() else { continue };
        control.board().inputs = inputs;
        let begin = processor::time();
        control.tick();
        let time = processor::elapsed(begin);
        let output = control.board().output;
        if output.enable {
            spent.add(time);
        }
        let (mut scratch, mut out) = ([0; MAX_PINS_OUT], [0; MAX_PINS_OUT]);
        if let Ok(frame) = frame::encode(&PinsOut { output, sent }, &mut scratch, &mut out) {
            host.write(frame);
        }
        for &byte in &pins.received {
            link.receive(byte);
        }
        while let Some(frame) = link.transmit() {
            host.write(frame);
            sent += frame.len() as u32;
        }
    }
    spent.write(&mut host);
    host.flush();
    exit(true)
}

#[panic_handler]
fn panicked(_: &PanicInfo) -> ! {
    exit(false)
}
