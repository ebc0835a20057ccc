//! Checks that any input must pass. The fuzzer runs them on inputs of its own, the tests on the committed corpora.

#![forbid(unsafe_code)]

pub mod commands;
pub mod frame;
#[path = "../../src/gains.rs"]
#[allow(dead_code, unreachable_pub, reason = "a table of which not all is needed")]
mod gains;
mod invariants;
#[cfg(feature = "design")]
pub mod log;
#[cfg(feature = "design")]
pub mod rig;
mod simulated_rig;
