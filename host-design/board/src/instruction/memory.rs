//! Accesses to memory.

/// Size and extension of a memory access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    Word,
    Half,
    Byte,
    SignedHalf,
    SignedByte,
}

/// Where a single access goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Addressing {
    /// Base and offset.
    Offset(i32),
    /// Base and offset; the base becomes the address.
    PreIndexed(i16),
    /// Base; the offset is added to it afterwards.
    PostIndexed(i16),
    /// Base and another register, shifted to the left.
    Indexed { register: u8, shift: u8 },
}

impl Unit {
    /// Size of an access.
    #[inline]
    pub(crate) fn bytes(self) -> u32 {
        match self {
            Unit::Word => 4,
            Unit::Half | Unit::SignedHalf => 2,
            Unit::Byte | Unit::SignedByte => 1,
        }
    }
}
