//! The conversation of a person with a running firmware, through the host's [client](crate::client).
//!
//! [`Monitor`] holds the state and knows neither terminal nor page nor line: bytes and actions go in, bytes come out.
//! [`words`] and [`record`] have telemetry in words, as JSON, and as CSV.
//!
//! ```
//! use upright::protocol::message::Request;
//! use upright_closed_loop::conversation::request;
//!
//! assert_eq!(request("disarm")?, Request::Disarm);
//! assert!(request("dissarm").is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod command;
mod model;
pub mod record;
pub mod words;

pub use command::{BadCommand, MonitorAction, request};
pub use model::{Ended, Monitor};
