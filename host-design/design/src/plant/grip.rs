//! A force at a point of the rig, as generalised forces.

use super::absolute_angles;

/// The torques at the joints (N·m) of the force `force_n` (along the rail and up, N) on a chain in `state`
/// (`x, ẋ, θ_1, θ̇_1, …`). It acts at the point that is `arms_m[i]` along link i + 1: the whole length of a link below
/// the point, 0 beyond it. The force on the cart is the one along the rail.
///
/// With the point `p`, the generalised force on a coordinate q is `F · ∂p/∂q` (Goldstein, *Classical Mechanics*, §1.4).
/// An absolute angle has `Q_j = τ_j - τ_{j+1}`, so the torques are sums from the last link on.
pub fn torques_of_force(arms_m: &[f64], force_n: [f64; 2], state: &[f64]) -> Vec<f64> {
    let angles: Vec<f64> = absolute_angles(state).collect();
    let (mut torques_n_m, mut beyond) = (vec![0.0; angles.len()], 0.0);
    for link in (0..angles.len()).rev() {
        let (sin, cos) = angles[link].sin_cos();
        beyond += -arms_m[link] * (cos * force_n[0] + sin * force_n[1]);
        torques_n_m[link] = beyond;
    }
    torques_n_m
}
