//! The reading of sensors on two wires, against sensors as their data sheets describe them.

use upright::boards::parts::{PARTS, PartInterface};
use upright::boards::two_wires::{TwoWireReading, TwoWires, read};
use upright_board::{RegisterDefect, RegisterSensor, Time, UNITS_PER_MICROSECOND, Violation};

/// A board whose pins are variables, with a sensor at each data wire.
struct Bench {
    sensors: Vec<RegisterSensor>,
    clock: bool,
    low: u32,
    now: std::cell::Cell<Time>,
    /// By how much waiting is shorter.
    hurry: u32,
    edges: u32,
    violation: Option<Violation>,
}

impl Bench {
    fn of(part: &TwoWireReading, angles: &[u16]) -> Self {
        let sensor =
            |&angle: &u16| RegisterSensor::new(part.address, part.register, part.registers(Some(angle)));
        Self {
            sensors: angles.iter().map(sensor).collect(),
            clock: true,
            low: 0,
            now: std::cell::Cell::new(UNITS_PER_MICROSECOND),
            hurry: 1,
            edges: 0,
            violation: None,
        }
    }

    fn hear(&mut self) {
        for (number, sensor) in self.sensors.iter_mut().enumerate() {
            let heard = sensor.hear(self.clock, self.low & 1 << number == 0, self.now.get());
            self.violation = heard.err().or(self.violation.take());
        }
    }

    /// What a tick reads of three sensors.
    fn read(&mut self, part: &TwoWireReading) -> ([u16; 3], u32) {
        self.edges = 0;
        read(self, part, 0b111)
    }
}

impl TwoWires for Bench {
    fn set_clock(&mut self, is_high: bool) {
        self.edges += u32::from(self.clock != is_high);
        self.clock = is_high;
        self.hear();
    }

    fn pull(&mut self, low: u32) {
        self.low = low;
        self.hear();
    }

    fn levels(&mut self) -> u32 {
        let level = |(number, sensor): (usize, &RegisterSensor)| {
            u32::from(!sensor.pulls() && self.low & 1 << number == 0) << number
        };
        self.sensors.iter().enumerate().map(level).sum()
    }

    fn wait(&self, ns: u32) {
        self.now.set(self.now.get() + Time::from(ns / self.hurry) * UNITS_PER_MICROSECOND / 1000);
    }
}

/// The parts on two wires.
fn parts() -> impl Iterator<Item = (&'static str, &'static TwoWireReading)> {
    PARTS.iter().filter_map(|part| match &part.interface {
        PartInterface::TwoWires(reading) => Some((part.name, reading)),
        _ => None,
    })
}

#[test]
fn every_part_is_read_at_a_megahertz_by_its_row_alone() {
    for (name, part) in parts() {
        let angles = [0x0a5, part.angle_mask, 0];
        let mut bench = Bench::of(part, &angles);
        for _ in 0..3 {
            assert_eq!(bench.read(part), (angles, 0), "{name}");
        }
        assert!(bench.violation.is_none(), "{name}: {:?}", bench.violation);
        // Negative control: a clock that no sensor follows.
        bench.hurry = 2;
        bench.read(part);
        assert!(bench.violation.is_some(), "{name}");
    }
    assert_eq!(parts().count(), 3);
}

#[test]
fn a_sensor_that_does_not_answer_is_bad_and_its_neighbours_are_not() {
    for (name, part) in parts() {
        for (defect, read_later) in [
            (RegisterDefect::WireOpen, 0b010),
            (RegisterDefect::WireGrounded, 0b010),
            (RegisterDefect::OtherAddress, 0b010),
            // The clock of the tick in which it is found frees the wire.
            (RegisterDefect::Holds, 0),
        ] {
            let angles = [0x0a5, 0x123, 0x7ff];
            let mut bench = Bench::of(part, &angles);
            bench.read(part);
            let healthy = bench.edges;
            bench.sensors[1].set_defect(defect);
            let (found, bad) = bench.read(part);
            assert_eq!((found[0], found[2], bad), (angles[0], angles[2], 0b010), "{name} {defect:?}");
            assert_eq!(bench.edges, healthy, "{name} {defect:?}: the time of a reading");
            assert_eq!(bench.read(part).1, read_later, "{name} {defect:?}");
            bench.sensors[1].set_defect(RegisterDefect::None);
            bench.read(part);
            assert_eq!(bench.read(part), (angles, 0), "{name} {defect:?}");
        }
    }
}

#[test]
fn a_magnet_that_is_missing_is_a_bad_sample_of_a_part_that_says_so() {
    for (name, part) in parts() {
        let mut bench = Bench::of(part, &[1, 2, 3]);
        bench.sensors[2].set_values(part.registers(None));
        let (found, bad) = bench.read(part);
        assert_eq!((found[0], found[1]), (1, 2), "{name}");
        assert_eq!(bad, if part.has_state() { 0b100 } else { 0 }, "{name}");
    }
    // Negative control: one of the parts cannot say it.
    assert!(parts().any(|(_, part)| !part.has_state()) && parts().any(|(_, part)| part.has_state()));
}
