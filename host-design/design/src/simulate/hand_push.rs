//! A hand that pushes the rig.

use crate::plant::torques_of_force;
use crate::rig::Chain;

/// A horizontal push: a force that is constant for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandPush {
    /// What is pushed: 0: the cart, or the end of the arm; 1: the first link …
    pub body: usize,
    /// Where on the link: 0 at its joint, 1 at its end.
    pub along: f64,
    /// Force, positive along +x (N).
    pub force_n: f64,
    /// Begin (s).
    pub from_s: f64,
    /// Duration (s); at least the tick in which it begins.
    pub duration_s: f64,
}

/// Times that differ by less are the same (s).
const SAME_S: f64 = 1e-9;

impl HandPush {
    /// The force on the cart (N), or the torque on the arm (N·m), and the torques at the joints (N·m) in the tick that
    /// begins at `t` (s) in `state`; none before and after the push.
    pub fn in_tick(&self, t: f64, chain: &Chain, state: &[f64]) -> Option<(f64, Vec<f64>)> {
        let since = t - self.from_s;
        let pushes = since > -SAME_S && since < self.duration_s - SAME_S;
        let arm = |(link, length_m): (usize, f64)| match link + 1 {
            number if number < self.body => length_m,
            number if number == self.body => length_m * self.along,
            _ => 0.0,
        };
        let arms_m = || chain.links.iter().map(|link| link.length_m).enumerate().map(arm).collect::<Vec<_>>();
        // On an arm, it turns the arm by the lever of the pushed link's plane.
        let lever = chain.radius_m(self.body.saturating_sub(1)).unwrap_or(1.0);
        pushes.then(|| (self.force_n * lever, torques_of_force(&arms_m(), [self.force_n, 0.0], state)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;

    #[test]
    fn a_push_turns_the_joints_below_it_and_lasts_as_long_as_it_says() {
        let rig = Rig::from_path("../../rigs/double-quanser-dbpen.toml".as_ref()).unwrap();
        let chain = rig.chain().unwrap();
        let [first, second] = [chain.links[0].length_m, chain.links[1].length_m];
        let push = HandPush { body: 2, along: 0.5, force_n: 3.0, from_s: 0.1, duration_s: 0.05 };
        let upright = [0.0; 6];
        let acts = |push: &HandPush, t: f64| push.in_tick(t, chain, &upright);
        let (force_n, torques_n_m) = acts(&push, 0.1).unwrap();
        assert_eq!(force_n, 3.0);
        let levers = [first + 0.5 * second, 0.5 * second];
        assert!(torques_n_m.iter().zip(levers).all(|(torque, lever)| (torque + 3.0 * lever).abs() < 1e-12));
        assert_eq!(acts(&HandPush { body: 0, ..push }, 0.1), Some((3.0, vec![0.0; 2])));
        assert!(acts(&push, 0.149).is_some());
        assert!(acts(&push, 0.099).is_none() && acts(&push, 0.15).is_none());
    }
}
