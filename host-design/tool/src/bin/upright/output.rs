//! What a command prints as its result.

use std::io::Write;

use serde::Serialize;
use upright_design::rig::Rig;

use crate::failure::Failure;

/// Prints a result on stdout: as one JSON object if `is_json`, otherwise as text.
pub(crate) fn print(
    is_json: bool,
    object: &impl Serialize,
    text: impl FnOnce() -> String,
) -> Result<(), Failure> {
    let text = match is_json {
        true => serde_json::to_string(object).map_err(std::io::Error::from)? + "\n",
        false => text(),
    };
    Ok(std::io::stdout().lock().write_all(text.as_bytes())?)
}

/// Warns of values that no bench has.
pub(crate) fn warn_of_unusual_values(rig: &Rig) {
    for value in rig.unusual_values() {
        eprintln!("warning: {value}");
    }
}
