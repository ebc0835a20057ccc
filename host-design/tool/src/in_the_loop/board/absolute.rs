//! Absolute sensors of the rig at the pins of the virtual board.

use upright::boards::f4::{ANGLE_BITS, WIPER_BITS};
use upright::control::encoder::{AbsoluteSensor, is_at_end};
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::table::SensorKind;
use upright_board::{Input, SimulatedBoard};
use upright_design::table::TableValues;

/// An absolute sensor.
pub(super) enum AbsoluteAtPins {
    /// On the bus, with what the image makes of its readings.
    OnBus(AbsoluteSensor),
    /// A potentiometer at the converter.
    Potentiometer,
}

impl AbsoluteAtPins {
    /// The sensor with this number, if it is absolute.
    pub(super) fn of(table: &TableValues, sensor: usize) -> Option<Self> {
        match table.sensors[sensor].kind {
            SensorKind::Counter => None,
            SensorKind::Absolute(_) => Some(Self::OnBus(AbsoluteSensor::new(ANGLE_BITS))),
            SensorKind::Potentiometer(_) => Some(Self::Potentiometer),
        }
    }

    /// Shows the board what the sensor reads; returns what the image makes of it (counts).
    pub(super) fn show(&mut self, board: &mut SimulatedBoard, encoder: usize, count: u32) -> i64 {
        match self {
            Self::OnBus(sensor) => {
                let reading = count as u16 & ((1 << ANGLE_BITS) - 1);
                board.apply(Input::Angle { encoder, reading });
                i64::from(sensor.count(reading.into()) as i32)
            }
            Self::Potentiometer => {
                let range = 1 << WIPER_BITS;
                let reading = count & (range - 1);
                // The middle of a step.
                board.apply(Input::Wiper((reading as f32 + 0.5) / range as f32));
                reading.into()
            }
        }
    }

    /// What marks a bad sample of this position (counts) for the firmware on the host.
    pub(super) fn mark(&self, position: i64) -> u32 {
        let is_potentiometer = matches!(self, Self::Potentiometer);
        if is_potentiometer && is_at_end(position as u32, WIPER_BITS) { BAD_SAMPLE } else { 0 }
    }
}
