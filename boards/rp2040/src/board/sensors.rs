//! Which sensors of the rig are on two wires.

use upright::boards::parts::PartInterface;
use upright::boards::two_wires::TwoWireReading;

use crate::gains::{SENSORS, TABLE};

/// The sensors on two wires, by bits.
pub(super) const ON_BUS: u32 = {
    let (mut bits, mut sensor) = (0, 0);
    while sensor < SENSORS {
        bits |= (reading(sensor).is_some() as u32) << sensor;
        sensor += 1;
    }
    bits
};

/// How they are read, and their bits: they are of one kind.
pub(super) const PART: Option<(&TwoWireReading, u32)> = {
    let (mut part, mut sensor) = (None, 0);
    while sensor < SENSORS {
        if let (Some(of), Some(reading)) = (reading(sensor), TABLE.sensors[sensor].kind.reading()) {
            part = Some((of, reading.bits));
        }
        sensor += 1;
    }
    part
};

/// Whether the rig has such sensors.
pub(super) const ARE_THERE: bool = PART.is_some();

const fn reading(sensor: usize) -> Option<&'static TwoWireReading> {
    match &TABLE.sensors[sensor].kind.row() {
        Some(row) => match &row.interface {
            PartInterface::TwoWires(reading) => Some(reading),
            _ => panic!("an absolute sensor of another kind than this board reads"),
        },
        None => {
            assert!(
                TABLE.sensors[sensor].kind.interface().is_none(),
                "a sensor of another kind than this board reads"
            );
            None
        }
    }
}
