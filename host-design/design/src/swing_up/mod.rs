//! Swing-up: planned motions from hanging to upright and back, with the gains that follow them.

mod motion;

pub use motion::{Motion, Shape, SwingUp};
