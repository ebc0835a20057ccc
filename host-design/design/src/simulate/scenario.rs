//! Scenario of a run: start, set-point, disturbances, sensors.

use upright::table::{Equilibrium, Law};

use super::hand_push::HandPush;
use crate::rig::{PlantDescription, Rig};

/// One run: start, set-point, disturbances, sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Control law.
    pub law: Law,
    /// What the controller measures.
    pub sensing: Sensing,
    /// Duration of the run (s).
    pub duration_s: f64,
    /// State at the start (m, m/s, rad, rad/s …).
    pub start: Vec<f64>,
    /// Set-point from `step_at_s` to `step_until_s` (m); 0 before and after.
    pub step_m: f64,
    /// When the set-point steps (s).
    pub step_at_s: f64,
    /// When it steps back (s).
    pub step_until_s: f64,
    /// Standard deviation of the disturbing force, drawn again in every tick (N).
    pub force_noise_n: f64,
    /// Standard deviation of the disturbing torque at each joint, drawn again in every tick (N·m).
    pub torque_noise_n_m: f64,
    /// Constant disturbing force on the cart (N): a tilted rail, a cable that pulls.
    pub force_offset_n: f64,
    /// A push by hand, in a run of the controller.
    pub push: Option<HandPush>,
    /// Seed of the disturbances.
    pub seed: u64,
    /// Integration steps per tick.
    pub substeps: usize,
    /// Reading of the encoder counters at position 0.
    pub counter_start: u32,
    /// Whether a run of the controller ends where the firmware's limits or its fault detection turn the motor off.
    pub is_supervised: bool,
    /// How a run with the whole firmware begins.
    pub begin: Begin,
    /// Equilibria to which the whole firmware is then told to go, in this order.
    pub goals: Vec<Goal>,
}

/// A command to the firmware to bring the links to an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Time of the command (s).
    pub at_s: f64,
    /// The equilibrium to go to.
    pub to: Equilibrium,
}

/// How a run with the whole firmware begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Begin {
    /// A hand holds the links upright in the state `start` until the firmware balances them.
    ByHand,
    /// The links hang in the state `start`; the firmware raises them, which begins at time 0.
    Hanging,
}

/// What the controller measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensing {
    /// The whole state, exactly, as in the paper's simulations.
    FullState,
    /// Encoder counts; the observer estimates the state.
    Encoders,
}

impl Scenario {
    /// A run at rest, upright, at set-point 0, for 10 s, from encoders if the rig asks for an observer.
    pub fn at_rest(rig: &Rig, law: Law) -> Self {
        Self {
            law,
            sensing: if rig.kalman.is_some() { Sensing::Encoders } else { Sensing::FullState },
            duration_s: 10.0,
            start: vec![0.0; rig.states()],
            step_m: 0.0,
            step_at_s: 0.0,
            step_until_s: f64::INFINITY,
            force_noise_n: 0.0,
            torque_noise_n_m: 0.0,
            force_offset_n: 0.0,
            push: None,
            seed: 1,
            substeps: 4,
            counter_start: 0,
            is_supervised: false,
            begin: Begin::ByHand,
            goals: Vec::new(),
        }
    }

    /// Set-point at the time `t` (s), in m.
    #[inline]
    pub fn target_m(&self, t: f64) -> f64 {
        if (self.step_at_s..self.step_until_s).contains(&t) { self.step_m } else { 0.0 }
    }

    /// A swing-up from rest, hanging, with the cart at 0. The links are lowered again at `lower_at_s` (s).
    pub fn swing_up(rig: &Rig, duration_s: f64, lower_at_s: Option<f64>) -> Self {
        let mut scenario = Self::at_rest(rig, Law::Lqr);
        if let Some(first) = scenario.start.get_mut(2) {
            *first = core::f64::consts::PI;
        }
        let lower = |at_s| Goal { at_s, to: Equilibrium::HANGING };
        Self {
            duration_s,
            begin: Begin::Hanging,
            goals: lower_at_s.map(lower).into_iter().collect(),
            ..scenario
        }
    }

    /// The run that every new table must pass: a small lean of the first link (or a small offset of a
    /// model's output) together with a small step, for ten time constants of the slowest pole.
    pub fn acceptance(rig: &Rig, law: Law, slowest_time_constant_s: f64) -> Self {
        let mut scenario = Self::at_rest(rig, law);
        scenario.duration_s =
            (10.0 * slowest_time_constant_s).clamp(2.0, 120.0).max(20.0 * rig.tick.period_s);
        match &rig.plant {
            PlantDescription::Chain(_) => {
                scenario.start[2] = 0.002;
                scenario.step_m = 0.05;
            }
            PlantDescription::Model(model) => scenario.start[model.output] = 0.05,
        }
        scenario
    }
}
