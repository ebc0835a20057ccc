//! From encoder counts to motor duty cycle, once per tick.

pub mod actuator;
pub mod controller;
pub mod encoder;
pub mod friction;
pub mod motion;
pub mod observer;
pub mod state_feedback;
