#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! | module | from | to |
//! |---|---|---|
//! | [`client`] | bytes of a serial line | commands with their answers, telemetry, logs |
//! | [`conversation`] | what a person asks for, telemetry | requests with their answers, in words |
//! | [`harness`] | a target and a scenario | a run of the whole firmware, from power-up on |
//! | [`defects`] | a kind of defect | changed inputs and outputs of the firmware, and the outcome it must have |

#![forbid(unsafe_code)]

pub mod client;
pub mod conversation;
pub mod defects;
pub mod harness;
