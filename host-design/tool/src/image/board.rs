//! The boards by name. Each is described in the firmware, in `src/image/board/f4/boards/`.

use upright_board::{BoardWiring, Chip, Conditions};

/// A board that there is an image for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardName {
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

impl BoardName {
    /// All boards; the first one is the default.
    pub const ALL: [Self; 5] =
        [Self::WeactF405, Self::OlimexH405, Self::FeatherF405, Self::DiscoveryF407, Self::NucleoF446];

    /// Name on the command line, and of the cargo feature.
    pub const fn name(self) -> &'static str {
        match self {
            BoardName::WeactF405 => "weact-f405",
            BoardName::OlimexH405 => "olimex-h405",
            BoardName::FeatherF405 => "feather-f405",
            BoardName::DiscoveryF407 => "discovery-f407",
            BoardName::NucleoF446 => "nucleo-f446",
        }
    }

    /// Name of its microcontroller in probe-rs.
    pub const fn chip(self) -> &'static str {
        match self {
            BoardName::WeactF405 | BoardName::OlimexH405 | BoardName::FeatherF405 => "STM32F405RGTx",
            BoardName::DiscoveryF407 => "STM32F407VGTx",
            BoardName::NucleoF446 => "STM32F446RETx",
        }
    }

    /// What it is sold as.
    pub const fn product(self) -> &'static str {
        match self {
            BoardName::WeactF405 => "WeAct STM32F405",
            BoardName::OlimexH405 => "Olimex STM32-H405",
            BoardName::FeatherF405 => "Adafruit Feather STM32F405",
            BoardName::DiscoveryF407 => "STM32F407G-DISC1",
            BoardName::NucleoF446 => "NUCLEO-F446RE",
        }
    }

    /// Number of encoders that it can count: the cart's and those of the links.
    pub fn encoders(self) -> usize {
        self.conditions(0).wiring.encoders.len()
    }

    /// Whether it reads absolute sensors, of [`ANGLE_BITS`](Self::ANGLE_BITS).
    pub fn reads_angles(self) -> bool {
        self.conditions(0).wiring.angle_bus.is_some()
    }

    /// Bits of the absolute sensors that a board reads, AS5047D or AS5047P.
    pub const ANGLE_BITS: u32 = 14;

    /// Bits of the converter that reads a potentiometer.
    pub const WIPER_BITS: u32 = 12;

    /// Most step pulses in a tick: its timer counts them with 8 bits.
    pub const PULSES: u32 = 256;

    /// Most step pulses in a second, with a tick of `tick_s` (s). A tick may have a pulse more than its speed needs,
    /// because positions are rounded; and a driver needs 2.5 µs from a change of direction to a pulse.
    pub fn most_pulses_hz(self, tick_s: f64) -> f64 {
        (f64::from(Self::PULSES - 1) / tick_s).min(200e3)
    }

    /// Shortest and longest tick that it can make (s).
    pub const fn tick_s(self) -> [f64; 2] {
        [0.000_12, 0.033]
    }

    /// Conditions of the virtual board, at typical values; `seed` determines everything random.
    pub fn conditions(self, seed: u64) -> Conditions {
        let mut conditions = Conditions::f405(seed);
        match self {
            BoardName::WeactF405 | BoardName::OlimexH405 => {}
            BoardName::FeatherF405 => {
                conditions.wiring = BoardWiring::feather();
                conditions.crystal.hz = 12_000_000;
            }
            BoardName::DiscoveryF407 => (conditions.chip, conditions.chip_v) = (Chip::F407, 3.0),
            BoardName::NucleoF446 => {
                conditions.chip = Chip::F446;
                conditions.crystal.is_clock_input = true;
            }
        }
        conditions
    }
}

/// A name that no board has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no board has this name; choose one of {}", BoardName::ALL.map(BoardName::name).join(", "))]
pub struct NoBoard;

impl std::str::FromStr for BoardName {
    type Err = NoBoard;

    fn from_str(name: &str) -> Result<Self, NoBoard> {
        BoardName::ALL.into_iter().find(|board| board.name() == name).ok_or(NoBoard)
    }
}

impl std::fmt::Display for BoardName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}
