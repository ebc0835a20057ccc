//! The [conversation](upright_closed_loop::conversation) of a person at the keyboard with a running firmware.
//!
//! [`view`] draws it, [`SerialLine`] is a serial device or a TCP connection.
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
pub mod view;

pub use command::action;
pub use line::{OpenError, SerialLine, now};
pub use upright_closed_loop::conversation::{
    BadCommand, Ended, Monitor, MonitorAction, record, request, words,
};
