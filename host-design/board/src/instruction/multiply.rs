//! Multiplications.

/// Multiplications with a result of 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Multiply {
    /// MUL, MLA
    Low,
    /// MLS
    Subtract,
    /// SMULxy, SMLAxy: top halves of the first and second factor.
    Halves { first_top: bool, second_top: bool },
    /// SMULWy, SMLAWy
    WordByHalf { top: bool },
    /// SMUAD, SMLAD
    DualAdd { exchange: bool },
    /// SMUSD, SMLSD
    DualSubtract { exchange: bool },
    /// SMMUL, SMMLA
    High { round: bool },
    /// SMMLS
    HighSubtract { round: bool },
}

/// Multiplications with a result of 64 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LongMultiply {
    /// SMULL
    Signed,
    /// UMULL
    Unsigned,
    /// SMLAL
    SignedAdd,
    /// UMLAL
    UnsignedAdd,
    /// UMAAL
    UnsignedAddTwo,
    /// SMLALxy
    Halves { first_top: bool, second_top: bool },
    /// SMLALD
    DualAdd { exchange: bool },
    /// SMLSLD
    DualSubtract { exchange: bool },
}
