//! In what the chips differ.

#[cfg(not(rp2350))]
mod rp2040;
#[cfg(rp2350)]
mod rp2350;

#[cfg(not(rp2350))]
pub(crate) use rp2040::*;
#[cfg(rp2350)]
pub(crate) use rp2350::*;
