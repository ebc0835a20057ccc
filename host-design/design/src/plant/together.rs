//! Several chains that advance together, one in each lane of a vector.

// The indices are those of the equations, and all are below N.
#![allow(clippy::needless_range_loop)]

use nalgebra::{ArrayStorage, SMatrix, SVector};
use pulp::{Arch, Simd, WithSimd};
use upright::plant::ChainState;
use upright::table::{ChainModel, Turning};

use super::lanes::Lanes;
use super::rk4::rk4;
use super::{ChainPlant, PlantError};
use crate::rig;

/// Number of chains that advance together. SIMD vectors of today's processors hold 2 to 8 `f64`.
pub const LANES: usize = 8;

/// One number for each chain.
type LaneRow = [f64; LANES];

/// [`LANES`] chains with the same number of links. Each gives the same bits as a
/// [`ChainSimulation`](super::ChainSimulation) with the same inputs. Every method panics on a slice of the wrong
/// length.
pub trait ChainLanes: Send {
    /// Puts `chain` into a lane, in the state `state` (`x, ẋ, θ_1, θ̇_1, …`).
    ///
    /// # Errors
    /// [`PlantError::WrongLinks`] for a chain with another number of links.
    fn place(&mut self, lane: usize, chain: &rig::Chain, state: &[f64]) -> Result<(), PlantError>;

    /// Empties a lane. It is no longer computed, unless another lane of the same vector is in use.
    fn clear(&mut self, lane: usize);

    /// Sets the force on the cart (N) and the joint torques (N·m) of a lane; they stay until the next call.
    fn push(&mut self, lane: usize, force: f64, torques: &[f64]);

    /// Advances all chains by `dt` (s) in `substeps` equal steps.
    fn advance(&mut self, dt: f64, substeps: usize);

    /// Copies the state of a lane into `state`.
    fn write_state(&self, lane: usize, state: &mut [f64]);
}

/// Empty lanes for chains of `links` links. `None` unless there are 3 to 5 links: only these are simulated in
/// thousands of runs, so only these are compiled for vectors.
pub fn chain_lanes(links: usize) -> Option<Box<dyn ChainLanes>> {
    match links {
        3 => Some(Box::new(Together::<3>::empty(Arch::new()))),
        4 => Some(Box::new(Together::<4>::empty(Arch::new()))),
        5 => Some(Box::new(Together::<5>::empty(Arch::new()))),
        _ => None,
    }
}

struct Together<const N: usize> {
    processor: Arch,
    occupied: [bool; LANES],
    chains: Chains<N>,
}

/// [`ChainModel`], state and inputs of each chain.
struct Chains<const N: usize> {
    inverse_mass: LaneRow,
    a: [LaneRow; N],
    weight: [LaneRow; N],
    b: [[LaneRow; N]; N],
    b_reduced: [[LaneRow; N]; N],
    reaction: [LaneRow; N],
    cart_friction: LaneRow,
    joint_frictions: [LaneRow; N],
    turning: [[LaneRow; N]; N],
    turning_reaction: LaneRow,
    /// Whether any of the chains is on an arm.
    turns: bool,
    state: ChainState<N, LaneRow>,
    force: LaneRow,
    torques: [LaneRow; N],
}

impl<const N: usize> Together<N> {
    fn empty(processor: Arch) -> Self {
        let row = [0.0; LANES];
        Self {
            processor,
            occupied: [false; LANES],
            chains: Chains {
                inverse_mass: row,
                a: [row; N],
                weight: [row; N],
                b: [[row; N]; N],
                b_reduced: [[row; N]; N],
                reaction: [row; N],
                cart_friction: row,
                joint_frictions: [row; N],
                turning: [[row; N]; N],
                turning_reaction: row,
                turns: false,
                state: ChainState { x: row, xdot: row, phi: [row; N], phidot: [row; N] },
                force: row,
                torques: [row; N],
            },
        }
    }
}

impl<const N: usize> Chains<N> {
    fn set_state(&mut self, lane: usize, state: &ChainState<N, f64>) {
        (self.state.x[lane], self.state.xdot[lane]) = (state.x, state.xdot);
        for j in 0..N {
            self.state.phi[j][lane] = state.phi[j];
            self.state.phidot[j][lane] = state.phidot[j];
        }
    }

    fn set_model(&mut self, lane: usize, model: &ChainModel<N, f64>) {
        self.inverse_mass[lane] = model.inverse_mass;
        self.cart_friction[lane] = model.cart_friction;
        self.turning_reaction[lane] = model.turning.as_ref().map_or(0.0, |turning| turning.reaction);
        self.turns |= model.turning.is_some();
        for j in 0..N {
            self.a[j][lane] = model.a[j];
            self.weight[j][lane] = model.weight[j];
            self.reaction[j][lane] = model.reaction[j];
            self.joint_frictions[j][lane] = model.joint_frictions[j];
            for k in 0..N {
                // By columns, as the matrix is stored.
                self.b[j][k][lane] = model.b[(k, j)];
                self.b_reduced[j][k][lane] = model.b_reduced[(k, j)];
                self.turning[j][k][lane] = model.turning.as_ref().map_or(0.0, |turning| turning.beta[(k, j)]);
            }
        }
    }
}

impl<const N: usize> ChainLanes for Together<N> {
    fn place(&mut self, lane: usize, chain: &rig::Chain, state: &[f64]) -> Result<(), PlantError> {
        assert_eq!(state.len(), 2 * N + 2, "a chain of {N} links has 2n + 2 states");
        let plant = ChainPlant::<N>::of(chain)?;
        // Unoccupied lanes get the model, too: a lane is computed with its vector and must have a mass.
        for other in (0..LANES).filter(|&other| other == lane || !self.occupied[other]) {
            self.chains.set_model(other, plant.model());
        }
        self.chains.set_state(lane, &ChainState::from_relative(state));
        self.occupied[lane] = true;
        Ok(())
    }

    fn clear(&mut self, lane: usize) {
        // Upright at rest without force: it stays there, whatever its masses are.
        self.chains.set_state(lane, &ChainState::upright());
        self.push(lane, 0.0, &[0.0; N]);
        self.occupied[lane] = false;
    }

    fn push(&mut self, lane: usize, force: f64, torques: &[f64]) {
        assert_eq!(torques.len(), N, "a chain of {N} links has {N} joint torques");
        self.chains.force[lane] = force;
        for j in 0..N {
            self.chains.torques[j][lane] = torques[j];
        }
    }

    fn advance(&mut self, dt: f64, substeps: usize) {
        let substeps = substeps.max(1);
        let (chains, occupied) = (&mut self.chains, &self.occupied);
        self.processor.dispatch(Advance { chains, occupied, dt: dt / substeps as f64, substeps });
    }

    fn write_state(&self, lane: usize, state: &mut [f64]) {
        assert_eq!(state.len(), 2 * N + 2, "a chain of {N} links has 2n + 2 states");
        let rows = &self.chains.state;
        let mut here = ChainState::<N, f64>::upright();
        (here.x, here.xdot) = (rows.x[lane], rows.xdot[lane]);
        for j in 0..N {
            (here.phi[j], here.phidot[j]) = (rows.phi[j][lane], rows.phidot[j][lane]);
        }
        here.write_relative(state);
    }
}

/// Steps of all chains, compiled for each vector width; the one for this processor is chosen at run time.
struct Advance<'a, const N: usize> {
    chains: &'a mut Chains<N>,
    occupied: &'a [bool; LANES],
    dt: f64,
    substeps: usize,
}

impl<const N: usize> WithSimd for Advance<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { chains, occupied, dt, substeps } = self;
        let mut first = 0;
        while first + S::F64_LANES <= LANES {
            let mut is_used = false;
            for lane in first..first + S::F64_LANES {
                is_used |= occupied[lane];
            }
            if is_used {
                chains.advance(simd, first, dt, substeps);
            }
            first += S::F64_LANES;
        }
    }
}

impl<const N: usize> Chains<N> {
    /// Advances the chains of one vector, whose first lane is `first`.
    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, first: usize, dt: f64, substeps: usize) {
        let zero = Lanes::splat(simd, 0.0);
        let mut model: ChainModel<N, Lanes<S>> = ChainModel {
            inverse_mass: Lanes::load(simd, &self.inverse_mass, first),
            a: SVector::from_array_storage(ArrayStorage([[zero; N]])),
            weight: SVector::from_array_storage(ArrayStorage([[zero; N]])),
            b: SMatrix::from_array_storage(ArrayStorage([[zero; N]; N])),
            b_reduced: SMatrix::from_array_storage(ArrayStorage([[zero; N]; N])),
            reaction: SVector::from_array_storage(ArrayStorage([[zero; N]])),
            cart_friction: Lanes::load(simd, &self.cart_friction, first),
            joint_frictions: SVector::from_array_storage(ArrayStorage([[zero; N]])),
            turning: None,
        };
        if self.turns {
            let mut turning = Turning {
                beta: SMatrix::from_array_storage(ArrayStorage([[zero; N]; N])),
                reaction: Lanes::load(simd, &self.turning_reaction, first),
            };
            for j in 0..N {
                for k in 0..N {
                    turning.beta.data.0[j][k] = Lanes::load(simd, &self.turning[j][k], first);
                }
            }
            model.turning = Some(turning);
        }
        let mut state = ChainState { x: zero, xdot: zero, phi: [zero; N], phidot: [zero; N] };
        let mut torques = [zero; N];
        for j in 0..N {
            model.a.data.0[0][j] = Lanes::load(simd, &self.a[j], first);
            model.weight.data.0[0][j] = Lanes::load(simd, &self.weight[j], first);
            model.reaction.data.0[0][j] = Lanes::load(simd, &self.reaction[j], first);
            model.joint_frictions.data.0[0][j] = Lanes::load(simd, &self.joint_frictions[j], first);
            for k in 0..N {
                model.b.data.0[j][k] = Lanes::load(simd, &self.b[j][k], first);
                model.b_reduced.data.0[j][k] = Lanes::load(simd, &self.b_reduced[j][k], first);
            }
            state.phi[j] = Lanes::load(simd, &self.state.phi[j], first);
            state.phidot[j] = Lanes::load(simd, &self.state.phidot[j], first);
            torques[j] = Lanes::load(simd, &self.torques[j], first);
        }
        state.x = Lanes::load(simd, &self.state.x, first);
        state.xdot = Lanes::load(simd, &self.state.xdot, first);
        let force = Lanes::load(simd, &self.force, first);
        for _ in 0..substeps {
            state = rk4(
                &state,
                dt,
                #[inline(always)]
                |at, _| model.derivative_inline(at, force, &torques),
            );
        }
        state.x.store(&mut self.state.x, first);
        state.xdot.store(&mut self.state.xdot, first);
        for j in 0..N {
            state.phi[j].store(&mut self.state.phi[j], first);
            state.phidot[j].store(&mut self.state.phidot[j], first);
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use std::path::Path;

    use pulp::x86::{V3, V4};

    use super::*;
    use crate::plant::chain_plant;
    use crate::rig::{Base, CartInput, Chain, Rig};

    #[test]
    fn every_kind_of_vector_that_this_processor_has_gives_the_bits_of_the_plant() {
        let rig = Rig::from_path(Path::new("../../rigs/quadruple-paper.toml")).unwrap();
        let cart = rig.chain().unwrap();
        let mut arm = Chain { base: Base::Arm, ..cart.clone() };
        arm.links.iter_mut().for_each(|link| link.radius_m = 0.1);
        let moved = Chain { input: CartInput::Acceleration, ..arm.clone() };
        // Arms and carts in one vector, too.
        let chain = |lane: usize| {
            if lane < 3 {
                &arm
            } else if lane == 4 {
                &moved
            } else {
                cart
            }
        };
        let start = |lane: usize| [0.1, -0.2, 0.3 * lane as f64, 3.0, -0.3, 1e-3, 2.0, -9.0, 0.0, 0.5];
        let wide = [V3::try_new().map(Arch::V3), V4::try_new().map(Arch::V4)];
        for processor in [Arch::Scalar].into_iter().chain(wide.into_iter().flatten()) {
            let mut lanes = Together::<4>::empty(processor);
            for lane in 0..LANES {
                lanes.place(lane, chain(lane), &start(lane)).unwrap();
                lanes.push(lane, lane as f64 - 3.0, &[1e-3, -2e-3, 0.0, 1e-4]);
            }
            lanes.advance(1e-2, 20);
            for lane in 0..LANES {
                let mut plant = chain_plant(chain(lane)).unwrap();
                plant.set_state(&start(lane));
                plant.advance(lane as f64 - 3.0, &[1e-3, -2e-3, 0.0, 1e-4], 1e-2, 20);
                let (mut expected, mut found) = ([0.0; 10], [0.0; 10]);
                plant.write_state(&mut expected);
                lanes.write_state(lane, &mut found);
                assert_eq!(expected.map(f64::to_bits), found.map(f64::to_bits), "{processor:?}, lane {lane}");
                // Negative control: another lane has other bits.
                lanes.write_state((lane + 1) % LANES, &mut found);
                assert_ne!(expected.map(f64::to_bits), found.map(f64::to_bits), "{processor:?}, lane {lane}");
            }
        }
    }
}
