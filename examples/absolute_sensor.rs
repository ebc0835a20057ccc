//! A board whose link has a sensor of its absolute angle, with 14 bits per turn, in frames as those of the AS5047:
//! `cargo run --example absolute_sensor`.
//!
//! `AbsoluteSensor` makes a counter of its readings that carries on where they wrap. Half a turn between two ticks is
//! too much. In the rig file, the link has `sensor_bits = 14`.
//!
//! A frame that fails its check is a bad sample: the firmware then takes what its observer predicts, and the third in a
//! row is the fault *encoder*. The check finds every single wrong bit and a wire at 3.3 V, but not a wire at 0 V: that
//! is a valid frame, of angle 0.

use upright::board::{BadSamples, Board, Contacts, Inputs, Output};
use upright::control::encoder::{AbsoluteSensor, CounterWidth, Encoders};

/// The sensor has found an error in a command.
const ERROR_FLAG: u16 = 1 << 14;
const ANGLE: u16 = ERROR_FLAG - 1;

/// The angle in a frame, unless a bit is wrong: the first of the 16 bits makes their parity even.
fn angle(frame: u16) -> Option<u16> {
    (frame.count_ones().is_multiple_of(2) && frame & ERROR_FLAG == 0).then_some(frame & ANGLE)
}

/// The frame that a healthy sensor sends.
fn frame(angle: u16) -> u16 {
    angle | (angle.count_ones() as u16 % 2) << 15
}

/// A counter at the cart, and the sensor at the link.
struct Machine {
    cart: u32,
    /// What the bus has received in this tick.
    frame: u16,
    /// The sensor with its last good angle.
    link: AbsoluteSensor,
    count: u32,
    bad: BadSamples<2>,
}

impl Board<2> for Machine {
    const WIDTHS: [CounterWidth; 2] = [CounterWidth::Bits32; 2];

    fn tick_s(&self) -> f32 {
        0.001
    }

    fn inputs(&mut self) -> Inputs<2> {
        let angle = angle(self.frame);
        // Sensor 0 is the cart's.
        self.bad.now = u32::from(angle.is_none()) << 1;
        if let Some(angle) = angle {
            self.count = self.link.count(angle.into());
        }
        Inputs { raw_counts: [self.cart, self.count], supply_v: 24.0, contacts: Contacts::default() }
    }

    fn bad_samples(&mut self) -> Option<&mut BadSamples<2>> {
        Some(&mut self.bad)
    }

    // A machine to look at: it has no motor, watchdog or clock.
    fn drive(&mut self, _: &Output) {}

    fn feed_watchdog(&mut self) {}

    fn cycles(&self) -> u32 {
        0
    }
}

fn main() {
    let link = AbsoluteSensor::new(14);
    let mut machine = Machine { cart: 0, frame: frame(0x3ffe), link, count: 0, bad: BadSamples::default() };
    // As the firmware does it: homed once, and then read every tick.
    let mut encoders = Encoders::new(Machine::WIDTHS);
    encoders.home(&machine.inputs().raw_counts, &[0, 0]);
    for (reading, counts) in [(0x3fff, 1), (0, 2), (1, 3), (0x3fff, 1), (0x3000, -4094)] {
        machine.frame = frame(reading);
        encoders.update(&machine.inputs().raw_counts);
        println!("{reading:#06x}: {} counts from where it was homed", encoders.counts()[1]);
        assert_eq!(encoders.counts(), &[0, counts]);
    }

    // One wrong bit, whichever, is found at every angle; without one, every angle arrives.
    for reading in 0..=ANGLE {
        assert_eq!(angle(frame(reading)), Some(reading));
        assert!((0..16).all(|bit| angle(frame(reading) ^ 1 << bit).is_none()));
    }
    // The wire breaks and is pulled up: the sample is bad. The next good frame is as before.
    for (frame, bad) in [(0xffff, 0b10), (machine.frame, 0)] {
        machine.frame = frame;
        encoders.update(&machine.inputs().raw_counts);
        println!("{frame:#06x}: bad samples {:#b}", machine.bad.now);
        assert_eq!((machine.bad.now, encoders.counts()), (bad, &[0, -4094]));
    }
    // At 0 V, the frame is that of angle 0.
    assert_eq!(angle(0), Some(0));
}
