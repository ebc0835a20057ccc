//! Images for the microcontroller: built with whatever compiler is there, and looked into.

mod build;

pub use build::{ImageError, Kind, build, build_for};
