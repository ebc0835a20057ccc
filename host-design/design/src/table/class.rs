//! What the code of an image depends on: the numbers of states and sensors, how the sensors read, whether the drive
//! takes pulses, and whether there are motions.

use upright::table::{DriveMap, Fill, ReadingMap, SensorKind};

use super::values::TableValues;

/// Source that an image is compiled with, in place of a `gains.rs`: it has the numbers and kinds of a rig, and zeros in
/// place of its values. All rigs of a class have the same.
pub fn class_source(table: &TableValues) -> String {
    let (states, sensors) = (table.states(), table.sensors());
    let kinds = table.rows().iter().map(|row| {
        let mut kind = row.kind;
        if let Some(reading) = kind.reading_mut() {
            *reading = ReadingMap { bits: reading.bits, ..Fill::EMPTY };
        }
        if let SensorKind::OfPart(part) = &mut kind {
            part.errors = Fill::EMPTY;
        }
        format!("    SensorRow {{ kind: SensorKind::{kind:?}, ..Fill::EMPTY }},\n")
    });
    let kinds: String = kinds.collect();
    let drive = match table.drive {
        DriveMap::Force(_) | DriveMap::Volts(_) => "Force",
        DriveMap::Pulses(_) => "Pulses",
    };
    let swing_up = match table.swing_up {
        Some(_) => format!("SwingUpTable<'static, SENSORS, {}>", sensors - 1),
        None => "NoSwingUp".to_owned(),
    };
    format!(
        "// Of rigs with {states} states and {sensors} sensors, written by `upright firmware build`.\n\
         use upright::table::*;\n\n\
         pub const STATES: usize = {states};\n\
         pub const SENSORS: usize = {sensors};\n\n\
         /// Only the kinds of drive and sensors count.\n\
         pub const TABLE: GainTable<STATES, SENSORS> = GainTable {{\n\
         drive: DriveMap::{drive}(Fill::EMPTY),\n\
         sensors: [\n{kinds}],\n\
         ..Fill::EMPTY\n\
         }};\n\n\
         pub type SwingUp = {swing_up};\n"
    )
}
