//! The gain table of this machine, for the image and for the host.

#![no_std]

pub mod gains;
