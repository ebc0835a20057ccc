//! Sensors of an angle that can be bought, one row for each: boards, rig files, simulations and documents read it.
//!
//! ```
//! use upright::boards::parts::{PartInterface, PARTS, part};
//!
//! let (number, as5600) = part("as5600").unwrap();
//! assert_eq!((as5600.bits, &PARTS[number].name), (12, &"as5600"));
//! let PartInterface::TwoWires(reading) = as5600.interface else { panic!() };
//! // The magnet is there, 0x0abc.
//! assert_eq!(reading.angle(&[0x20, 0x0a, 0xbc]), Some(0x0abc));
//! ```

use super::two_wires::TwoWireReading;

/// A sensor that reads a whole turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorPart {
    /// Its name in a rig file.
    pub name: &'static str,
    /// Bits of a turn.
    pub bits: u32,
    /// Age of a reading (s), by its own filter.
    pub delay_s: f64,
    /// Noise besides the rounding to its bits (rad, root mean square).
    pub noise_rad: f64,
    /// Typical error once and twice per turn, from how it is mounted (rad).
    pub error_rad: [f64; 2],
    /// How it is read.
    pub interface: PartInterface,
}

/// How a sensor is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PartInterface {
    /// Frames of 16 bits with parity, each of which answers the one before.
    Frames,
    /// Registers on two wires (I²C).
    TwoWires(TwoWireReading),
    /// A voltage, which does not wrap: near the ends of its range it is no angle.
    Analog,
}

/// The rows. A gain table names a part by the number of its row: a new one comes last.
pub static PARTS: [SensorPart; 4] = [
    // AS5047D and AS5047P. Data sheet of the AS5047P, v1-06: angle with dynamic error compensation, noise 0.068° rms.
    SensorPart {
        name: "as5047",
        bits: 14,
        delay_s: 0.0,
        noise_rad: 1.2e-3,
        error_rad: MAGNET_RAD,
        interface: PartInterface::Frames,
    },
    // Data sheet v1-06, with the configuration that it is sold with: slow filter of 16, which settles in 2.2 ms and has
    // 0.015° rms. The delay is half of that and of the sampling of 150 µs, and the time on the wires.
    SensorPart {
        name: "as5600",
        bits: 12,
        delay_s: 1.2e-3,
        noise_rad: 2.6e-4,
        // Threads on its mounting report up to 3°: magnets that are too large, off centre, or tilted.
        error_rad: [0.03, 0.03],
        interface: PartInterface::TwoWires(TwoWireReading {
            address: 0x36,
            register: 0x0b,
            bytes: 3,
            low_bits: 8,
            low_shift: 0,
            angle_mask: 0x0fff,
            // A magnet is found, and is not too weak.
            state: [0x30, 0x20],
        }),
    },
    // Data sheet rev. 1.2: 5 µs. It states no noise; this is that of the AS5048.
    SensorPart {
        name: "mt6701",
        bits: 14,
        delay_s: 1e-4,
        noise_rad: 1.05e-3,
        error_rad: MAGNET_RAD,
        interface: PartInterface::TwoWires(TwoWireReading {
            address: 0x06,
            register: 0x03,
            bytes: 2,
            low_bits: 6,
            low_shift: 2,
            angle_mask: 0x3fff,
            // It has no register for its magnet.
            state: [0, 0],
        }),
    },
    // Data sheet v1-12: 100 µs, noise 0.06° rms.
    SensorPart {
        name: "as5048b",
        bits: 14,
        delay_s: 2e-4,
        noise_rad: 1.05e-3,
        error_rad: MAGNET_RAD,
        interface: PartInterface::TwoWires(TwoWireReading {
            address: 0x40,
            register: 0xfb,
            bytes: 5,
            low_bits: 6,
            low_shift: 0,
            angle_mask: 0x3fff,
            // The angle is computed, without overflow, and the magnet is not too weak.
            state: [0x0b, 0x01],
        }),
    },
];

/// Errors of a magnet that is mounted as its data sheet asks for (rad).
const MAGNET_RAD: [f64; 2] = [0.01, 0.003];

/// The part with this name, and its number.
pub fn part(name: &str) -> Option<(usize, &'static SensorPart)> {
    PARTS.iter().enumerate().find(|(_, part)| part.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_has_a_name_of_its_own() {
        for (number, row) in PARTS.iter().enumerate() {
            assert_eq!(part(row.name), Some((number, row)));
        }
        assert_eq!(part("as56"), None);
    }

    #[test]
    fn the_angle_is_where_the_data_sheet_has_it_and_a_bad_magnet_is_none() {
        let angle = |name: &str, bytes: &[u8]| match part(name).unwrap().1.interface {
            PartInterface::TwoWires(reading) => reading.angle(bytes),
            _ => panic!("{name} has no registers"),
        };
        assert_eq!(
            angle("as5600", &[0x20, 0xfa, 0xbc]),
            Some(0x0abc),
            "the upper bits are not those of an angle"
        );
        assert_eq!(
            angle("as5600", &[0x28, 0x0a, 0xbc]),
            Some(0x0abc),
            "a magnet that is too strong still reads"
        );
        for missing_or_weak in [0x00, 0x30, 0x10] {
            assert_eq!(angle("as5600", &[missing_or_weak, 0x0a, 0xbc]), None);
        }
        assert_eq!(angle("mt6701", &[0xff, 0xfc]), Some(0x3fff));
        assert_eq!(
            angle("mt6701", &[0x80, 0x04 | 3]),
            Some(0x2001),
            "the lowest two bits are not those of an angle"
        );
        assert_eq!(angle("as5048b", &[0x01, 0, 0, 0x80, 0x3f]), Some(0x203f));
        assert_eq!(angle("as5048b", &[0x09, 0, 0, 0x80, 0x3f]), None, "too weak");
        assert_eq!(angle("as5048b", &[0x00, 0, 0, 0x80, 0x3f]), None, "not yet computed");
        assert_eq!(angle("as5048b", &[0x01, 0, 0, 0x80]), None, "a byte too few");
    }
}
