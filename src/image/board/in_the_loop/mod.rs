//! The board in the loop: a simulated rig on the host replaces timers and pins, in lock step.
//!
//! Every tick waits for a [`PinsIn`] from the host and answers with a [`PinsOut`]; telemetry and replies use a channel
//! of their own. When the host closes the channel of the pins, the image ends.
//!
//! The host keeps the time: a tick is due as soon as the background task has nothing left to do. Without a running
//! timer, the emulator takes a third less processor time per tick.

#[cfg(feature = "in-the-loop")]
mod semihosting;
#[cfg(feature = "in-the-loop-usart")]
mod usart;

use core::sync::atomic::{AtomicU32, Ordering};

use crate::pac::{Peripherals, TIM5};
use cortex_m::peripheral::{SCB, SYST};
use heapless::spsc::{Consumer, Producer, Queue};
use upright::board::{Board, Inputs, Output};
use upright::control::encoder::CounterWidth;
use upright::gains::SENSORS;
use upright::protocol::frame::{self, Receiver as Frames};
use upright::protocol::message::Start;
use upright::protocol::simulated_pins::{InjectedFault, MAX_PINS_IN, MAX_PINS_OUT, PinsIn, PinsOut};

#[cfg(feature = "in-the-loop")]
use semihosting::{PinFiles as Channel, SerialFile as Serial, exit, open};
#[cfg(feature = "in-the-loop-usart")]
use usart::{PinUsart as Channel, SerialUsart as Serial, exit, open};

/// The emulator's core clock (Hz); nothing depends on real time.
pub(crate) const CLOCK_HZ: u32 = 168_000_000;

/// Any tick (µs): the emulator takes as long for it as it needs.
pub(crate) const TICK_US: [u32; 2] = [1, u32::MAX];

/// Number of bytes sent over the serial line.
static SENT: AtomicU32 = AtomicU32::new(0);

/// The simulated pins and the counter of instructions.
pub(crate) struct SimulatedPins {
    pins: Channel,
    frames: Frames<MAX_PINS_IN>,
    received: Producer<'static, u8>,
    clock: TIM5,
    /// Instructions spent on the simulated pins, which a real board does not spend: [`cycles`](Board::cycles) leaves
    /// them out.
    spent: u32,
}

/// Nothing to check: the emulator's memory stays what it is.
pub(crate) struct UncheckedMemory;

impl UncheckedMemory {
    pub(crate) fn advance(&mut self) -> Option<u32> {
        None
    }
}

/// Queue of the serial bytes that have arrived with the pins.
pub(crate) struct ReceivedBytes(Queue<u8, 128>);

impl ReceivedBytes {
    /// Empty.
    pub(crate) const fn new() -> Self {
        Self(Queue::new())
    }
}

/// The serial line to the host.
pub(crate) struct SimulatedLine {
    received: Consumer<'static, u8>,
    serial: Serial,
}

impl SimulatedLine {
    /// The next byte from the host, if any.
    pub(crate) fn read(&mut self) -> Option<u8> {
        self.received.dequeue()
    }

    /// Always true: a frame is written at once.
    pub(crate) fn is_free(&self) -> bool {
        true
    }

    /// Sends a frame to the host.
    pub(crate) fn write(&mut self, frame: &[u8]) {
        self.serial.write(frame);
        // No run sends 2³² bytes.
        SENT.store(SENT.load(Ordering::Relaxed).wrapping_add(frame.len() as u32), Ordering::Relaxed);
    }
}

/// Opens the channels and starts the counter of instructions.
pub(crate) fn set_up<T>(
    device: Peripherals,
    buffer: &'static mut ReceivedBytes,
    _table: &T,
) -> (SimulatedPins, SimulatedLine, UncheckedMemory, Start) {
    let clock = device.TIM5;
    // 32 bits, one count per instruction.
    clock.arr().write(|w| w.arr().set(u32::MAX));
    clock.cr1().write(|w| w.cen().enabled());
    let (pins, serial) = open(device.USART1, device.USART2);
    let (producer, consumer) = buffer.0.split();
    let hardware = SimulatedPins { pins, frames: Frames::new(), received: producer, clock, spent: 0 };
    (hardware, SimulatedLine { received: consumer, serial }, UncheckedMemory, Start::default())
}

/// Starts nothing: each tick is made due by [`sleep`].
pub(crate) fn start_ticks(_: SYST, _: u32) {}

/// Makes the next tick due, at once.
pub(crate) fn sleep() {
    SCB::set_pendst();
    // The exception is taken before the next instruction.
    cortex_m::asm::isb();
}

impl SimulatedPins {
    /// Does nothing: the emulated board has no watchdog.
    pub(crate) fn start_watchdog(&self) {}
}

impl Board<SENSORS> for SimulatedPins {
    const WIDTHS: [CounterWidth; SENSORS] = {
        let mut widths = [CounterWidth::Bits16; SENSORS];
        widths[0] = CounterWidth::Bits32;
        widths
    };
    /// The host counts them.
    const GIVES_PULSES: bool = true;

    fn inputs(&mut self) -> Inputs<SENSORS> {
        let begin = self.instructions();
        let inputs = self.next_inputs();
        self.spent = self.spent.wrapping_add(self.instructions().wrapping_sub(begin));
        inputs
    }

    /// The simulation's tick.
    fn tick_s(&self) -> f32 {
        upright::gains::TICK_S
    }

    fn drive(&mut self, output: &Output) {
        let begin = self.instructions();
        send(&mut self.pins, output);
        self.spent = self.spent.wrapping_add(self.instructions().wrapping_sub(begin));
    }

    fn feed_watchdog(&mut self) {}

    /// Instructions, not cycles: the emulator counts a nanosecond per instruction and does not model cycles.
    fn cycles(&self) -> u32 {
        self.instructions().wrapping_sub(self.spent)
    }
}

impl SimulatedPins {
    fn instructions(&self) -> u32 {
        self.clock.cnt().read().bits()
    }

    fn next_inputs(&mut self) -> Inputs<SENSORS> {
        loop {
            let byte = self.pins.read();
            let Some(Ok(pins)) = self.frames.push::<PinsIn<SENSORS>>(byte) else {
                continue;
            };
            for &byte in &pins.received {
                // As on a board, a byte that does not fit is lost.
                let _ = self.received.enqueue(byte);
            }
            if let Some(injected_fault) = pins.injected_fault {
                inject(injected_fault);
            }
            if let Some(inputs) = pins.inputs() {
                return inputs;
            }
        }
    }
}

fn send(pins: &mut Channel, output: &Output) {
    let message = PinsOut { output: *output, sent: SENT.load(Ordering::Relaxed) };
    let (mut scratch, mut out) = ([0; MAX_PINS_OUT], [0; MAX_PINS_OUT]);
    if let Ok(frame) = frame::encode(&message, &mut scratch, &mut out) {
        pins.write(frame);
    }
}

fn inject(injected_fault: InjectedFault) {
    match injected_fault {
        InjectedFault::Panic => panic!(),
        // SAFETY: deliberately unsound: nothing is mapped at this address, so the access faults.
        InjectedFault::HardFault => unsafe { core::ptr::write_volatile(0x4fff_fffc as *mut u32, 0) },
        InjectedFault::StackOverflow => {
            dig(1);
        }
    }
}

#[inline(never)]
fn dig(depth: u32) -> u32 {
    let shaft = core::hint::black_box([depth; 32]);
    // The compiler cannot know that this is always true.
    if core::hint::black_box(true) { dig(depth.wrapping_add(shaft[0])).wrapping_add(shaft[1]) } else { depth }
}

/// Turns the motor off and ends the run with exit status 1.
pub(crate) fn stop(_: *const u32) -> ! {
    // SAFETY: nothing else runs any more.
    send(&mut unsafe { Channel::steal() }, &Output::OFF);
    exit(Err(()))
}
