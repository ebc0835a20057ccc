//! Two models of what an instruction costs. The manuals leave open how loads overlap and how far the flash is read
//! ahead, so the true time is expected between the two.

/// How long instructions take. Both follow the table of the Cortex-M4 Technical Reference Manual (DDI 0439, 3.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CoreTiming {
    /// All loads in a row overlap, floating-point results are there at once, and the flash is read ahead in time.
    #[default]
    Quick,
    /// Loads overlap in pairs; an instruction that uses the floating-point result of the one before waits a cycle
    /// (7.2.3); a line of flash takes one cycle more than its wait states, also if the core is faster than what is read
    /// ahead.
    Slow,
}

impl CoreTiming {
    /// Both models.
    pub const ALL: [Self; 2] = [Self::Quick, Self::Slow];

    /// Name in results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Slow => "slow",
        }
    }
}
