//! Operations and operands of data processing.

/// Whether an instruction sets the flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sets {
    /// It does not.
    Never,
    /// It does.
    Always,
    /// It does, but not in an IT block (most 16-bit forms).
    OutsideIt,
}

/// Data processing with a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Alu {
    And,
    Bic,
    Orr,
    Orn,
    Eor,
    Add,
    Adc,
    Sub,
    Sbc,
    Rsb,
    Mov,
    Mvn,
}

/// Data processing that only sets the flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compare {
    Tst,
    Teq,
    Cmp,
    Cmn,
}

/// Kind of a shift.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shift {
    Lsl,
    Lsr,
    Asr,
    Ror,
    Rrx,
}

/// Second operand of data processing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operand {
    /// A constant, which leaves the carry alone.
    Constant(u32),
    /// A constant whose expansion sets the carry to its top bit.
    Rotated(u32),
    /// A register as it is.
    Register(u8),
    /// A register, shifted by a constant.
    Shifted { register: u8, shift: Shift, amount: u8 },
}

/// Extension of a byte or half-word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extend {
    SignedByte,
    SignedHalf,
    Byte,
    Half,
    SignedBytes,
    Bytes,
}

/// Operations with one source register and one destination register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unary {
    Rev,
    Rev16,
    Revsh,
    Rbit,
    Clz,
}

/// Lanes of a parallel addition or subtraction, and which of them are added or subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ParallelLanes {
    Add16,
    AddSubExchanged,
    SubAddExchanged,
    Sub16,
    Add8,
    Sub8,
}

/// How a parallel addition or subtraction treats results that are out of range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Prefix {
    Signed,
    SignedSaturating,
    SignedHalving,
    Unsigned,
    UnsignedSaturating,
    UnsignedHalving,
}
