//! The time history of a run of any loop, and the figures of a step response.

use serde::Serialize;

use upright_design::plant::absolute_angles;
use upright_design::simulate::{Fall, FallKind};

/// Time history of a run: states and force at equally spaced times.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Time between samples (s); the first is at 0.
    pub sample_s: f64,
    /// State at each sample: `x, ẋ, θ1, θ̇1, …` (m, m/s, rad, rad/s).
    pub states: Vec<Vec<f64>>,
    /// Force of the control law on the cart, without disturbance, from each sample on (N).
    pub forces_n: Vec<f64>,
    /// How it falls, if it does: the record ends there.
    pub fall: Option<Fall>,
}

/// Figures of a response to a step of the set-point at 0 s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepFigures {
    /// How it falls, if it does.
    pub fall: Option<Fall>,
    /// Time after which the cart stays within 2 % of the step until the run ends (s).
    pub settling_time_s: Option<f64>,
    /// Largest excursion beyond the set-point (% of the step).
    pub overshoot_percent: f64,
    /// Largest excursion in the opposite direction (% of the step).
    pub undershoot_percent: f64,
    /// Largest angle of each joint (°).
    pub peak_angles_deg: Vec<f64>,
    /// Largest force (N).
    pub peak_force_n: f64,
    /// Integral of the squared force (N²·s): the effort that the LQR's cost counts.
    pub effort_n2_s: f64,
}

/// Band around the set-point that counts as settled, relative to the step.
pub const BAND: f64 = 0.02;

impl Trajectory {
    /// An empty record with room for so many samples, `sample_s` (s) apart.
    pub(crate) fn with_room(sample_s: f64, samples: usize) -> Self {
        let (states, forces_n) = (Vec::with_capacity(samples), Vec::with_capacity(samples));
        Self { sample_s, states, forces_n, fall: None }
    }

    /// Appends a sample.
    pub(crate) fn push(&mut self, state: &[f64], force_n: f64) {
        self.states.push(state.to_vec());
        self.forces_n.push(force_n);
    }

    /// One state over time.
    pub fn state(&self, index: usize) -> Vec<f64> {
        self.states.iter().map(|state| state[index]).collect()
    }

    /// Whether it survives `horizon_s` after the start, the cart within [`BAND`] of a step of `step_m`.
    pub fn stabilised(&self, step_m: f64, horizon_s: f64) -> bool {
        let index = (horizon_s / self.sample_s).round() as usize;
        self.states.get(index).is_some_and(|state| (state[0] - step_m).abs() <= BAND * step_m.abs())
            && self.fall.as_ref().is_none_or(|fall| fall.at_s > horizon_s)
    }

    /// Figures of the response to a step of `step_m`.
    pub fn step_figures(&self, step_m: f64) -> StepFigures {
        let towards = |state: &Vec<f64>| state[0] / step_m;
        let outside = |state: &Vec<f64>| (towards(state) - 1.0).abs() > BAND;
        let last_outside = self.states.iter().rposition(outside);
        let settled = self.fall.is_none() && last_outside.is_none_or(|last| last + 1 < self.states.len());
        let joints = self.states.first().map_or(0, |state| state.len() / 2 - 1);
        let peak = |of: &dyn Fn(&Vec<f64>) -> f64| self.states.iter().map(of).fold(0.0, f64::max);
        StepFigures {
            fall: self.fall.clone(),
            settling_time_s: settled.then(|| last_outside.map_or(0, |last| last + 1) as f64 * self.sample_s),
            overshoot_percent: 100.0 * peak(&|state| towards(state) - 1.0),
            undershoot_percent: 100.0 * peak(&|state| -towards(state)),
            peak_angles_deg: (0..joints)
                .map(|joint| peak(&|state| state[2 + 2 * joint].abs()).to_degrees())
                .collect(),
            peak_force_n: self.forces_n.iter().map(|force| force.abs()).fold(0.0, f64::max),
            effort_n2_s: self.forces_n.iter().map(|force| force * force).sum::<f64>() * self.sample_s,
        }
    }
}

/// A fall at `at_s`, if a link is beyond the horizontal: names the first one. A state that is not finite is a fall,
/// too.
pub(crate) fn fall_of(state: &[f64], at_s: f64) -> Option<Fall> {
    if !state.iter().all(|entry| entry.is_finite()) {
        return Some(Fall { at_s, kind: FallKind::NotFinite });
    }
    let fallen = absolute_angles(state).position(|angle| angle.abs() > core::f64::consts::FRAC_PI_2)?;
    Some(Fall { at_s, kind: FallKind::Link(fallen + 1) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trajectory(positions: &[f64], fall: Option<Fall>) -> Trajectory {
        let states = positions.iter().map(|&x| vec![x, 0.0, -x, 0.0]).collect();
        Trajectory { sample_s: 0.5, states, forces_n: vec![2.0; positions.len()], fall }
    }

    #[test]
    fn figures_of_a_step_are_read_off_the_course() {
        let figures = trajectory(&[0.0, -0.1, 2.2, 1.9, 1.97, 2.0], None).step_figures(2.0);
        assert_eq!(figures.settling_time_s, Some(2.0));
        assert!((figures.overshoot_percent - 10.0).abs() < 1e-9);
        assert!((figures.undershoot_percent - 5.0).abs() < 1e-9);
        assert!((figures.peak_angles_deg[0] - 2.2f64.to_degrees()).abs() < 1e-9);
        assert_eq!((figures.peak_force_n, figures.effort_n2_s), (2.0, 12.0));
        assert_eq!(trajectory(&[0.0, 1.0, 0.97], None).step_figures(1.0).settling_time_s, None);
    }

    #[test]
    fn stabilised_means_upright_near_the_set_point_at_the_horizon() {
        let run = trajectory(&[0.0, 0.99, 0.9, 1.01], None);
        let at = |run: &Trajectory| [0.5, 1.0, 1.5, 2.0].map(|horizon| run.stabilised(1.0, horizon));
        assert_eq!(at(&run), [true, false, true, false], "the run does not reach 2 s");
        let fallen = Trajectory { fall: fall_of(&[0.0, 0.0, 2.0, 0.0], 1.0), ..run };
        assert_eq!(at(&fallen), [true, false, false, false]);
        assert_eq!(fall_of(&[0.0, 0.0, 1.5, 0.0], 1.0), None);
    }
}
