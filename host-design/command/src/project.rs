//! Finds the checkout of the project, which holds the source of the firmware.
//!
//! ```
//! let project = upright_command::project::checkout()?;
//! assert!(project.join("src/gains.rs").is_file());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::{Path, PathBuf};

/// No checkout of the project was found; holds the current folder.
#[derive(Debug, thiserror::Error)]
#[error("{} is in no checkout of Upright, which holds the firmware's source: change to one and run this again", .0.display())]
pub struct NoCheckout(PathBuf);

/// A folder is neither a crate with a gain table nor in a checkout of the project; holds the folder.
#[derive(Debug, thiserror::Error)]
#[error(
    "{} is neither a crate with src/gains.rs nor in a checkout of Upright: give the file for the gain table with --out FILE, or write \
     none with --no-write",
    .0.display()
)]
pub struct NoGainTable(PathBuf);

/// The checkout that the current folder is in, otherwise the one from which this tool was built, if it is still there.
///
/// # Errors
/// [`NoCheckout`] if there is none.
pub fn checkout() -> Result<PathBuf, NoCheckout> {
    let current = std::env::current_dir().unwrap_or_default();
    let built_from = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(Path::to_owned);
    checkout_around(&current)
        .or_else(|| built_from().filter(|folder| is_checkout(folder)))
        .ok_or(NoCheckout(current))
}

fn checkout_around(folder: &Path) -> Option<PathBuf> {
    folder.ancestors().find(|folder| is_checkout(folder)).map(Path::to_owned)
}

/// The gain table of the crate in the current folder, or of the checkout that this folder is in. Nothing is ever
/// found elsewhere, so that no command writes into a folder that its user has not chosen.
///
/// # Errors
/// [`NoGainTable`] if there is neither.
pub fn gain_table() -> Result<PathBuf, NoGainTable> {
    let current = std::env::current_dir().unwrap_or_default();
    gain_table_for(&current).ok_or(NoGainTable(current))
}

fn gain_table_for(folder: &Path) -> Option<PathBuf> {
    let table = folder.join("src/gains.rs");
    if folder.join("Cargo.toml").is_file() && table.is_file() {
        return Some(table);
    }
    Some(checkout_around(folder)?.join("src/gains.rs"))
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

    #[test]
    fn a_gain_table_belongs_to_the_crate_in_the_folder_or_to_the_checkout_around_it_and_to_no_other() {
        let checkout = checkout().unwrap();
        assert_eq!(gain_table_for(&checkout.join("rigs")), Some(checkout.join("src/gains.rs")));
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("src/gains.rs");
        assert_eq!(gain_table_for(folder.path()), None);
        std::fs::create_dir(folder.path().join("src")).unwrap();
        std::fs::write(&table, "").unwrap();
        assert_eq!(gain_table_for(folder.path()), None);
        std::fs::write(folder.path().join("Cargo.toml"), "").unwrap();
        assert_eq!(gain_table_for(folder.path()), Some(table));
    }
}
