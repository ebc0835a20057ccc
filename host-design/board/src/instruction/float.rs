//! Floating-point operations.

/// Floating point: two operands, one result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Float2 {
    Add,
    Sub,
    Mul,
    NegMul,
    Div,
    /// d + n·m, rounded twice.
    Mla,
    /// d − n·m
    Mls,
    /// −d − n·m
    NegMla,
    /// −d + n·m
    NegMls,
    /// d + n·m, rounded once.
    Fma,
    /// d − n·m
    Fms,
    /// −d − n·m
    NegFma,
    /// −d + n·m
    NegFms,
}

/// Floating point: one operand, one result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Float1 {
    Move,
    Abs,
    Neg,
    Sqrt,
    /// From an integer.
    FromSigned,
    FromUnsigned,
    /// To an integer, rounded towards zero or as FPSCR says.
    ToSigned {
        to_zero: bool,
    },
    ToUnsigned {
        to_zero: bool,
    },
    /// From a fixed-point number in the same register.
    FromFixed {
        signed: bool,
        half: bool,
        fraction: u8,
    },
    /// To a fixed-point number in the same register.
    ToFixed {
        signed: bool,
        half: bool,
        fraction: u8,
    },
    /// From the lower or upper half, a number of 16 bits.
    FromHalf {
        top: bool,
    },
    /// To the lower or upper half.
    ToHalf {
        top: bool,
    },
}
