//! Finds the checkout of the project, which holds the source of the firmware.

use std::path::{Path, PathBuf};

/// No checkout of the project was found; holds the current folder.
#[derive(Debug, thiserror::Error)]
#[error("{} is in no checkout of Upright, which holds the firmware's source: change to one and run this again", .0.display())]
pub struct NoCheckout(PathBuf);

/// The checkout that the current folder is in, otherwise the one from which this tool was built, if it is still there.
///
/// # Errors
/// [`NoCheckout`] if there is none.
pub fn checkout() -> Result<PathBuf, NoCheckout> {
    let current = std::env::current_dir().unwrap_or_default();
    let around = current.ancestors().find(|folder| is_checkout(folder)).map(Path::to_owned);
    let built_from = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(Path::to_owned);
    around.or_else(|| built_from().filter(|folder| is_checkout(folder))).ok_or(NoCheckout(current))
}

/// Whether the folder holds the manifest of the firmware and the memory map of its boards.
fn is_checkout(folder: &Path) -> bool {
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
    manifest.lines().any(|line| line.trim_end() == "name = \"upright\"") && folder.join("memory.x").is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checkout_is_found_and_another_folder_is_none() {
        let found = checkout().unwrap();
        assert!(found.join("src/gains.rs").is_file());
        assert!(!is_checkout(&found.join("host-design/tool")));
        assert!(!is_checkout(&std::env::temp_dir()));
    }
}
