//! What `src/gains.rs` says about itself: it may have been written after the tool was compiled.

use std::path::PathBuf;

use upright_design::rig::Rig;

use super::error::BuildError;
use upright_command::project::checkout;

/// The committed gain table.
#[derive(Debug, Clone, PartialEq)]
pub struct CommittedGains {
    /// Its path.
    pub path: PathBuf,
    /// Hash of the values of its rig file.
    pub rig_hash: u64,
    /// Its checksum.
    pub crc: u32,
}

impl CommittedGains {
    /// Reads it.
    ///
    /// # Errors
    /// [`BuildError`] if there is no such file, or it is not a gain table.
    pub fn read() -> Result<Self, BuildError> {
        let path = checkout()?.join("src/gains.rs");
        let text = std::fs::read_to_string(&path)
            .map_err(|source| BuildError::File { path: path.clone(), source })?;
        let hash = hexadecimal(&text, "pub const RIG_HASH: u64 = ");
        match (hash, hexadecimal(&text, "crc: ").and_then(|crc| u32::try_from(crc).ok())) {
            (Some(rig_hash), Some(crc)) => Ok(Self { path, rig_hash, crc }),
            _ => Err(BuildError::NoGains { path }),
        }
    }

    /// The file in `rigs/` that it is made from; none if it is made from another.
    pub fn rig(&self) -> Option<PathBuf> {
        let files = std::fs::read_dir(checkout().ok()?.join("rigs")).ok()?;
        let mut rigs = files.filter_map(|file| Some(file.ok()?.path()));
        rigs.find(|path| Rig::from_path(path).is_ok_and(|rig| rig.hash() == self.rig_hash))
    }
}

/// The number after `before` at the beginning of a line.
fn hexadecimal(text: &str, before: &str) -> Option<u64> {
    let number = text.lines().find_map(|line| line.trim_start().strip_prefix(before)?.strip_prefix("0x"))?;
    u64::from_str_radix(&number.trim_end_matches([';', ',']).replace('_', ""), 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_table_is_the_one_of_a_rig_in_the_repository() {
        let gains = CommittedGains::read().unwrap();
        let rig = Rig::from_path(&gains.rig().unwrap()).unwrap();
        assert_eq!(gains.rig_hash, rig.hash());
        assert_eq!(CommittedGains { rig_hash: 1, ..gains }.rig(), None);
        assert_eq!(hexadecimal("    crc: 0xcdc3_d964,", "crc: "), Some(0xcdc3_d964));
        assert_eq!(hexadecimal("crc: 12", "crc: "), None);
    }
}
