#![doc = include_str!("../README.md")]
//!
//! # Files
//!
//! | file | what is in it |
//! |---|---|
//! | `question.rs`, `refusal.rs` | what a page asks, and why there may be no answer |
//! | `sketch.rs`, `designed.rs` | what it shows of a rig, and of its design |
//! | `changes.rs` | changes of its file: another number of links, the sliders that a person finds first |
//! | `survival.rs` | how much a loop stands, in two numbers |
//! | `trust.rs` | the trust report in short form, step by step |
//! | `lab.rs`, `task.rs` | labs: what a class works on, what a step asks for, and how answers are marked |
//! | `hand_in.rs` | what a student hands in, and how it is run again |
//! | `fingerprint.rs` | checksums of tables and of 100 000 ticks of the firmware, to compare machines |
//! | `twin/` | a rig that a person can pull, change and break |
//! | `exported.rs` | the functions that a browser calls, the only ones with names of their own in the module |

#![deny(unsafe_code)]

mod changes;
mod designed;
#[cfg(target_family = "wasm")]
mod exported;
mod fingerprint;
mod hand_in;
mod lab;
mod question;
mod refusal;
mod sketch;
mod survival;
mod task;
mod trust;
pub mod twin;

pub use fingerprint::{Fingerprint, FingerprintError, PullRounding, TICKS};
pub use hand_in::{HandIn, HandInError, HandedStep};
pub use lab::{Lab, LabAnswer, LabStep, TestedAnswers};
pub use question::Desk;
pub use task::{LabQuantity, LabTask, LoopAsks};
