//! The conversation of a person at the keyboard with a running firmware, through the host's
//! [client](upright_design::client).
//!
//! [`Monitor`] holds the state and knows neither terminal nor line: bytes and keys go in, bytes come out. [`view`]
//! draws it, [`SerialLine`] is a serial device or a TCP connection, [`record`] writes telemetry.
//!
//! ```
//! use upright::protocol::message::Request;
//! use upright_tool::monitor::request;
//!
//! assert_eq!(request("disarm")?, Request::Disarm);
//! assert!(request("dissarm").is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod command;
mod line;
mod model;
pub mod record;
pub mod view;
pub mod words;

pub use command::{BadCommand, MonitorAction, action, request};
pub use line::{OpenError, SerialLine, now};
pub use model::{Ended, Monitor};
