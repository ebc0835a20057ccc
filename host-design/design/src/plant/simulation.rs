//! Simulation of a plant of any size behind one object-safe trait.

use super::rk4::rk4;
use super::{Actuation, ChainPlant, Energy, PlantError, WideChainState, integration_steps};
use crate::rig;

/// A plant that can be simulated.
///
/// A chain's states are `x, ẋ, θ_1, θ̇_1, …` with relative angles; a linear model's states are in the order of its
/// matrices. A slice of the wrong length is a bug in the caller: every method that takes a slice panics on it.
pub trait Plant: Send {
    /// Number of links; 0 for a linear model.
    fn links(&self) -> usize;

    /// Number of states.
    fn states(&self) -> usize;

    /// Number of disturbance inputs: the n joint torques of a chain, the noise columns of a linear model.
    fn disturbances(&self) -> usize;

    /// Copies the state into `state` ([`states`](Self::states) entries).
    fn write_state(&self, state: &mut [f64]);

    /// Sets the state ([`states`](Self::states) entries).
    fn set_state(&mut self, state: &[f64]);

    /// Writes the rate of change of `state` under `force` (N) and `disturbances` (joint torques in N·m) into `rate`.
    /// Where the drive imposes the cart's acceleration, that takes the place of the force (m/s²), also in
    /// [`advance`](Self::advance).
    /// Neither uses nor changes the plant's own state.
    fn rate(&self, state: &[f64], force: f64, disturbances: &[f64], rate: &mut [f64]);

    /// Advances the plant by `dt` (s) in `substeps` equal steps (0 counts as 1) with `force` (N) and `disturbances`
    /// (joint torques in N·m) held constant.
    fn advance(&mut self, force: f64, disturbances: &[f64], dt: f64, substeps: usize);

    /// As [`advance`](Self::advance), with a force that changes within each step, in
    /// [`steps`](Self::steps) steps.
    fn advance_with(&mut self, actuation: &dyn Actuation, disturbances: &[f64], dt: f64, substeps: usize);

    /// Number of integration steps in `dt` (s), at least `substeps`, that follow a motor with this damping (N·s/m).
    fn steps(&self, damping_n_s_per_m: f64, dt: f64, substeps: usize) -> usize;

    /// Makes the cart's speed jump (m/s), and the links' rates with it: as by an impulse on the cart. A linear model
    /// has no cart, and stays as it is.
    fn set_cart_speed(&mut self, _speed: f64) {}

    /// Mechanical energy (J); none for a linear model.
    fn energy(&self) -> Option<Energy>;

    /// Speed of the motor, converted to speed of the cart (m/s), if a belt or backlash between them makes the two
    /// differ.
    fn motor_speed(&self) -> Option<f64> {
        None
    }
}

/// N links on a cart with their current state.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainSimulation<const N: usize> {
    /// The equations of motion.
    plant: ChainPlant<N>,
    /// The current state, in absolute angles.
    state: WideChainState<N>,
    /// Largest acceleration of the cart per force (1/kg).
    mobility: f64,
}

impl<const N: usize> ChainSimulation<N> {
    /// The chain at rest with every link upright.
    fn upright(plant: ChainPlant<N>) -> Self {
        let state = WideChainState::upright();
        // The cart is easiest to move where all links are vertical: then none has to be lifted.
        let mobility = plant.derivative(&state, 1.0, &[0.0; N]).xdot;
        Self { plant, state, mobility }
    }

    fn check_length(&self, state: &[f64]) {
        assert_eq!(state.len(), self.states(), "a chain of {N} links has 2n + 2 states");
    }
}

fn joint_torques<const N: usize>(disturbances: &[f64]) -> [f64; N] {
    disturbances.try_into().unwrap_or_else(|_| panic!("a chain of {N} links has {N} joint torques"))
}

impl<const N: usize> Plant for ChainSimulation<N> {
    fn links(&self) -> usize {
        N
    }

    fn states(&self) -> usize {
        2 * N + 2
    }

    fn disturbances(&self) -> usize {
        N
    }

    fn write_state(&self, state: &mut [f64]) {
        self.check_length(state);
        self.state.write_relative(state);
    }

    fn set_state(&mut self, state: &[f64]) {
        self.check_length(state);
        self.state = WideChainState::from_relative(state);
    }

    fn rate(&self, state: &[f64], force: f64, disturbances: &[f64], rate: &mut [f64]) {
        self.check_length(state);
        self.check_length(rate);
        // The conversion from absolute to relative angles is linear, so it converts rates as well as states.
        self.plant
            .derivative(&WideChainState::from_relative(state), force, &joint_torques(disturbances))
            .write_relative(rate);
    }

    fn advance(&mut self, force: f64, disturbances: &[f64], dt: f64, substeps: usize) {
        let torques = joint_torques(disturbances);
        let substeps = substeps.max(1);
        let step = dt / substeps as f64;
        for _ in 0..substeps {
            self.state = self.plant.rk4(&self.state, force, &torques, step);
        }
    }

    fn advance_with(&mut self, actuation: &dyn Actuation, disturbances: &[f64], dt: f64, substeps: usize) {
        let torques = joint_torques(disturbances);
        let steps = self.steps(actuation.damping_n_s_per_m(), dt, substeps);
        let step_s = dt / steps as f64;
        for step in 0..steps {
            let inputs = actuation.inputs(step as f64 * step_s, step_s);
            self.state = rk4(&self.state, step_s, |at, node| {
                self.plant.derivative(at, actuation.force_n(inputs[node], at.xdot), &torques)
            });
        }
    }

    fn steps(&self, damping_n_s_per_m: f64, dt: f64, substeps: usize) -> usize {
        integration_steps(damping_n_s_per_m * self.mobility, dt, substeps)
    }

    fn set_cart_speed(&mut self, speed: f64) {
        self.state = self.plant.with_cart_speed(&self.state, speed);
    }

    fn energy(&self) -> Option<Energy> {
        Some(self.plant.energy(&self.state))
    }
}

/// An action that is compiled separately for each number of links.
pub trait WithLinks {
    /// Result of the action.
    type Output;

    /// Runs the action for chains of N links.
    fn run<const N: usize>(self) -> Self::Output;
}

/// Runs `action` with N = `links`.
///
/// # Errors
/// [`PlantError::UnsupportedLinks`] unless there are 1 to [`MAX_LINKS`](rig::MAX_LINKS) links.
pub fn with_links<A: WithLinks>(links: usize, action: A) -> Result<A::Output, PlantError> {
    Ok(match links {
        1 => action.run::<1>(),
        2 => action.run::<2>(),
        3 => action.run::<3>(),
        4 => action.run::<4>(),
        5 => action.run::<5>(),
        6 => action.run::<6>(),
        7 => action.run::<7>(),
        8 => action.run::<8>(),
        9 => action.run::<9>(),
        10 => action.run::<10>(),
        11 => action.run::<11>(),
        12 => action.run::<12>(),
        13 => action.run::<13>(),
        14 => action.run::<14>(),
        links => return Err(PlantError::UnsupportedLinks { links }),
    })
}

/// Creates a simulation of `chain`, at rest with every link upright.
///
/// # Errors
/// [`PlantError::UnsupportedLinks`] unless the chain has 1 to [`MAX_LINKS`](rig::MAX_LINKS) links.
pub fn chain_plant(chain: &rig::Chain) -> Result<Box<dyn Plant>, PlantError> {
    struct Ideal<'a>(&'a rig::Chain);
    impl WithLinks for Ideal<'_> {
        type Output = Result<Box<dyn Plant>, PlantError>;

        fn run<const N: usize>(self) -> Self::Output {
            Ok(Box::new(ChainSimulation::<N>::upright(ChainPlant::of(self.0)?)))
        }
    }
    with_links(chain.links.len(), Ideal(chain))?
}
