//! The boards by name. Each is described in the firmware, in `src/image/board/f4/boards/`.

use upright_board::{Chip, Conditions, Wiring};

/// A board that there is an image for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// WeAct Studio STM32F405 core board.
    WeactF405,
    /// Olimex STM32-H405.
    OlimexH405,
    /// Adafruit Feather STM32F405 Express.
    FeatherF405,
    /// ST STM32F407G-DISC1.
    DiscoveryF407,
    /// ST NUCLEO-F446RE.
    NucleoF446,
}

impl Board {
    /// All boards; the first one is the default.
    pub const ALL: [Self; 5] =
        [Self::WeactF405, Self::OlimexH405, Self::FeatherF405, Self::DiscoveryF407, Self::NucleoF446];

    /// Name on the command line, and of the cargo feature.
    pub const fn name(self) -> &'static str {
        match self {
            Board::WeactF405 => "weact-f405",
            Board::OlimexH405 => "olimex-h405",
            Board::FeatherF405 => "feather-f405",
            Board::DiscoveryF407 => "discovery-f407",
            Board::NucleoF446 => "nucleo-f446",
        }
    }

    /// Name of its microcontroller in probe-rs.
    pub const fn chip(self) -> &'static str {
        match self {
            Board::WeactF405 | Board::OlimexH405 | Board::FeatherF405 => "STM32F405RGTx",
            Board::DiscoveryF407 => "STM32F407VGTx",
            Board::NucleoF446 => "STM32F446RETx",
        }
    }

    /// Number of encoders that it can count: the cart's and those of the links.
    pub fn encoders(self) -> usize {
        self.conditions(0).wiring.encoders.len()
    }

    /// Conditions of the virtual board, at typical values; `seed` determines everything random.
    pub fn conditions(self, seed: u64) -> Conditions {
        let mut conditions = Conditions::f405(seed);
        match self {
            Board::WeactF405 | Board::OlimexH405 => {}
            Board::FeatherF405 => {
                conditions.wiring = Wiring::feather();
                conditions.crystal.hz = 12_000_000;
            }
            Board::DiscoveryF407 => (conditions.chip, conditions.chip_v) = (Chip::F407, 3.0),
            Board::NucleoF446 => {
                conditions.chip = Chip::F446;
                conditions.crystal.is_clock_input = true;
            }
        }
        conditions
    }
}

/// A name that no board has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no board has this name; choose one of {}", Board::ALL.map(Board::name).join(", "))]
pub struct NoBoard;

impl std::str::FromStr for Board {
    type Err = NoBoard;

    fn from_str(name: &str) -> Result<Self, NoBoard> {
        Board::ALL.into_iter().find(|board| board.name() == name).ok_or(NoBoard)
    }
}

impl std::fmt::Display for Board {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}
