//! Absolute sensors of the rig at the pins of the virtual board.

use upright::boards::f4::WIPER_BITS;
use upright::boards::parts::PartInterface;
use upright::control::encoder::{AbsoluteSensor, is_at_end};
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::table::SensorRow;
use upright_board::{Input, SimulatedBoard};
use upright_design::table::TableValues;

/// An absolute sensor, with what the image makes of its readings.
pub(super) struct AbsoluteAtPins {
    interface: PartInterface,
    bits: u32,
    on_bus: AbsoluteSensor,
}

impl AbsoluteAtPins {
    /// The sensor with this number, if it is absolute.
    pub(super) fn of(table: &TableValues, sensor: usize) -> Option<Self> {
        let kind = table.sensors[sensor].kind;
        let bits = kind.reading()?.bits;
        Some(Self { interface: kind.interface()?, bits, on_bus: AbsoluteSensor::new(bits) })
    }

    /// Whether a sensor is on two wires.
    pub(super) fn are_on_two_wires(table: &TableValues) -> bool {
        let is_there = |row: &SensorRow| matches!(row.kind.interface(), Some(PartInterface::TwoWires(_)));
        table.rows().iter().any(is_there)
    }

    /// Shows the board what the sensor reads; returns what the image makes of it (counts).
    pub(super) fn show(&mut self, board: &mut SimulatedBoard, encoder: usize, count: u32) -> i64 {
        let range = 1u32 << self.bits;
        let reading = count & (range - 1);
        let on_bus = reading as u16;
        board.apply(match self.interface {
            PartInterface::Frames => Input::Angle { encoder, reading: on_bus },
            PartInterface::TwoWires(part) => {
                let values = part.registers(Some(on_bus));
                Input::Registers { encoder, address: part.address, first: part.register, values }
            }
            // The middle of a step.
            PartInterface::Analog => Input::Wiper((reading as f32 + 0.5) / range as f32),
        });
        match self.interface {
            PartInterface::Analog => reading.into(),
            _ => i64::from(self.on_bus.count(reading) as i32),
        }
    }

    /// What marks a bad sample of this position (counts) for the firmware on the host.
    pub(super) fn mark(&self, position: i64) -> u32 {
        let is_dead = self.interface == PartInterface::Analog && is_at_end(position as u32, WIPER_BITS);
        if is_dead { BAD_SAMPLE } else { 0 }
    }
}
