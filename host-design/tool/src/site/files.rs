//! The files of one kind in a folder.

use std::path::{Path, PathBuf};

use super::error::SiteError;

/// The TOML files in `folder` and their texts, in the order of their names.
///
/// # Errors
/// [`SiteError::File`] if one cannot be read.
pub(super) fn toml_files(folder: &Path) -> Result<Vec<(PathBuf, String)>, SiteError> {
    files_of(folder, "toml")
}

/// The same for JSON.
///
/// # Errors
/// As for [`toml_files`].
pub(crate) fn json_files(folder: &Path) -> Result<Vec<(PathBuf, String)>, SiteError> {
    files_of(folder, "json")
}

fn files_of(folder: &Path, kind: &str) -> Result<Vec<(PathBuf, String)>, SiteError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        |source| SiteError::File { path, source }
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed(folder))? {
        files.push(entry.map_err(failed(folder))?.path());
    }
    files.retain(|file| file.extension().is_some_and(|extension| extension == kind));
    files.sort();
    let read = |file: PathBuf| {
        let text = std::fs::read_to_string(&file).map_err(failed(&file))?;
        Ok((file, text))
    };
    files.into_iter().map(read).collect()
}
