//! The rigs from which a person can start.

use std::path::{Path, PathBuf};

use upright_plan::Stored;

use super::error::SiteError;
use super::files::toml_files;
use super::page::Example;

/// The rig files in `folder`, by name.
///
/// # Errors
/// [`SiteError::File`] if one cannot be read.
pub fn examples(folder: &Path) -> Result<Vec<Example>, SiteError> {
    let example = |(file, toml): (PathBuf, String)| Example {
        name: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        toml,
        motions: std::fs::read_to_string(Stored::path_beside(&file)).ok(),
    };
    Ok(toml_files(folder)?.into_iter().map(example).collect())
}
