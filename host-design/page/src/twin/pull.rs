//! A spring between a body of the rig and the pointer.

use upright_design::plant::{absolute_angles, torques_of_force};
use upright_design::rig::Chain;

/// What is pulled, and where to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PulledPoint {
    /// 0: cart, 1: first link …
    pub(crate) body: usize,
    /// Where on the link: 0 at its joint, 1 at its end.
    pub(crate) along: f64,
    /// Target position: along the rail, or along the arc of an arm's first joint, and up from it (m).
    pub(crate) to: [f64; 2],
}

/// The spring between the pointer and a rig. With the mass that it moves it forms a damped oscillator, of 0.5 Hz for
/// one link: a gentle pull, because the fault detection would mistake a hard one for a broken encoder.
#[derive(Debug, Clone)]
pub(crate) struct Spring {
    lengths_m: Vec<f64>,
    /// Distances of the links' planes from an arm's axis (m); 1 on a cart, whose position is a length.
    levers_m: Vec<f64>,
    /// The distance of the plane that a page draws, on which the first joint moves; 1 on a cart.
    drawn_m: f64,
    masses_kg: Vec<f64>,
    /// What a pull at the cart moves, or at the end of an arm.
    total_kg: f64,
    gravity_m_per_s2: f64,
    period_s: f64,
}

/// What a spring does: a force on the rig where it is gripped (N), as a force on the cart and torques at the joints.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pull {
    /// Along the rail, and up (N).
    pub(crate) force_n: [f64; 2],
    /// The generalised force on the cart (N), or on an arm (N·m).
    pub(crate) cart_n: f64,
    /// The torques at the joints (N·m).
    pub(crate) torques_n_m: Vec<f64>,
}

/// Angular frequency of the spring with the mass that it moves, for one link (rad/s).
const OMEGA: f64 = 3.0;
/// More links survive less, so the spring is softer: its frequency falls with this power of their number.
const SOFTER: f64 = 1.2;
/// Damping ratio of the spring.
const ZETA: f64 = 0.35;
/// Largest force, as a multiple of the weight that it moves.
const STRONGEST: f64 = 4.0;
/// Largest change of speed of the gripped body by the damper within a tick, as a fraction.
const DAMPED_PER_TICK: f64 = 0.3;

impl Spring {
    /// The spring for the links of `chain`, recomputed every `period_s`.
    pub(crate) fn of(chain: &Chain, period_s: f64) -> Self {
        Self {
            lengths_m: chain.links.iter().map(|link| link.length_m).collect(),
            levers_m: (0..chain.links.len()).map(|link| chain.radius_m(link).unwrap_or(1.0)).collect(),
            drawn_m: chain.arc_m(),
            total_kg: chain.total_mass_kg() / chain.arc_m().powi(2),
            masses_kg: chain.links.iter().map(|link| link.mass_kg).collect(),
            gravity_m_per_s2: chain.gravity_m_per_s2,
            period_s,
        }
    }

    /// The pull of `pulled` on the rig in `state` (`x, ẋ, θ_1, θ̇_1, …`).
    pub(crate) fn pull(&self, pulled: &PulledPoint, state: &[f64]) -> Pull {
        let angles: Vec<f64> = absolute_angles(state).collect();
        let mut rate = 0.0;
        let rates: Vec<f64> = state
            .iter()
            .skip(3)
            .step_by(2)
            .map(|relative| {
                rate += relative;
                rate
            })
            .collect();
        // Length of each link up to the gripped point; 0 beyond it (m).
        let arm = |link: usize| match link + 1 {
            number if number < pulled.body => self.lengths_m[link],
            number if number == pulled.body => self.lengths_m[link] * pulled.along.clamp(0.0, 1.0),
            _ => 0.0,
        };
        let arms_m: Vec<f64> = (0..angles.len()).map(arm).collect();
        let lever = pulled.body.checked_sub(1).and_then(|link| self.levers_m.get(link)).copied();
        let lever = lever.unwrap_or(self.drawn_m);
        let (mut point, mut speed) = ([state[0] * self.drawn_m, 0.0], [state[1] * lever, 0.0]);
        for (link, (&phi, &phidot)) in angles.iter().zip(&rates).enumerate() {
            let (sin, cos) = phi.sin_cos();
            let arm = arms_m[link];
            point = [point[0] - arm * sin, point[1] + arm * cos];
            speed = [speed[0] - arm * cos * phidot, speed[1] - arm * sin * phidot];
        }
        let force_n = self.force(pulled, point, speed);
        Pull { force_n, cart_n: force_n[0] * lever, torques_n_m: torques_of_force(&arms_m, force_n, state) }
    }

    /// The torques at the joints (N·m) of a force along the rail (N) at the end of the first link.
    pub(crate) fn torques_at_first(&self, force_n: f64, state: &[f64]) -> Vec<f64> {
        let mut arms_m = vec![0.0; self.lengths_m.len()];
        arms_m.iter_mut().zip(&self.lengths_m).take(1).for_each(|(arm, &length)| *arm = length);
        torques_of_force(&arms_m, [force_n, 0.0], state)
    }

    fn omega(&self) -> f64 {
        OMEGA / (self.lengths_m.len().max(1) as f64).powf(SOFTER)
    }

    fn force(&self, pulled: &PulledPoint, point: [f64; 2], speed: [f64; 2]) -> [f64; 2] {
        let (moved_kg, body_kg) = match pulled.body.checked_sub(1).and_then(|link| self.masses_kg.get(link)) {
            Some(&own) => (self.masses_kg.iter().sum::<f64>(), own),
            None => (self.total_kg, self.total_kg),
        };
        let omega = self.omega();
        let stiffness = moved_kg * omega * omega;
        let damping = (2.0 * ZETA * omega * moved_kg).min(DAMPED_PER_TICK * body_kg / self.period_s);
        let raw = [0, 1].map(|axis| stiffness * (pulled.to[axis] - point[axis]) - damping * speed[axis]);
        let size = raw[0].hypot(raw[1]);
        let strongest = STRONGEST * self.gravity_m_per_s2 * moved_kg;
        let scale = if size > strongest { strongest / size } else { 1.0 };
        // The rail takes the vertical force on the cart.
        if pulled.body == 0 { [raw[0] * scale, 0.0] } else { raw.map(|component| component * scale) }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use upright_design::rig::{PlantDescription, Rig};

    use super::*;

    fn spring(links: usize) -> Spring {
        Spring {
            lengths_m: vec![0.5; links],
            levers_m: vec![1.0; links],
            drawn_m: 1.0,
            masses_kg: vec![0.2; links],
            total_kg: 1.0,
            gravity_m_per_s2: 9.81,
            period_s: 1e-3,
        }
    }

    #[test]
    fn a_pull_at_the_tip_turns_every_joint_by_its_lever() {
        // Upright at rest, pulled along +x at the tip: the levers are the distances of the joints from it.
        let pulled = PulledPoint { body: 2, along: 1.0, to: [0.01, 1.0] };
        let spring = spring(2);
        let pull = spring.pull(&pulled, &[0.0; 6]);
        let force = 0.4 * spring.omega() * spring.omega() * 0.01;
        assert!((pull.force_n[0] - force).abs() < 1e-9 && pull.force_n[1].abs() < 1e-9);
        assert!((pull.cart_n - force).abs() < 1e-9);
        assert!(
            (pull.torques_n_m[0] + force).abs() < 1e-9 && (pull.torques_n_m[1] + 0.5 * force).abs() < 1e-9
        );
    }

    #[test]
    fn the_work_of_the_pull_is_that_of_its_force() {
        // F · v = cart force · ẋ + Σ Q_j φ̇_j, for any state: here by a small step along the motion.
        let state = [0.1, 0.4, 0.7, -1.2, -0.3, 2.0];
        let pulled = PulledPoint { body: 2, along: 0.6, to: [0.3, 0.2] };
        let pull = spring(2).pull(&pulled, &state);
        let point = |state: &[f64]| {
            let [first, second] = [state[2], state[2] + state[4]];
            [state[0] - 0.5 * first.sin() - 0.3 * second.sin(), 0.5 * first.cos() + 0.3 * second.cos()]
        };
        let step = 1e-7;
        let later: Vec<f64> =
            (0..6).map(|i| if i % 2 == 0 { state[i] + step * state[i + 1] } else { state[i] }).collect();
        let moved = [0, 1].map(|axis| (point(&later)[axis] - point(&state)[axis]) / step);
        let work = pull.force_n[0] * moved[0] + pull.force_n[1] * moved[1];
        // A joint torque works on the relative rate.
        let joints = pull.cart_n * state[1] + pull.torques_n_m[0] * state[3] + pull.torques_n_m[1] * state[5];
        assert!((work - joints).abs() < 1e-5, "{work} {joints}");
    }

    #[test]
    fn a_pull_at_an_arm_is_a_torque_about_its_axis() {
        let rig = Rig::from_path(Path::new("../../rigs/single-qube-servo-2.toml")).unwrap();
        let chain = rig.chain().unwrap();
        let spring = Spring::of(chain, 2e-3);
        let pulled = |body| PulledPoint { body, along: 0.0, to: [0.085 * 0.1 + 1e-3, 0.0] };
        for body in [0, 1] {
            let pull = spring.pull(&pulled(body), &[0.1, 0.0, 0.0, 0.0]);
            assert!(pull.force_n[0] > 0.0, "{pull:?}");
            assert!((pull.cart_n - 0.085 * pull.force_n[0]).abs() < 1e-12, "{pull:?}");
        }
        // What moves the whole arm moves its moment of inertia.
        let force = spring.pull(&pulled(0), &[0.1, 0.0, 0.0, 0.0]).force_n[0];
        let kg = (2.334e-4 + 0.024 * 0.085f64.powi(2)) / 0.085f64.powi(2);
        assert!((force - kg * OMEGA * OMEGA * 1e-3).abs() < 1e-9, "{force}");
        // Negative control: a pointer where the arm is pulls nothing.
        let none = PulledPoint { to: [0.085 * 0.1, 0.0], ..pulled(0) };
        assert!(spring.pull(&none, &[0.1, 0.0, 0.0, 0.0]).cart_n.abs() < 1e-12);
    }

    #[test]
    fn a_far_pointer_pulls_with_a_multiple_of_the_weight_where_the_rig_stands() {
        let Ok(rig) = Rig::from_path(Path::new("../../rigs/single-quanser-ip02.toml")) else {
            panic!("no such rig")
        };
        let PlantDescription::Chain(mut chain) = rig.plant else { panic!("not a chain") };
        let pulled = PulledPoint { body: 1, along: 1.0, to: [1e9, -1e9] };
        for gravity_m_per_s2 in [9.81, 1.62] {
            chain.gravity_m_per_s2 = gravity_m_per_s2;
            let pull = Spring::of(&chain, 1e-3).pull(&pulled, &[0.0; 4]);
            let strongest = STRONGEST * gravity_m_per_s2 * chain.links[0].mass_kg;
            let size = pull.force_n[0].hypot(pull.force_n[1]);
            assert!((size - strongest).abs() < 1e-9, "{gravity_m_per_s2}: {size}");
        }
    }
}
