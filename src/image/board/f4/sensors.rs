//! Which sensors of the rig are absolute, and what that means for the pins.

use upright::boards::f4::ANGLE_BITS;
pub(super) use upright::boards::f4::WIPER_BITS;
use upright::boards::parts::PartInterface;
use upright::boards::wiring::{PinMode, Signal, Wire, wire_of};
use upright::gains::{SENSORS, TABLE};
use upright::table::SensorKind;

use super::chosen::BOARD;

/// The sensor that may be a potentiometer, and the pin of its wiper: channel B of the encoder in its place.
const WIPER: usize = 1;
const WIPER_SIGNAL: Signal = Signal::Encoder(WIPER as u8, b'B');

/// What the sensors on the bus are, if the rig has any: one bus has sensors of one kind.
pub(super) const BUS: Option<PartInterface> = {
    let (mut bus, mut sensor) = (None, 0);
    while sensor < SENSORS {
        if let Some(interface) = on_bus(sensor) {
            assert!(has_bits(sensor, BITS), "absolute sensors of different bits");
            assert!(part_number(sensor) == part_number(FIRST), "absolute sensors of different parts");
            bus = Some(interface);
        }
        sensor += 1;
    }
    bus
};

/// The first sensor on the bus.
const FIRST: usize = {
    let mut sensor = 0;
    while sensor < SENSORS && on_bus(sensor).is_none() {
        sensor += 1;
    }
    sensor
};

/// Number of the part that a sensor is; that of no part for one that the gain table does not name.
const fn part_number(sensor: usize) -> u32 {
    match &TABLE.sensors[sensor].kind {
        SensorKind::OfPart(part) => part.part,
        _ => u32::MAX,
    }
}

/// Bits of the sensors on the bus.
pub(super) const BITS: u32 = {
    if FIRST < SENSORS && part_number(FIRST) != u32::MAX {
        match TABLE.sensors[FIRST].kind.reading() {
            Some(reading) => reading.bits,
            None => ANGLE_BITS,
        }
    } else {
        ANGLE_BITS
    }
};

/// The sensors on the bus, by bits.
pub(super) const ON_BUS: u32 = {
    let (mut bits, mut sensor) = (0, 0);
    while sensor < SENSORS {
        bits |= (is_on_bus(sensor) as u32) << sensor;
        sensor += 1;
    }
    bits
};

/// Whether they are on two wires.
const IS_TWO_WIRES: bool = matches!(BUS, Some(PartInterface::TwoWires(_)));

/// Whether the rig has absolute sensors on the bus.
pub(super) const ANY_IS_ON_BUS: bool = BUS.is_some();

/// The wire of the wiper, if the rig has a potentiometer.
pub(super) const WIPER_WIRE: Option<Wire> = if is_absolute(WIPER) && !is_on_bus(WIPER) {
    assert!(has_bits(WIPER, WIPER_BITS), "a potentiometer of other bits");
    Some(wire_of(BOARD.wiring, WIPER_SIGNAL))
} else {
    None
};

/// Whether the rig has absolute sensors.
pub(super) const ANY_IS_ABSOLUTE: bool = ANY_IS_ON_BUS || WIPER_WIRE.is_some();

/// Whether a sensor of the rig is absolute.
pub(super) const fn is_absolute(sensor: usize) -> bool {
    sensor < SENSORS && TABLE.sensors[sensor].kind.interface().is_some()
}

/// Whether the readings of an absolute sensor have so many bits.
const fn has_bits(sensor: usize, bits: u32) -> bool {
    matches!(TABLE.sensors[sensor].kind.reading(), Some(reading) if reading.bits == bits)
}

/// Whether a sensor of the rig is on the bus.
pub(super) const fn is_on_bus(sensor: usize) -> bool {
    on_bus(sensor).is_some()
}

/// How a sensor on the bus is read. Only one sensor may be a potentiometer, which is not on it.
const fn on_bus(sensor: usize) -> Option<PartInterface> {
    if sensor >= SENSORS {
        return None;
    }
    match TABLE.sensors[sensor].kind.interface() {
        Some(PartInterface::Analog) => {
            assert!(sensor == WIPER, "a potentiometer in another place");
            None
        }
        interface => interface,
    }
}

/// Mode of a pin in this image; none, if it is left alone.
pub(super) const fn mode(wire: Wire) -> Option<PinMode> {
    match wire.signal {
        Signal::AngleClock if !ANY_IS_ON_BUS => None,
        Signal::AngleSelect | Signal::AngleCommand if !matches!(BUS, Some(PartInterface::Frames)) => None,
        Signal::Encoder(sensor, b'A') if is_on_bus(sensor as usize) && IS_TWO_WIRES => {
            Some(PinMode::OpenDrain)
        }
        Signal::Encoder(1, b'B') if WIPER_WIRE.is_some() => Some(PinMode::Analog),
        Signal::Encoder(sensor, _) if is_absolute(sensor as usize) => Some(PinMode::Input),
        _ => Some(wire.mode),
    }
}
