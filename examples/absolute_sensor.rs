//! A board whose link has a sensor of its absolute angle, with 14 bits per turn: `cargo run --example absolute_sensor`.
//!
//! Shifted until it fills 16 bits, the sensor's reading wraps as a counter of 16 bits does. In the rig file, a turn
//! then has 65,536 counts. As with a counter, half a turn between two ticks is too much.

use upright::board::{Board, Contacts, Inputs, Output};
use upright::control::encoder::{CounterWidth, Encoders};

/// Bits that the sensor has less than a counter.
const SHIFT: u32 = 2;

/// A counter at the cart, and the sensor at the link.
struct Machine {
    cart: u32,
    link: u16,
}

impl Board<2> for Machine {
    const WIDTHS: [CounterWidth; 2] = [CounterWidth::Bits32, CounterWidth::Bits16];

    fn tick_s(&self) -> f32 {
        0.001
    }

    fn inputs(&mut self) -> Inputs<2> {
        let raw_counts = [self.cart, u32::from(self.link << SHIFT)];
        Inputs { raw_counts, supply_v: 24.0, contacts: Contacts::default() }
    }

    // A machine to look at: it has no motor, watchdog or clock.
    fn drive(&mut self, _: &Output) {}

    fn feed_watchdog(&mut self) {}

    fn cycles(&self) -> u32 {
        0
    }
}

fn main() {
    let mut machine = Machine { cart: 0, link: 0x3ffe };
    // As the firmware does it: homed once, and then read every tick.
    let mut encoders = Encoders::new(Machine::WIDTHS);
    encoders.home(&machine.inputs().raw_counts, &[0, 0]);
    for (reading, counts) in [(0x3fff, 4), (0, 8), (1, 12), (0x3fff, 4), (0x3000, -4094 * 4)] {
        machine.link = reading;
        encoders.update(&machine.inputs().raw_counts);
        println!("{reading:#06x}: {} counts from where it was homed", encoders.counts()[1]);
        assert_eq!(encoders.counts(), &[0, counts]);
    }
}
