//! The rigs from which a person can start.

use std::path::{Path, PathBuf};

use upright_design::rig::{CartOnly, Rig};
use upright_plan::Stored;

use super::error::SiteError;
use super::files::toml_files;
use super::page::Example;

/// The rig files in `folder`, by name, without those that the page refuses.
///
/// # Errors
/// [`SiteError::File`] if one cannot be read.
pub fn examples(folder: &Path) -> Result<Vec<Example>, SiteError> {
    let example = |(file, toml): (PathBuf, String)| Example {
        name: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        toml,
        motions: std::fs::read_to_string(Stored::path_beside(&file)).ok(),
    };
    let is_shown = |(file, toml): &(PathBuf, String)| {
        Rig::from_toml(toml, file).is_ok_and(|rig| rig.needs_cart(CartOnly::Page, file).is_ok())
    };
    Ok(toml_files(folder)?.into_iter().filter(is_shown).map(example).collect())
}
