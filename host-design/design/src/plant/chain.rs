//! The nonlinear equations of motion of N links on a cart or an arm, in `f64`.

// The indices are those of the equations, and all are below N.
#![allow(clippy::needless_range_loop)]

use nalgebra::{SMatrix, SVector};
use upright::table::{ChainModel, Number, Turning};

use super::{ChainParameters, PlantError};
use crate::rig::{self, CartInput};

/// State of the chain in absolute angles, in `f64`.
pub type WideChainState<const N: usize> = upright::plant::ChainState<N, f64>;

/// Mechanical energy (J); the potential energy is zero where every centre of mass is level with the first joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Kinetic energy T (J).
    pub kinetic: f64,
    /// Potential energy V (J).
    pub potential: f64,
}

impl Energy {
    /// Kinetic plus potential energy (J).
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential
    }
}

/// Equations of motion of N links on a cart or an arm: those of [`ChainParameters`] with the same symbols, arranged for
/// speed. The firmware's prediction uses the same source code, in `f32`.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainPlant<const N: usize> {
    total_mass: f64,
    model: ChainModel<N, f64>,
}

impl<const N: usize> ChainPlant<N> {
    /// Creates the plant from the constants of its equations.
    ///
    /// # Errors
    /// [`PlantError::WrongLinks`] if the constants are not those of N links.
    pub fn new(parameters: &ChainParameters<f64>) -> Result<Self, PlantError> {
        let (a, b, mt) = (&parameters.a, &parameters.b, parameters.total_mass);
        if a.len() != N {
            return Err(PlantError::WrongLinks { links: a.len(), compiled: N });
        }
        let mut model = ChainModel {
            inverse_mass: 1.0 / mt,
            a: SVector::from_fn(|j, _| a[j]),
            weight: SVector::from_fn(|j, _| parameters.weight[j]),
            b: SMatrix::from_fn(|j, k| b[(j, k)]),
            b_reduced: SMatrix::from_fn(|j, k| b[(j, k)] - a[j] * a[k] / mt),
            reaction: SVector::from_fn(|j, _| a[j]),
            cart_friction: parameters.cart_friction,
            joint_frictions: SVector::from_fn(|j, _| parameters.joint_frictions[j]),
            turning: parameters.turning.as_ref().map(|beta| Turning {
                beta: SMatrix::from_fn(|j, k| beta[(j, k)]),
                reaction: if parameters.input == CartInput::Force { 1.0 } else { 0.0 },
            }),
        };
        if parameters.input == CartInput::Acceleration {
            (model.inverse_mass, model.cart_friction) = (1.0, 0.0);
            (model.b_reduced, model.reaction) = (model.b, SVector::zeros());
        }
        Ok(Self { total_mass: mt, model })
    }

    /// The plant of a rig file's chain.
    ///
    /// # Errors
    /// [`PlantError::WrongLinks`] if the chain does not have N links.
    pub fn of(chain: &rig::Chain) -> Result<Self, PlantError> {
        Self::new(&ChainParameters::of(chain))
    }

    /// The constants of the equations.
    pub fn model(&self) -> &ChainModel<N, f64> {
        &self.model
    }

    /// Rate of change of `state` under the cart's input (N or m/s², along +x) and torques at the joints (N·m): see
    /// [`ChainModel::derivative`].
    #[inline]
    pub fn derivative(&self, state: &WideChainState<N>, force: f64, torques: &[f64; N]) -> WideChainState<N> {
        self.model.derivative(state, force, torques)
    }

    /// `state` after the cart's speed has jumped to `speed` (m/s): the links' rates change by as much as under the same
    /// change of speed in a short time.
    pub fn with_cart_speed(&self, state: &WideChainState<N>, speed: f64) -> WideChainState<N> {
        // Both rates are linear in the input, so that their ratio is that of the jumps.
        let without = self.derivative(state, 0.0, &[0.0; N]);
        let with = self.derivative(state, 1.0, &[0.0; N]);
        let impulse = (speed - state.xdot) / (with.xdot - without.xdot);
        let mut after = *state;
        after.xdot = speed;
        for j in 0..N {
            after.phidot[j] += impulse * (with.phidot[j] - without.phidot[j]);
        }
        after
    }

    /// Mechanical energy in `state`: T and V of [`ChainParameters`].
    pub fn energy(&self, state: &WideChainState<N>) -> Energy {
        let (sin, cos) = f64::sines_and_cosines(&state.phi);
        let (v, w) = (state.xdot, &state.phidot);
        let mut kinetic = 0.5 * self.total_mass * v * v;
        let mut potential = 0.0;
        for j in 0..N {
            potential += self.model.weight[j] * cos[j];
            kinetic -= v * self.model.a[j] * cos[j] * w[j];
            for k in 0..N {
                kinetic += 0.5 * self.model.b[(j, k)] * (cos[j] * cos[k] + sin[j] * sin[k]) * w[j] * w[k];
            }
        }
        if let Some(turning) = &self.model.turning {
            for j in 0..N {
                for k in 0..N {
                    kinetic += 0.5 * turning.beta[(j, k)] * (v * sin[j]) * (v * sin[k]);
                }
            }
        }
        Energy { kinetic, potential }
    }
}
