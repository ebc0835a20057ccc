//! Why a design has no solution, and what to change.

use core::fmt;

/// The part of a design that failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// LQR for continuous time.
    ContinuousLqr,
    /// LQR for the tick.
    SampledLqr,
    /// Pole placement for continuous time.
    ContinuousPlacement,
    /// Pole placement for the tick.
    SampledPlacement,
    /// LQR with integral action for continuous time.
    ContinuousIntegral,
    /// LQR with integral action for the tick.
    SampledIntegral,
}

impl Task {
    pub(super) fn is_sampled(self) -> bool {
        matches!(self, Task::SampledLqr | Task::SampledPlacement | Task::SampledIntegral)
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Task::ContinuousLqr => "LQR (continuous)",
            Task::SampledLqr => "LQR (sampled)",
            Task::ContinuousPlacement => "pole placement (continuous)",
            Task::SampledPlacement => "pole placement (sampled)",
            Task::ContinuousIntegral => "LQR with integral action (continuous)",
            Task::SampledIntegral => "LQR with integral action (sampled)",
        })
    }
}

/// A design problem without a solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The mass matrix is singular: some motion moves no mass.
    #[error(
        "the mass matrix has no inverse: some motion of the chain moves no mass; give every link a mass and a centre of mass or an inertia"
    )]
    MassMatrix,
    /// Poles cannot be placed because the force does not reach some modes.
    #[error("{task}: the force does not reach {}: these poles cannot be moved; choose another input b, or use [lqr] alone if they are stable", mode_list(.modes))]
    Uncontrollable {
        /// The design that failed.
        task: Task,
        /// The modes that the force does not reach, [re, im].
        modes: Vec<[f64; 2]>,
    },
    /// The force does not reach an unstable mode.
    #[error("{task}: no stabilising gain exists: the force does not reach {}, and it does not decay by itself; choose another input b", mode_list(.modes))]
    NotStabilisable {
        /// The design that failed.
        task: Task,
        /// The modes that the force does not reach, [re, im].
        modes: Vec<[f64; 2]>,
    },
    /// A mode on the stability boundary carries no weight.
    #[error("{task}: no stabilising gain exists: {} on the stability boundary costs nothing; give a state that shows it a positive entry in lqr.state_weights", mode_list(.modes))]
    Unweighted {
        /// The design that failed.
        task: Task,
        /// The modes without weight, [re, im].
        modes: Vec<[f64; 2]>,
    },
    /// The sensors do not show a mode that does not decay by itself.
    #[error("observer: no stable observer exists: the sensors do not show {}; measure another state", mode_list(.modes))]
    Undetectable {
        /// The modes that the sensors do not show, [re, im].
        modes: Vec<[f64; 2]>,
    },
    /// The steady-state Kalman filter does not exist.
    #[error(
        "observer: no steady-state Kalman filter could be resolved with {bits} bits: a mode on the stability boundary feels no noise; give [kalman] noise that reaches every joint"
    )]
    NoKalman {
        /// Working precision (bits).
        bits: usize,
    },
    /// The number of poles differs from the number of states.
    #[error("pole_placement: {given} poles were given for {wanted} states; give exactly {wanted}")]
    PoleCount {
        /// Poles in the rig file.
        given: usize,
        /// States of the plant.
        wanted: usize,
    },
    /// Unstable growth within one tick exceeds single precision.
    #[error(
        "tick.period_s = {tick_s} s is too long: the unstable pole at {pole:.4} 1/s grows {growth:.1e}-fold in one tick, more than single precision resolves (1.7e7); shorten the tick"
    )]
    TickTooLong {
        /// Control period (s).
        tick_s: f64,
        /// Fastest unstable pole (1/s).
        pole: f64,
        /// Growth `e^(pT)` within one tick.
        growth: f64,
    },
    /// No solution was found, and the diagnosis found no reason.
    #[error(
        "{task}: no stabilising solution could be resolved with {bits} bits: the problem is degenerate (a closed-loop pole on the stability boundary) or extremely badly scaled; check weights and units"
    )]
    Unresolved {
        /// The design that failed.
        task: Task,
        /// Working precision (bits).
        bits: usize,
    },
    /// Even the two highest precisions gave different answers.
    #[error(
        "the gains still changed between {0} and {1} bits: the problem is extremely badly conditioned; check units and the tick"
    )]
    Disagreement(usize, usize),
    /// The eigenvalue iteration failed.
    #[error("the poles could not be computed: the plant has entries of extreme size; check units")]
    Poles,
}

fn mode_list(modes: &[[f64; 2]]) -> String {
    let one = |[re, im]: &[f64; 2]| if *im == 0.0 { format!("{re:.4}") } else { format!("{re:.4}{im:+.4}i") };
    let list: Vec<String> = modes.iter().map(one).collect();
    format!("the mode{} at {}", if modes.len() == 1 { "" } else { "s" }, list.join(", "))
}
