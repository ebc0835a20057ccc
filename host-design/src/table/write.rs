//! Writing a file whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;

/// The file could not be written; what was there before is still there.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be written ({source}); the old file, if any, is unchanged: check that the folder exists and is writable", path.display())]
pub struct WriteError {
    path: PathBuf,
    source: std::io::Error,
}

/// Replaces the contents of `path` in one step: a reader sees the old file or the new one, never a half.
///
/// # Errors
/// [`WriteError`] with the reason of the file system.
pub fn write_atomically(path: &Path, contents: &[u8]) -> Result<(), WriteError> {
    let write = || {
        let mut file = AtomicWriteFile::open(path)?;
        file.write_all(contents)?;
        file.commit()
    };
    write().map_err(|source| WriteError { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("gains.rs");
        write_atomically(&path, b"first").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "second");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
    }

    #[test]
    fn a_folder_that_does_not_exist_is_an_error_that_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing/gains.rs");
        assert!(write_atomically(&path, b"x").unwrap_err().to_string().contains("missing/gains.rs"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
