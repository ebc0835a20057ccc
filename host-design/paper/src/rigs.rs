//! The rigs of the paper, and their designs.

use std::path::Path;

use upright_design::design::{Certified, design};
use upright_design::rig::{Chain, PlantDescription, Rig};

use super::error::ReproduceError;

/// Seed of all disturbances.
pub const SEED: u64 = 1;

/// The two rig files of the paper's machine.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperRigs {
    /// The machine itself, with our tick, limit, encoders and noise: `quadruple-paper.toml`.
    pub exact: Rig,
    /// A and B as printed in the paper: `quadruple-paper-printed.toml`.
    pub printed: Rig,
}

impl PaperRigs {
    /// Reads both files from `folder`.
    ///
    /// # Errors
    /// [`ReproduceError::NoRigs`] if they are not there, [`ReproduceError::Rig`] if one cannot be used.
    pub fn from_folder(folder: &Path) -> Result<Self, ReproduceError> {
        let read = |name: &str| {
            let file = folder.join(name);
            if file.is_file() { Ok(Rig::from_path(&file)?) } else { Err(ReproduceError::NoRigs(file)) }
        };
        Ok(Self { exact: read("quadruple-paper.toml")?, printed: read("quadruple-paper-printed.toml")? })
    }
}

/// The designs of both rig files.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperDesigns {
    /// Design of [`PaperRigs::exact`].
    pub exact: Certified,
    /// Design of [`PaperRigs::printed`].
    pub printed: Certified,
}

impl PaperDesigns {
    /// Designs both rigs.
    ///
    /// # Errors
    /// [`ReproduceError::Design`] if one has no solution.
    pub fn of(rigs: &PaperRigs) -> Result<Self, ReproduceError> {
        Ok(Self { exact: design(&rigs.exact)?, printed: design(&rigs.printed)? })
    }
}

/// The chain of a rig that has one.
pub(crate) fn chain(rig: &Rig) -> Result<&Chain, ReproduceError> {
    match &rig.plant {
        PlantDescription::Chain(chain) => Ok(chain),
        PlantDescription::Model(_) => Err(ReproduceError::NotAChain(rig.name.clone())),
    }
}
