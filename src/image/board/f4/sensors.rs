//! Which sensors of the rig are absolute, and what that means for the pins.

use upright::gains::{SENSORS, TABLE};

use super::wiring::{PinMode, Signal, Wire};

/// Bits of an absolute sensor.
pub(super) const BITS: u32 = 14;

/// Whether the rig has absolute sensors.
pub(super) const ANY_IS_ABSOLUTE: bool = {
    let (mut any, mut sensor) = (false, 0);
    while sensor < SENSORS {
        if is_absolute(sensor) {
            assert!(TABLE.limits.turn_counts[sensor] == 1 << BITS, "an absolute sensor of other bits");
            any = true;
        }
        sensor += 1;
    }
    any
};

/// Whether a sensor of the rig is absolute.
pub(super) const fn is_absolute(sensor: usize) -> bool {
    sensor < SENSORS && TABLE.absolute.zero_counts[sensor] >= 0
}

/// Mode of a pin in this image; none, if it is left alone.
pub(super) const fn mode(wire: Wire) -> Option<PinMode> {
    match wire.signal {
        Signal::AngleSelect | Signal::AngleClock | Signal::AngleCommand if !ANY_IS_ABSOLUTE => None,
        Signal::Encoder(sensor, _) if is_absolute(sensor as usize) => Some(PinMode::Input),
        _ => Some(wire.mode),
    }
}
