//! A drive whose force begins several ticks after its command, or a column of it that is some rows late.
//!
//! The delay is a parameter of the fit, but only from half a tick before to one and a half after that of the file is
//! `u_k + δ (u_{k-1} - u_k)` a force that is late. Beyond, the drive is shifted by whole ticks, and fitted again.

use crate::parameters::Layout;

/// Delays that the model describes, beyond that of the file (ticks).
const DESCRIBED: core::ops::RangeInclusive<f64> = -0.5..=1.5;
/// The one in the middle.
const MIDDLE: f64 = 0.5;
/// Most ticks by which the drive is shifted at a time, and most often that it is.
const MOST_TICKS: f64 = 20.0;
pub(crate) const MOST_SHIFTS: usize = 4;

/// Whole ticks by which the drive has to be shifted, after a fit that found the parameters `p`.
pub(crate) fn ticks(layout: Layout, p: &[f64]) -> i64 {
    let delay = p[layout.delay()];
    if DESCRIBED.contains(&delay) {
        0
    } else {
        (delay - MIDDLE).round().clamp(-MOST_TICKS, MOST_TICKS) as i64
    }
}
