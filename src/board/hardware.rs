//! The board: the only place that touches registers, and the only one with `unsafe`.
//!
//! A cargo feature chooses which. Each gives the same few names: `set_up` makes a [`Hardware`] for the control task, a
//! `Receiver` for the serial line's interrupt and a `Line` for the background; `stop` is where everything ends.

#![allow(unsafe_code)]

#[cfg(not(any(feature = "in-the-loop", feature = "in-the-loop-usart")))]
mod f4;
mod handlers;
#[cfg(any(feature = "in-the-loop", feature = "in-the-loop-usart"))]
mod in_the_loop;

#[cfg(not(any(feature = "in-the-loop", feature = "in-the-loop-usart")))]
pub(crate) use f4::{CLOCK_HZ, Hardware, Line, Receiver, set_up, stop};
#[cfg(any(feature = "in-the-loop", feature = "in-the-loop-usart"))]
pub(crate) use in_the_loop::{CLOCK_HZ, Hardware, Line, Receiver, set_up, stop};

/// Bytes from the host that may wait.
pub(crate) const BYTES: usize = 128;
