//! What the firmware and the host say to each other over the serial line, and how it is framed.

pub mod frame;
pub mod link;
pub mod message;
pub mod pins;
pub mod queue;
