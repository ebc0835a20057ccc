//! Dry friction that falls with the speed, from a larger one at rest (R. Stribeck, 1902).

/// Speed of the cart (m/s) and rate of a joint (rad/s) at which half of the excess is left: those of `[reality]`.
pub(crate) const HALF_AT: [f64; 2] = [0.01, 0.1];

/// Factor of the dry friction at `speed`, with the excess at rest and the speed at which half of it is left, and its
/// derivative by the speed.
pub(crate) fn factor(excess: f64, half_at: f64, speed: f64) -> [f64; 2] {
    let ratio = speed / half_at;
    let left = excess / (1.0 + ratio * ratio);
    [1.0 + left, -2.0 * left * ratio / (half_at * (1.0 + ratio * ratio))]
}
