//! Which sensors of the rig are absolute, and what that means for the pins.

use upright::boards::f4::ANGLE_BITS;
pub(super) use upright::boards::f4::WIPER_BITS;
use upright::boards::wiring::{PinMode, Signal, Wire, wire_of};
use upright::gains::{SENSORS, TABLE};

use super::chosen::BOARD;

/// The sensor that may be a potentiometer, and the pin of its wiper: channel B of the encoder in its place.
const WIPER: usize = 1;
const WIPER_SIGNAL: Signal = Signal::Encoder(WIPER as u8, b'B');

/// Whether the rig has absolute sensors on the bus.
pub(super) const ANY_IS_ON_BUS: bool = {
    let (mut any, mut sensor) = (false, 0);
    while sensor < SENSORS {
        if is_on_bus(sensor) {
            assert!(has_bits(sensor, ANGLE_BITS), "an absolute sensor of other bits");
            any = true;
        }
        sensor += 1;
    }
    any
};

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
    sensor < SENSORS && TABLE.sensors[sensor].kind.is_absolute()
}

/// Whether the readings of an absolute sensor have so many bits.
const fn has_bits(sensor: usize, bits: u32) -> bool {
    matches!(TABLE.sensors[sensor].kind.reading(), Some(reading) if reading.bits == bits)
}

/// Whether a sensor of the rig is on the bus. Only one may be a potentiometer.
pub(super) const fn is_on_bus(sensor: usize) -> bool {
    is_absolute(sensor) && (sensor != WIPER || !TABLE.sensors[sensor].kind.is_potentiometer())
}

/// Mode of a pin in this image; none, if it is left alone.
pub(super) const fn mode(wire: Wire) -> Option<PinMode> {
    match wire.signal {
        Signal::AngleSelect | Signal::AngleClock | Signal::AngleCommand if !ANY_IS_ON_BUS => None,
        Signal::Encoder(1, b'B') if WIPER_WIRE.is_some() => Some(PinMode::Analog),
        Signal::Encoder(sensor, _) if is_absolute(sensor as usize) => Some(PinMode::Input),
        _ => Some(wire.mode),
    }
}
