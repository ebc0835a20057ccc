//! The rigs from which a person can start.

use std::path::Path;

use upright_design::swing_up::Stored;

use super::error::SiteError;
use super::page::Example;

/// The rig files in `folder`, by name.
///
/// # Errors
/// [`SiteError::File`] if one cannot be read.
pub fn examples(folder: &Path) -> Result<Vec<Example>, SiteError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        |source| SiteError::File { path, source }
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed(folder))? {
        files.push(entry.map_err(failed(folder))?.path());
    }
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    let example = |file: &std::path::PathBuf| {
        Ok(Example {
            name: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            toml: std::fs::read_to_string(file).map_err(failed(file))?,
            motions: std::fs::read_to_string(Stored::path_beside(file)).ok(),
        })
    };
    files.iter().map(example).collect()
}
