//! What a command prints as its result.

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use upright_design::rig::Rig;

use crate::failure::Failure;

/// Prints a result on stdout: as one JSON object if `is_json`, otherwise as text.
///
/// # Errors
/// If stdout is closed.
pub fn print(is_json: bool, object: &impl Serialize, text: impl FnOnce() -> String) -> Result<(), Failure> {
    let text = match is_json {
        true => serde_json::to_string(object).map_err(std::io::Error::from)? + "\n",
        false => text(),
    };
    Ok(std::io::stdout().lock().write_all(text.as_bytes())?)
}

/// Warns of values that no bench has, with their lines in the rig file.
pub fn warn_of_unusual_values(rig: &Rig, file: &Path) {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    for value in rig.unusual_values() {
        let line = value.line(&text).map_or_else(String::new, |line| format!(":{line}"));
        eprintln!("warning: {}{line}: {value}", file.display());
    }
}

/// Warns of a motion that is planned for a cart that may be an arm.
pub fn warn_of_an_arm(rig: &Rig) {
    if rig.may_be_an_arm() {
        eprintln!(
            "warning: the rail is shorter than one turn of the pulley: if the cart is an arm that turns about a vertical \
             axis, describe it by [arm]: no motion far from upright fits a cart, which has no centrifugal force"
        );
    }
}
