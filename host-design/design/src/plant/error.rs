//! Why a plant cannot be simulated.

use crate::rig::MAX_LINKS;

/// Why the plant of a chain cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// The number of links in the type is not that of the chain.
    #[error("the chain has {links} links, but this plant was compiled for {compiled}")]
    WrongLinks {
        /// Links of the chain.
        links: usize,
        /// Links in the type.
        compiled: usize,
    },
    /// No plant is compiled for this many links.
    #[error("a chain of {links} links cannot be simulated: give 1 to {} links", MAX_LINKS)]
    UnsupportedLinks {
        /// Links of the chain.
        links: usize,
    },
}
