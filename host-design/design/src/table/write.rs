//! Atomic writing of a file: whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;

/// The file could not be written; its old contents, if any, are unchanged.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be written ({source}); the old file, if any, is unchanged: check that the folder exists and is writable", path.display())]
pub struct WriteError {
    path: PathBuf,
    source: std::io::Error,
}

/// Replaces the contents of `path` in one step: a reader sees the old file or the new one, never half of one.
///
/// A link is followed and stays a link. Anything other than a regular file, such as a device or a pipe, is written to,
/// not replaced.
///
/// # Errors
/// [`WriteError`] with the reason of the file system.
pub fn write_atomically(path: &Path, contents: &[u8]) -> Result<(), WriteError> {
    let write = || {
        let file = match std::fs::metadata(path) {
            Ok(about) if about.is_file() => std::fs::canonicalize(path)?,
            Ok(about) if !about.is_dir() => {
                return std::fs::OpenOptions::new().write(true).open(path)?.write_all(contents);
            }
            _ => path.to_owned(),
        };
        let mut file = AtomicWriteFile::open(file)?;
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

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_its_target_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("gains.rs"), folder.path().join("link.rs"));
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomically(&link, b"new").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "new");
    }

    /// Through a link, so that a mistake here cannot destroy a device of the machine that runs the test.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_written_to_and_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("full");
        std::os::unix::fs::symlink("/dev/full", &link).unwrap();
        let error = write_atomically(&link, b"x").unwrap_err().to_string();
        assert!(error.contains("No space left"), "{error}");
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    }

    #[test]
    fn a_folder_that_does_not_exist_is_an_error_that_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing/gains.rs");
        assert!(write_atomically(&path, b"x").unwrap_err().to_string().contains("missing/gains.rs"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
