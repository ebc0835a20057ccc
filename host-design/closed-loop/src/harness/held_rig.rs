//! How a person moves the rig by hand.

use std::f64::consts::TAU;

use upright_design::plant::whole_turns;
use upright_design::reality::hanging_by_hand;
use upright_design::rig::{PlantDescription, Rig};

/// Speed of a hand: joints (rad/s), cart (m/s).
const RATE: [f64; 2] = [2.0, 0.5];

/// A rig that is held and moved by hand, tick by tick.
#[derive(Debug, Clone)]
pub struct HeldRig {
    hanging: Vec<f64>,
    held: Vec<f64>,
    /// Where each joint's potentiometer reads nothing (rad).
    dead_rad: Vec<Option<f64>>,
    /// Largest movement per tick of a joint (rad) and of the cart (m).
    step: [f64; 2],
}

impl HeldRig {
    /// The rig hanging, with the cart at 0.
    pub fn hanging(rig: &Rig) -> Self {
        let hanging = match &rig.plant {
            PlantDescription::Chain(_) => hanging_by_hand(rig),
            PlantDescription::Model(_) => vec![0.0; rig.states()],
        };
        let mut dead_rad = vec![None; rig.states() / 2];
        for sensor in rig.sensors().iter().filter(|_| rig.chain().is_some()) {
            dead_rad[sensor.state / 2] = sensor.dead_rad();
        }
        Self { held: hanging.clone(), hanging, dead_rad, step: RATE.map(|rate| rate * rig.tick.period_s) }
    }

    /// The state in which the rig is held (m, m/s, rad, rad/s …).
    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// Takes hold of the rig in `state` and keeps its rates.
    pub fn take(&mut self, state: &[f64]) {
        self.held.copy_from_slice(state);
    }

    /// A drive moves the cart by this (m) while the links are held.
    pub fn carry(&mut self, cart_m: f64) {
        self.held[0] += cart_m;
    }

    /// Sets all rates to 0.
    pub fn stop(&mut self) {
        self.held.iter_mut().skip(1).step_by(2).for_each(|rate| *rate = 0.0);
    }

    /// Moves the links by one tick's step towards hanging; the cart stays where it is. Returns whether they hang.
    pub fn rest(&mut self) -> bool {
        let mut rest = self.hanging.clone();
        rest[0] = self.held[0];
        self.move_to(&rest)
    }

    /// Moves the cart by one tick's step towards this position (m) and the links towards hanging, whatever whole turns
    /// they have made; returns whether the rig is there.
    pub fn push_to(&mut self, cart_m: f64) -> bool {
        let mut to = self.hanging.clone();
        to[0] = cart_m;
        self.move_nearest(to)
    }

    /// Moves the links by one tick's step towards upright, whatever whole turns they have made; the cart stays where it
    /// is. Returns whether they are upright.
    pub fn raise(&mut self) -> bool {
        let mut upright = vec![0.0; self.held.len()];
        upright[0] = self.held[0];
        self.move_nearest(upright)
    }

    fn move_nearest(&mut self, mut to: Vec<f64>) -> bool {
        for (to, held) in to.iter_mut().zip(&self.held).skip(2).step_by(2) {
            *to += whole_turns(held - *to);
        }
        self.go_around_dead_bands(&mut to);
        self.move_to(&to)
    }

    /// Moves the links by one tick's step towards the state `to`, with links whose potentiometers have a dead band on
    /// the way around it; returns whether they are there, and then is in that state: whole turns do not show in the
    /// reading of a potentiometer.
    pub(super) fn put(&mut self, to: &[f64]) -> bool {
        let mut around = to.to_vec();
        self.go_around_dead_bands(&mut around);
        let there = self.move_to(&around);
        if there {
            self.take(to);
        }
        there
    }

    /// Adds whole turns to joints with potentiometers, so that there is no dead band between `to` and where they are.
    fn go_around_dead_bands(&self, to: &mut [f64]) {
        for (index, dead_rad) in self.dead_rad.iter().enumerate() {
            let Some(dead_rad) = dead_rad else { continue };
            let turns = |angle: f64| ((angle - dead_rad) / TAU).floor();
            to[2 * index] += TAU * (turns(self.held[2 * index]) - turns(to[2 * index]));
        }
    }

    /// Moves the hanging position of the link of this sensor by one turn counter-clockwise; the next link hangs as
    /// before.
    pub fn wind(&mut self, sensor: u8) {
        let joint = 2 * usize::from(sensor);
        self.hanging[joint] += TAU;
        if let Some(outer) = self.hanging.get_mut(joint + 2) {
            *outer -= TAU;
        }
    }

    /// Turns the link of this sensor by one tick's step counter-clockwise, or pushes the cart (0) along +x.
    pub fn turn(&mut self, sensor: u8) {
        if sensor == 0 {
            self.held[0] += self.step[1];
            return;
        }
        let joint = 2 * usize::from(sensor);
        self.held[joint] += self.step[0];
        // The next link keeps hanging.
        if let Some(outer) = self.held.get_mut(joint + 2) {
            *outer -= self.step[0];
        }
    }

    /// Moves every position by one tick's step towards `to`; returns whether all are there.
    pub fn move_to(&mut self, to: &[f64]) -> bool {
        let mut there = true;
        for (index, (held, &to)) in self.held.iter_mut().zip(to).enumerate().step_by(2) {
            let step = self.step[usize::from(index == 0)];
            *held += (to - *held).clamp(-step, step);
            there &= *held == to;
        }
        there
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_rig_that_has_turned_over_is_raised_on_the_shorter_way() {
        let Ok(rig) = Rig::from_path(Path::new("../../rigs/single-quanser-ip02.toml")) else {
            panic!("no such rig")
        };
        let mut held = HeldRig::hanging(&rig);
        held.take(&[0.2, 0.0, 4.0 * TAU + 0.5, 0.0]);
        let needed = (0.5 / RATE[0] / rig.tick.period_s).ceil() as usize;
        for tick in 1..=needed {
            assert_eq!(held.raise(), tick == needed, "{tick}");
        }
        assert!((held.held()[2] - 4.0 * TAU).abs() < 1e-9 && held.held()[0] == 0.2, "{:?}", held.held());
    }
}
