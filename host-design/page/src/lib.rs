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
//! | `lesson.rs` | exercises, and how answers to them are marked |
//! | `fingerprint.rs` | checksums of tables and of 100 000 ticks of the firmware, to compare machines |
//! | `twin/` | a rig that a person can pull, change and break |
//! | `exported.rs` | the functions that a browser calls, the only ones with names of their own in the module |

#![deny(unsafe_code)]

mod changes;
mod designed;
#[cfg(target_family = "wasm")]
mod exported;
mod fingerprint;
mod lesson;
mod question;
mod refusal;
mod sketch;
mod survival;
mod trust;
pub mod twin;

pub use fingerprint::{Fingerprint, FingerprintError, PullRounding, TICKS};
pub use lesson::{Exercise, Lesson, TestedAnswers};
pub use question::Desk;
