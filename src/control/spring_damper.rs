//! Spring and damper on the base, imitated by the motor: they take energy from the rig whatever its masses are.

use crate::control::state_feedback::saturate;

/// A spring that pulls the base to the middle, and a damper, each with a largest force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringDamper {
    /// Stiffness (N/m) and constant of the damper (N s/m).
    pub constants: [f32; 2],
    /// Largest forces of spring and damper (N).
    pub most_n: [f32; 2],
}

impl SpringDamper {
    /// The force on the base (N) at this position (m) and speed (m/s), in addition to `push_n`.
    pub fn force_n(&self, push_n: f32, [position_m, speed_m_per_s]: [f32; 2]) -> f32 {
        let ([stiffness, damping], [spring_n, damper_n]) = (self.constants, self.most_n);
        push_n - saturate(stiffness * position_m, spring_n) - saturate(damping * speed_m_per_s, damper_n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_pull_back_with_no_more_than_their_largest_force() {
        let law = SpringDamper { constants: [4.0, 2.0], most_n: [3.0, 1.0] };
        assert_eq!(law.force_n(0.5, [0.5, 0.25]), 0.5 - 2.0 - 0.5);
        assert_eq!(law.force_n(0.0, [9.0, -9.0]), -3.0 + 1.0);
        // No position or speed is read as none, rather than as a force.
        assert_eq!(law.force_n(0.0, [f32::NAN, 0.25]), -0.5);
    }
}
