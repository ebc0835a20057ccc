//! The chain with dry friction, air drag, belt and tilted rail.

// The indices are those of the equations, and all are below N.
#![allow(clippy::needless_range_loop)]

use upright::table::Number;

use super::belt::{Belt, Rotor};
use super::bristle::{Bristle, Contact};
use super::parameters::real_chain;
use crate::numerics::{Lu, Matrix};
use crate::plant::{
    Actuation, ChainParameters, ChainPlant, Energy, Plant, PlantError, WideChainState, WithLinks,
    chain_plant, integration_steps, with_links,
};
use crate::rig::{CartInput, Chain, Rig};

/// Largest phase (rad) by which the fastest stuck contact may advance in a step. A Runge–Kutta step then has an error
/// of about 1e-5 of the contact's swing; half of this phase changes the runs less than another seed does.
const LARGEST_PHASE: f64 = 0.25;
/// Number of steps instead of one in which a contact turns round or begins to slide.
const AT_A_KINK: usize = 4;

/// A chain with dry friction, air drag, belt and tilted rail.
///
/// Angles of its state are from the vertical, as in a plant without tilt; internally they are from the rail's normal.
#[derive(Debug, Clone, PartialEq)]
pub struct RealChain<const N: usize> {
    plant: ChainPlant<N>,
    motion: Motion<N>,
    joints: Option<[Bristle; N]>,
    cart: Option<Bristle>,
    /// Deflections of the bristles in the joints (rad), and under the cart (m).
    bent: ([f64; N], f64),
    /// Torque on each link per square of its rate (N·m·s²/rad²), where there is air drag.
    drag: Option<[f64; N]>,
    belt: Option<Belt>,
    slope: Slope<N>,
    longest_step_s: f64,
    /// Largest acceleration of the motor per force (1/kg).
    mobility: f64,
}

/// The moving parts: chain and rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Motion<const N: usize> {
    chain: WideChainState<N>,
    rotor: Rotor,
}

impl<const N: usize> Motion<N> {
    #[inline]
    fn plus(&self, factor: f64, rate: &Self) -> Self {
        Self { chain: self.chain.plus(factor, &rate.chain), rotor: self.rotor.plus(factor, &rate.rotor) }
    }
}

/// Gravity along a rail that rises by `angle` towards +x. With angles from the rail's normal, the potential energy is
/// `g (cos(angle) Σ a_j cos φ_j + sin(angle) (M_t x - Σ a_j sin φ_j))`; the plant has the first part.
#[derive(Debug, Clone, PartialEq)]
struct Slope<const N: usize> {
    angle: f64,
    /// `g sin(angle) M_t` (N).
    cart_n: f64,
    /// `g sin(angle) a_j` (N·m).
    links_n_m: [f64; N],
}

impl<const N: usize> RealChain<N> {
    /// The chain of `rig` with the imperfections of its `[reality]`, at rest with every link upright.
    ///
    /// # Errors
    /// [`PlantError::WrongLinks`] if the chain does not have N links.
    pub fn new(chain: &Chain, rig: &Rig) -> Result<Self, PlantError> {
        let mut real = real_chain(chain, &rig.reality.parameters);
        let angle = rig.reality.sensors.rail_tilt_rad;
        let gravity = real.gravity_m_per_s2;
        real.gravity_m_per_s2 *= libm::cos(angle);
        let belt = real.cart.mass_kg.and_then(|cart_kg| Belt::of(rig, cart_kg));
        if let (Some(belt), Some(cart_kg)) = (&belt, &mut real.cart.mass_kg) {
            *cart_kg -= belt.rotor_kg;
        }
        let parameters = ChainParameters::<f64>::of(&real);
        let along = gravity * libm::sin(angle);
        let total_kg = parameters.total_mass + belt.as_ref().map_or(0.0, |belt| belt.rotor_kg);
        let slope = Slope {
            angle,
            // A drive that imposes the acceleration carries the weight, too.
            cart_n: if real.input == CartInput::Force { along * total_kg } else { 0.0 },
            links_n_m: core::array::from_fn(|j| along * parameters.a[j]),
        };
        let mobility = mobility(&parameters);
        let air_drag = &rig.reality.air_drag.air_drag_n_m_s2_per_rad2;
        let (joints, cart) = bristles(rig, &mobility);
        let mut stiffness_per_mass = 0.0;
        if let Some(joints) = &joints {
            stiffness_per_mass +=
                joints.iter().zip(&mobility[1..]).map(|(b, m)| b.stiffness * m).sum::<f64>();
        }
        stiffness_per_mass += cart.map_or(0.0, |bristle| bristle.stiffness * mobility[0]);
        if let Some(belt) = &belt {
            stiffness_per_mass += belt.stiffness * (mobility[0] + 1.0 / belt.rotor_kg);
        }
        let of_motor = belt.as_ref().map_or(mobility[0], |belt| 1.0 / belt.rotor_kg);
        let rotor = Rotor { position: 0.0, speed: 0.0 };
        let mut machine = Self {
            plant: ChainPlant::new(&parameters)?,
            motion: Motion { chain: WideChainState::upright(), rotor },
            joints,
            cart,
            bent: ([0.0; N], 0.0),
            drag: air_drag.is_any().then(|| core::array::from_fn(|j| air_drag.of_joint(j))),
            belt,
            slope,
            longest_step_s: LARGEST_PHASE / stiffness_per_mass.sqrt(),
            mobility: of_motor,
        };
        machine.set_state(&vec![0.0; 2 * N + 2]);
        Ok(machine)
    }

    /// Longest integration step (s) that resolves the fastest contact; infinite without one. The sum of stiffness times
    /// mobility over all contacts bounds the square of the highest natural frequency (the trace bounds the largest
    /// eigenvalue).
    pub fn longest_step_s(&self) -> f64 {
        self.longest_step_s
    }

    /// Rate of change in `at`, reached from `from`, where the bristles were bent as they are stored now.
    #[inline]
    fn derivative(&self, from: &Motion<N>, at: &Motion<N>, force: f64, torques: &[f64; N]) -> Motion<N> {
        let (mut on_cart, mut torques) = (force, *torques);
        let (here, start) = (&at.chain, &from.chain);
        let mut rotor = Rotor { position: at.rotor.speed, speed: 0.0 };
        if let Some(belt) = &self.belt {
            on_cart = belt.force(&at.rotor, here.x, here.xdot);
            rotor.speed = (force - on_cart) / belt.rotor_kg;
        }
        if let Some(bristle) = &self.cart {
            on_cart -= bristle.force(self.bent.1, here.x - start.x, here.xdot);
        }
        if let Some(bristles) = &self.joints {
            let (travel, rate) = (relative(&here.phi, &start.phi), relative(&here.phidot, &[0.0; N]));
            for j in 0..N {
                torques[j] -= bristles[j].force(self.bent.0[j], travel[j], rate[j]);
            }
        }
        if let Some(drag) = &self.drag {
            // Q_j = τ_j - τ_{j+1}.
            let mut above = 0.0;
            for j in (0..N).rev() {
                above += drag[j] * here.phidot[j].abs() * here.phidot[j];
                torques[j] -= above;
            }
        }
        if self.slope.angle != 0.0 {
            on_cart -= self.slope.cart_n;
            let (_, cos) = f64::sines_and_cosines(&here.phi);
            // Q_j = τ_j - τ_{j+1}.
            let mut above = 0.0;
            for j in (0..N).rev() {
                above += self.slope.links_n_m[j] * cos[j];
                torques[j] += above;
            }
        }
        Motion { chain: self.plant.derivative(here, on_cart, &torques), rotor }
    }

    /// One step of the classical Runge–Kutta method. The friction at a stage is a function of the travel since the
    /// start of the step, so that the bristles need no stages of their own.
    ///
    /// `force` (N) is a function of the stage's node (0: beginning of the step, 1: middle, 2: end) and of the speed of
    /// the motor.
    #[inline]
    fn step(&mut self, force: impl Fn(usize, f64) -> f64, torques: &[f64; N], dt: f64) {
        let from = self.motion;
        let rate = |at: &Motion<N>, node: usize| {
            let speed = if self.belt.is_some() { at.rotor.speed } else { at.chain.xdot };
            self.derivative(&from, at, force(node, speed), torques)
        };
        let k1 = rate(&from, 0);
        let k2 = rate(&from.plus(0.5 * dt, &k1), 1);
        let k3 = rate(&from.plus(0.5 * dt, &k2), 1);
        let k4 = rate(&from.plus(dt, &k3), 2);
        let sum = k1.plus(2.0, &k2).plus(2.0, &k3).plus(1.0, &k4);
        let to = from.plus(dt / 6.0, &sum);
        if let Some(bristle) = &self.cart {
            self.bent.1 = bristle.deflection(self.bent.1, to.chain.x - from.chain.x, to.chain.xdot);
        }
        if let Some(bristles) = &self.joints {
            let travel = relative(&to.chain.phi, &from.chain.phi);
            let rate = relative(&to.chain.phidot, &[0.0; N]);
            for j in 0..N {
                self.bent.0[j] = bristles[j].deflection(self.bent.0[j], travel[j], rate[j]);
            }
        }
        self.motion = to;
    }

    /// Integrates over `dt` (s) in `steps` steps. The friction has a kink where a contact turns round, or begins to
    /// slide: a step in which that happens is done again in [`AT_A_KINK`] shorter ones.
    #[inline]
    fn integrate(
        &mut self,
        steps: usize,
        dt: f64,
        disturbances: &[f64],
        inputs: impl Fn(f64, f64) -> [f64; 3],
        force: impl Fn(f64, f64) -> f64,
    ) {
        assert_eq!(disturbances.len(), N, "a chain of {N} links has {N} joint torques");
        let torques = core::array::from_fn(|j| disturbances[j]);
        let step_s = dt / steps as f64;
        for step in 0..steps {
            let (from, bent) = (self.motion, self.bent);
            let advance = |machine: &mut Self, from_s: f64, step_s: f64| {
                let inputs = inputs(from_s, step_s);
                machine.step(|node, speed| force(inputs[node], speed), &torques, step_s);
            };
            let from_s = step as f64 * step_s;
            advance(self, from_s, step_s);
            if !self.has_passed_a_kink(&from, &bent) {
                continue;
            }
            (self.motion, self.bent) = (from, bent);
            let piece_s = step_s / AT_A_KINK as f64;
            for piece in 0..AT_A_KINK {
                advance(self, from_s + piece as f64 * piece_s, piece_s);
            }
        }
    }

    /// Whether a contact has turned round or begun to slide since the state `from`, where the bristles were `bent`.
    #[inline]
    fn has_passed_a_kink(&self, from: &Motion<N>, bent: &([f64; N], f64)) -> bool {
        let cart = self.cart.as_ref().is_some_and(|bristle| {
            let speeds = [from.chain.xdot, self.motion.chain.xdot];
            bristle.has_passed_a_kink([bent.1, self.bent.1], speeds)
        });
        cart || self.joints.as_ref().is_some_and(|joints| {
            let before = relative(&from.chain.phidot, &[0.0; N]);
            let now = relative(&self.motion.chain.phidot, &[0.0; N]);
            (0..N).any(|j| joints[j].has_passed_a_kink([bent.0[j], self.bent.0[j]], [before[j], now[j]]))
        })
    }
}

/// Change of each joint's angle when the links turn from the absolute angles `from` to `to`.
#[inline]
fn relative<const N: usize>(to: &[f64; N], from: &[f64; N]) -> [f64; N] {
    core::array::from_fn(|j| {
        let below = if j == 0 { 0.0 } else { to[j - 1] - from[j - 1] };
        (to[j] - from[j]) - below
    })
}

/// Acceleration of the cart per force on it, and of each joint per torque in it, with the links in line and everything
/// else free (1/kg, 1/(kg·m²)): `eᵀ M⁻¹ e`.
fn mobility(parameters: &ChainParameters<f64>) -> Vec<f64> {
    let n = parameters.links();
    let mass = parameters.mass_matrix(&vec![0.0; n]);
    // It is positive definite, but may be so close to singular that this fails.
    let Ok(lu) = Lu::new(&mass) else { return (0..=n).map(|i| 1.0 / mass[(i, i)]).collect() };
    let of = |contact: usize| {
        let along = Matrix::from_fn(n + 1, 1, |row, _| match row {
            _ if row == contact => 1.0,
            _ if row + 1 == contact && contact > 1 => -1.0,
            _ => 0.0,
        });
        let moved = lu.solve(&along);
        (0..=n).map(|row| along[(row, 0)] * moved[(row, 0)]).sum()
    };
    (0..=n).map(of).collect()
}

/// The bristles in the joints and under the cart, where there is friction.
fn bristles<const N: usize>(rig: &Rig, mobility: &[f64]) -> (Option<[Bristle; N]>, Option<Bristle>) {
    let friction = &rig.reality.friction;
    let contact = |coulomb: f64, stribeck: f64, presliding: f64, mobility: f64| {
        Bristle::new(&Contact {
            coulomb,
            breakaway_percent: friction.breakaway_percent,
            stribeck,
            presliding,
            mobility,
            law: rig.reality.friction_law,
        })
    };
    let joint = |j: usize| {
        let coulomb = friction.joint_friction_n_m.of_joint(j);
        contact(coulomb, friction.stribeck_rad_per_s, friction.presliding_rad.of_joint(j), mobility[j + 1])
    };
    let joints = friction.joint_friction_n_m.is_any().then(|| core::array::from_fn(joint));
    let cart = (friction.cart_friction_n > 0.0).then(|| {
        contact(friction.cart_friction_n, friction.stribeck_m_per_s, friction.presliding_m, mobility[0])
    });
    (joints, cart)
}

impl<const N: usize> Plant for RealChain<N> {
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
        assert_eq!(state.len(), self.states(), "a chain of {N} links has 2n + 2 states");
        self.motion.chain.write_relative(state);
        state[2] += self.slope.angle;
    }

    /// Also relaxes the bristles and centres the rotor in its backlash.
    fn set_state(&mut self, state: &[f64]) {
        assert_eq!(state.len(), self.states(), "a chain of {N} links has 2n + 2 states");
        let mut chain = WideChainState::from_relative(state);
        for phi in &mut chain.phi {
            *phi -= self.slope.angle;
        }
        self.motion = Motion { chain, rotor: Rotor { position: chain.x, speed: chain.xdot } };
        self.bent = ([0.0; N], 0.0);
    }

    /// Uses the bristles as they are bent now.
    fn rate(&self, state: &[f64], force: f64, disturbances: &[f64], rate: &mut [f64]) {
        let mut other = self.clone();
        other.set_state(state);
        other.bent = self.bent;
        let torques = core::array::from_fn(|j| disturbances[j]);
        other.derivative(&other.motion, &other.motion, force, &torques).chain.write_relative(rate);
    }

    fn advance(&mut self, force: f64, disturbances: &[f64], dt: f64, substeps: usize) {
        let steps = (dt / self.longest_step_s).ceil().max(substeps.max(1) as f64);
        self.integrate(steps as usize, dt, disturbances, |_, _| [force; 3], |force, _| force);
    }

    fn advance_with(&mut self, actuation: &dyn Actuation, disturbances: &[f64], dt: f64, substeps: usize) {
        let steps = self.steps(actuation.damping_n_s_per_m(), dt, substeps);
        let inputs = |from_s: f64, step_s: f64| actuation.inputs(from_s, step_s);
        self.integrate(steps, dt, disturbances, inputs, |input, speed| actuation.force_n(input, speed));
    }

    fn steps(&self, damping_n_s_per_m: f64, dt: f64, substeps: usize) -> usize {
        let for_contacts = (dt / self.longest_step_s).ceil() as usize;
        integration_steps(damping_n_s_per_m * self.mobility, dt, substeps.max(for_contacts))
    }

    fn energy(&self) -> Option<Energy> {
        let Motion { chain, rotor } = &self.motion;
        let Energy { mut kinetic, mut potential } = self.plant.energy(chain);
        if let Some(belt) = &self.belt {
            kinetic += 0.5 * belt.rotor_kg * rotor.speed * rotor.speed;
            potential += belt.energy(rotor, chain.x);
        }
        if let Some(bristles) = &self.joints {
            potential += bristles.iter().zip(&self.bent.0).map(|(one, &bent)| one.energy(bent)).sum::<f64>();
        }
        potential += self.cart.map_or(0.0, |bristle| bristle.energy(self.bent.1));
        if self.slope.angle != 0.0 {
            let (sin, _) = f64::sines_and_cosines(&chain.phi);
            potential += self.slope.cart_n * chain.x;
            potential -= self.slope.links_n_m.iter().zip(&sin).map(|(torque, sin)| torque * sin).sum::<f64>();
        }
        Some(Energy { kinetic, potential })
    }

    fn set_cart_speed(&mut self, speed: f64) {
        self.motion.chain = self.plant.with_cart_speed(&self.motion.chain, speed);
    }

    fn motor_speed(&self) -> Option<f64> {
        self.belt.as_ref().map(|_| self.motion.rotor.speed)
    }
}

/// The plant of a rig's chain with its imperfections; that of [`chain_plant`] if none in `[reality]` changes its
/// motion other than through masses, lengths and inertias.
///
/// # Errors
/// [`PlantError::UnsupportedLinks`] unless the chain has 1 to [`MAX_LINKS`](crate::rig::MAX_LINKS) links.
pub fn real_plant(chain: &Chain, rig: &Rig) -> Result<Box<dyn Plant>, PlantError> {
    struct WithReality<'a>(&'a Chain, &'a Rig);
    impl WithLinks for WithReality<'_> {
        type Output = Result<Box<dyn Plant>, PlantError>;

        fn run<const N: usize>(self) -> Self::Output {
            Ok(Box::new(RealChain::<N>::new(self.0, self.1)?))
        }
    }
    match ideal_chain(chain, rig) {
        Some(ideal) => chain_plant(&ideal),
        None => with_links(chain.links.len(), WithReality(chain, rig))?,
    }
}

/// The chain with its real masses and lengths, if nothing else in `[reality]` changes its motion.
pub fn ideal_chain(chain: &Chain, rig: &Rig) -> Option<Chain> {
    let (friction, drive_train) = (&rig.reality.friction, &rig.reality.drive_train);
    let is_ideal = !friction.joint_friction_n_m.is_any()
        && friction.cart_friction_n == 0.0
        && !rig.reality.air_drag.air_drag_n_m_s2_per_rad2.is_any()
        && drive_train.backlash_m == 0.0
        && drive_train.belt_compliance_m_per_n == 0.0
        && rig.reality.sensors.rail_tilt_rad == 0.0;
    is_ideal.then(|| real_chain(chain, &rig.reality.parameters))
}
