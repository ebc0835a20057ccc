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
    /// Number of sensors.
    pub sensors: usize,
    /// Tick (s).
    pub tick_s: f64,
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
        let hash = constant(&text, "RIG_HASH").map(|hash| hash.trim_start_matches("0x").replace('_', ""));
        let parsed = hash.and_then(|hash| u64::from_str_radix(&hash, 16).ok()).and_then(|rig_hash| {
            let sensors = constant(&text, "SENSORS")?.parse().ok()?;
            Some((rig_hash, sensors, constant(&text, "TICK_S")?.parse().ok()?))
        });
        let Some((rig_hash, sensors, tick_s)) = parsed else { return Err(BuildError::NoGains { path }) };
        Ok(Self { path, rig_hash, sensors, tick_s })
    }

    /// The file in `rigs/` that it is made from; none if it is made from another.
    pub fn rig(&self) -> Option<PathBuf> {
        let files = std::fs::read_dir(checkout().ok()?.join("rigs")).ok()?;
        let mut rigs = files.filter_map(|file| Some(file.ok()?.path()));
        rigs.find(|path| Rig::from_path(path).is_ok_and(|rig| rig.hash() == self.rig_hash))
    }
}

/// The value of a constant in this source.
fn constant<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let line = text.lines().find_map(|line| line.strip_prefix("pub const ")?.strip_prefix(name))?;
    line.strip_prefix(": ")?.split_once(" = ")?.1.strip_suffix(';')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_table_is_the_one_of_a_rig_in_the_repository() {
        let gains = CommittedGains::read().unwrap();
        let rig = Rig::from_path(&gains.rig().unwrap()).unwrap();
        assert_eq!((gains.sensors, gains.tick_s), (rig.sensors().len(), rig.tick.period_s));
        assert_eq!(CommittedGains { rig_hash: 1, ..gains }.rig(), None);
        assert_eq!(constant("pub const SENSORS: usize = 5;", "TICK_S"), None);
    }
}
