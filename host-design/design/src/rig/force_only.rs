//! Commands that do not serve every drive.

use super::description::Rig;

/// A command for a rig whose drive it does not serve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "{rig}: `upright {command}` serves only drives that give a force; with kind = \"acceleration\" in [actuator] there \
     are `check`, `design`, `verify`, `robust`, `simulate`, `compare`, `report`, `twin`, `faults`, `false-alarms`, \
     `shake`, `identify`, `coverage`, `commission`, `export`, `firmware build --board pico` (docs/drives.md). To see what it would say, describe the machine by kind = \"force\" and a cart of 100 times the \
     links' mass, which moves as its drive says whatever the links do"
)]
pub struct ForceOnly {
    rig: String,
    command: &'static str,
}

impl Rig {
    /// Refuses `command` for a drive that imposes the cart's acceleration.
    ///
    /// # Errors
    /// [`ForceOnly`] for such a drive.
    pub fn refuse_acceleration(&self, command: &'static str) -> Result<(), ForceOnly> {
        match self.actuator.acceleration {
            Some(_) => Err(ForceOnly { rig: self.name.clone(), command }),
            None => Ok(()),
        }
    }
}
