//! Loading of a rig file into a checked [`Rig`].

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::base::Base;
use super::error::{MAX_BYTES, RigError, RigErrorKind};
use super::node::RigSource;
use super::{Rig, read};

impl Rig {
    /// Reads and checks the rig file at `file`.
    ///
    /// # Errors
    /// [`RigError`] with the place, the key and what to do about it.
    pub fn from_path(file: &Path) -> Result<Rig, RigError> {
        let bytes = bytes(file).map_err(|kind| RigError::of_file(file, kind))?;
        match std::str::from_utf8(&bytes) {
            Ok(text) => Rig::from_toml(text, file),
            Err(error) => {
                let offset = error.valid_up_to();
                let readable = String::from_utf8_lossy(&bytes[..offset]);
                let source = RigSource { file, text: &readable, base: Base::Cart };
                Err(source.error(offset, None, RigErrorKind::NotUtf8 { offset }))
            }
        }
    }

    /// Checks the text of a rig file; `file` is the name that its errors show.
    ///
    /// # Errors
    /// As for [`from_path`](Self::from_path), without those of the file system.
    pub fn from_toml(text: &str, file: &Path) -> Result<Rig, RigError> {
        if text.len() as u64 > MAX_BYTES {
            return Err(RigError::of_file(file, RigErrorKind::TooLarge));
        }
        read::rig(&RigSource { file, text, base: Base::Cart })
    }
}

/// Reads a file of at most `MAX_BYTES` bytes.
fn bytes(file: &Path) -> Result<Vec<u8>, RigErrorKind> {
    let about = std::fs::metadata(file).map_err(refusal)?;
    if about.is_dir() {
        return Err(RigErrorKind::Directory);
    }
    if about.len() > MAX_BYTES {
        return Err(RigErrorKind::TooLarge);
    }
    // Pipes and devices report no size beforehand: stop reading one byte past the limit.
    let mut bytes = Vec::new();
    File::open(file).and_then(|open| open.take(MAX_BYTES + 1).read_to_end(&mut bytes)).map_err(refusal)?;
    if bytes.len() as u64 > MAX_BYTES { Err(RigErrorKind::TooLarge) } else { Ok(bytes) }
}

fn refusal(error: io::Error) -> RigErrorKind {
    match error.kind() {
        io::ErrorKind::NotFound => RigErrorKind::NoFile,
        io::ErrorKind::IsADirectory => RigErrorKind::Directory,
        _ => RigErrorKind::Unreadable { reason: error.to_string() },
    }
}
