//! The values of a rig file, to predict a recording with them.

use upright_design::rig::Rig;

use crate::parameters::Layout;

/// The values of the file, but with tilt, delay and zeros `p` as identified from this log: a file does not have them.
/// `start` holds the start values.
pub(crate) fn old_values(rig: &Rig, layout: Layout, start: &[f64], p: &[f64]) -> Vec<f64> {
    let mut old = start.to_vec();
    let of_log = [layout.tilt(), layout.delay()];
    for i in of_log.into_iter().chain((0..layout.links).map(|joint| layout.zero(joint))) {
        old[i] = p[i];
    }
    let friction = &rig.reality.friction;
    // The start value of a dry friction may be an assumption that is not in the file.
    old[layout.dry(0)] = friction.cart_friction_n;
    for joint in 0..layout.links {
        old[layout.dry(joint + 1)] = friction.joint_friction_n_m.of_joint(joint);
    }
    old
}
