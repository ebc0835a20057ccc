//! Sums, differences and products of `f32` for the RP2040: in half of the time that the compiler's functions take,
//! whose symbols are weak, with the same bits. A test runs these very routines and compares them with the host's.

core::arch::global_asm!(include_str!("arithmetic.s"), options(raw));
