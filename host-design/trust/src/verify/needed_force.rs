//! The force that a drive needs which imposes the cart's acceleration.

use upright::table::Equilibrium;

use upright_design::plant::{ChainParameters, linearise};
use upright_design::rig::{CartInput, Chain, Rig};

/// What cart and links take of the drive, and what it has.
pub(super) struct NeededForce {
    /// `A` and `B` of the cart's acceleration by state and force.
    row: Vec<f64>,
    per_newton: f64,
    friction_n: f64,
    /// Holding force (N) and corner speed (m/s) of the step motor in `[reality]`.
    motor: Option<[f64; 2]>,
}

impl NeededForce {
    /// None unless the drive imposes the acceleration of a cart whose mass is given.
    pub(super) fn of(rig: &Rig) -> Option<Self> {
        let chain = rig.chain().filter(|chain| chain.cart.mass_kg.is_some())?;
        rig.actuator.pulses()?;
        let pulled = Chain { input: CartInput::Force, ..chain.clone() };
        let model = linearise(&ChainParameters::<f64>::of(&pulled), Equilibrium::UPRIGHT).ok()?;
        let motor = &rig.reality.step_motor;
        Some(Self {
            row: (0..model.a.cols()).map(|column| model.a[(1, column)]).collect(),
            per_newton: model.b[(1, 0)],
            friction_n: rig.reality.friction.cart_friction_n,
            motor: motor
                .holding_force_n
                .map(|holding_n| [holding_n, motor.corner_speed_m_per_s.unwrap_or(f64::INFINITY)]),
        })
    }

    /// The force (N) for this acceleration (m/s²) in this state, by the linear model, and its share of what the motor
    /// has at that speed, if there is one.
    pub(super) fn at(&self, acceleration: f64, state: &[f64]) -> (f64, Option<f64>) {
        let without: f64 = self.row.iter().zip(state).map(|(entry, x)| entry * x).sum();
        let force_n = ((acceleration - without) / self.per_newton).abs() + self.friction_n;
        let share = |[holding_n, corner]: [f64; 2]| force_n / holding_n * (state[1] / corner).hypot(1.0);
        (force_n, self.motor.map(share))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_cart_without_a_lean_needs_its_mass_and_that_of_the_links_times_their_share() {
        let Ok(mut rig) = Rig::from_path(Path::new("../../rigs/single-stepper.toml")) else {
            panic!("no rig")
        };
        assert!(NeededForce::of(&rig).is_none(), "the mass of its cart is not given");
        let chain = rig.chain_mut().unwrap();
        chain.cart.mass_kg = Some(0.3);
        // A uniform link upright resists with a quarter of its mass.
        let [cart_kg, link_kg] = [0.3, chain.links[0].mass_kg];
        rig.reality.friction.cart_friction_n = 0.5;
        let motor = &mut rig.reality.step_motor;
        (motor.holding_force_n, motor.full_step_m, motor.corner_speed_m_per_s) =
            (Some(10.0), Some(2e-4), Some(0.6));
        let (force_n, share) = NeededForce::of(&rig).unwrap().at(2.0, &[0.0, 0.6, 0.0, 0.0]);
        assert!((force_n - 2.0 * (cart_kg + 0.25 * link_kg) - 0.5).abs() < 1e-9, "{force_n}");
        assert!((share.unwrap() - force_n / 10.0 * 2.0f64.sqrt()).abs() < 1e-12);
    }
}
