//! The one protocol client of the host: numbers, repeats and encodes commands, decodes what the firmware sends, finds
//! the request to each answer, and keeps the firmware's dead-man timer from running out.
//!
//! A [`Session`](crate::harness::Session) talks through it to a firmware in lock step; monitor, commissioning, twin and
//! identification talk through it over a line.

#[allow(clippy::module_inception)] // the file of the type
mod client;
mod request_queue;

pub use client::{AnyTelemetry, AnyTickLog, Client, Mismatch, Received};
pub use request_queue::{PATIENCE, Unanswered, command_frame};
