//! What is made for links on a cart alone, and refuses an arm.

use std::path::Path;

use super::Rig;
use super::error::{RigError, RigErrorKind};

/// A part of the program that knows no arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CartOnly {
    /// Its parameters are those of a cart.
    Identification,
    /// It writes a slide.
    OtherSimulators,
    /// It speaks of metres and newtons.
    Conversation,
}

impl CartOnly {
    fn name(self) -> &'static str {
        match self {
            Self::Identification => "identification",
            Self::OtherSimulators => "the model for other simulators",
            Self::Conversation => "the conversation with a board",
        }
    }
}

impl Rig {
    /// Refuses an arm; `file` is the name that the error shows.
    ///
    /// # Errors
    /// [`RigError`] for an arm, with what can be done instead.
    pub fn needs_cart(&self, part: CartOnly, file: &Path) -> Result<(), RigError> {
        if self.base().is_cart() {
            return Ok(());
        }
        let kind = RigErrorKind::CartOnly { part: part.name() };
        Err(RigError { key: Some("arm".to_owned()), ..RigError::of_file(file, kind) })
    }
}
