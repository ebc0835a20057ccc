//! Text of a rig file: either a rig, or an error of one line with an exit code for bad input.

use std::path::Path;

use upright_design::rig::Rig;

/// Reads `bytes` as a rig file.
///
/// # Panics
/// If an error is not one line that begins with the file's name, or has an exit code other than 2 or 3.
pub fn check(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match Rig::from_toml(text, Path::new("fuzz.toml")) {
        Ok(rig) => {
            let _ = (rig.hash(), rig.describe());
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with("fuzz.toml:") && !message.contains('\n'), "{message:?}");
            assert!(matches!(error.exit_code(), 2 | 3));
        }
    }
}
