//! Sensors on two wires (I²C), read within the tick: one clock for all of them, and a data wire for each, so that
//! sensors whose address is fixed need no more. The time does not depend on what they answer.
//!
//! A sensor that does not acknowledge its address, its register or its address again is a bad sample. One that holds
//! its data wire low when a reading begins is left alone, while the clock of this reading brings it to the end of what
//! it was sending: nine clocks without an acknowledge are enough (UM10204, 3.1.16). The sensors must not stretch the
//! clock.

/// How the angle of a part is read, from its data sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoWireReading {
    /// Address, 7 bits.
    pub address: u8,
    /// The register that is read first; the others follow by themselves.
    pub register: u8,
    /// Number of registers: the first is the state, the last two are the angle.
    pub bytes: usize,
    /// Bits of the angle in the last register.
    pub low_bits: u32,
    /// Bits below them.
    pub low_shift: u32,
    /// The bits of the angle.
    pub angle_mask: u16,
    /// Bits of the first register, and what they are while the angle is one.
    pub state: [u8; 2],
}

/// Least time for which the clock is low (UM10204, table 10, Fast-mode Plus).
pub const LOW_NS: u32 = 500;
/// Least time for which it is high, and from a start, and to and from a stop.
pub const HIGH_NS: u32 = 260;

/// Most bytes of a reading.
pub const MOST_BYTES: usize = 5;

impl TwoWireReading {
    /// The angle in these bytes (counts); none if the sensor says that it has none.
    pub fn angle(&self, bytes: &[u8]) -> Option<u16> {
        let (&[.., high, low], Some(&first)) = (bytes.get(..self.bytes)?, bytes.first()) else { return None };
        let [mask, good] = self.state;
        let angle = u16::from(high) << self.low_bits | u16::from(low) >> self.low_shift;
        (first & mask == good).then_some(angle & self.angle_mask)
    }

    /// Whether the sensor says when its angle is none.
    pub fn has_state(&self) -> bool {
        let [mask, _] = self.state;
        mask != 0
    }

    /// The registers of a sensor with this angle (counts), and of one without a magnet.
    pub fn registers(&self, angle: Option<u16>) -> [u8; MOST_BYTES] {
        let mut registers = [0; MOST_BYTES];
        let (shown, [mask, good]) = (angle.unwrap_or_default(), self.state);
        if let Some([.., high, low]) = registers.get_mut(..self.bytes) {
            *high = (shown >> self.low_bits) as u8;
            *low = ((shown & ((1 << self.low_bits) - 1)) << self.low_shift) as u8;
        }
        if mask != 0
            && let [first, ..] = &mut registers
        {
            *first = if angle.is_some() { good } else { mask & !good };
        }
        registers
    }
}

/// The wires of a board. Data wires are numbered by their sensors: bit i is that of sensor i.
pub trait TwoWires {
    /// Drives the clock.
    fn set_clock(&mut self, is_high: bool);

    /// Pulls these data wires low, and leaves the others to their pull-ups.
    fn pull(&mut self, low: u32);

    /// The data wires that are high.
    fn levels(&mut self) -> u32;

    /// Waits for so many nanoseconds: [`LOW_NS`] or [`HIGH_NS`].
    fn wait(&self, ns: u32);
}

/// Reads the sensors with the bits of `all`, `N` at most, at the part's address; returns their angles (counts), and
/// which samples are bad, by bits.
pub fn read<const N: usize>(wires: &mut impl TwoWires, part: &TwoWireReading, all: u32) -> ([u16; N], u32) {
    wires.pull(0);
    wires.set_clock(true);
    wires.wait(LOW_NS);
    // One that holds its wire low is in the middle of an answer.
    let stuck = all & !wires.levels();
    let mut bus = Transfer { wires, asked: all & !stuck, bad: stuck };
    bus.start();
    bus.send(part.address << 1);
    bus.send(part.register);
    bus.start();
    bus.send(part.address << 1 | 1);
    let mut levels = [0; 8 * MOST_BYTES];
    for (byte, levels) in levels.chunks_exact_mut(8).take(part.bytes).enumerate() {
        bus.receive(byte + 1 == part.bytes, levels);
    }
    bus.stop(all);
    let mut bad = bus.bad;
    let mut angles = [0; N];
    for (sensor, angle) in angles.iter_mut().enumerate().filter(|(sensor, _)| all & 1 << sensor != 0) {
        match part.angle(&bytes_of(sensor, &levels)) {
            Some(found) => *angle = found,
            None => bad |= 1 << sensor,
        }
    }
    (angles, bad & all)
}

/// The bytes of a sensor, from the levels of the data wires at each clock.
fn bytes_of(sensor: usize, levels: &[u32; 8 * MOST_BYTES]) -> [u8; MOST_BYTES] {
    let mut bytes = [0; MOST_BYTES];
    for (byte, levels) in bytes.iter_mut().zip(levels.chunks_exact(8)) {
        *byte = levels.iter().fold(0, |byte, level| byte << 1 | (level >> sensor & 1) as u8);
    }
    bytes
}

struct Transfer<'w, W> {
    wires: &'w mut W,
    /// The sensors that take part.
    asked: u32,
    bad: u32,
}

impl<W: TwoWires> Transfer<'_, W> {
    /// A start, also a repeated one. The clock is low afterwards.
    fn start(&mut self) {
        self.wires.pull(0);
        self.wires.wait(LOW_NS);
        self.wires.set_clock(true);
        self.wires.wait(HIGH_NS);
        self.wires.pull(self.asked);
        self.wires.wait(HIGH_NS);
        self.wires.set_clock(false);
    }

    /// The end: the data wires rise while the clock is high.
    fn stop(&mut self, all: u32) {
        self.wires.pull(all);
        self.wires.wait(LOW_NS);
        self.wires.set_clock(true);
        self.wires.wait(HIGH_NS);
        self.wires.pull(0);
    }

    /// One clock; returns the data wires that are high.
    fn clock(&mut self, low: u32) -> u32 {
        self.wires.pull(low);
        self.wires.wait(LOW_NS);
        self.wires.set_clock(true);
        self.wires.wait(HIGH_NS);
        let levels = self.wires.levels();
        self.wires.set_clock(false);
        levels
    }

    /// Sends a byte; a sensor that does not acknowledge it is bad.
    fn send(&mut self, byte: u8) {
        for bit in (0..8).rev() {
            self.clock(if byte & 1 << bit == 0 { self.asked } else { 0 });
        }
        self.bad |= self.clock(0) & self.asked;
    }

    /// Receives a byte of each sensor, and acknowledges it unless it is the last one.
    fn receive(&mut self, is_last: bool, levels: &mut [u32]) {
        for levels in levels {
            *levels = self.clock(0);
        }
        self.clock(if is_last { 0 } else { self.asked });
    }
}
