//! The part of a tick that has to be fast, compiled for the rig of the gain table.
//!
//! Generic code is compiled where its sizes become known. The image is compiled for size and this library for speed,
//! so what the image calls here is fast, and everything else is small. What several places call, and need not be that
//! fast, is `#[inline(never)]`: one copy each keeps the image small, and its pass over the flash short.

use super::Firmware;
use crate::board::{Inputs, Output};
use crate::gains::{SENSORS, STATES, SwingUp};

/// The firmware for the rig of the gain table.
pub type RigFirmware = Firmware<'static, STATES, SENSORS, SwingUp>;

/// [`Firmware::act`], compiled for speed.
#[inline(never)]
pub fn act<'f>(firmware: &'f mut RigFirmware, inputs: &Inputs<SENSORS>) -> &'f Output {
    firmware.act(inputs)
}

/// [`Firmware::predict`], compiled for speed.
#[inline(never)]
pub fn predict(firmware: &mut RigFirmware) {
    firmware.predict();
}
