//! How a hand moves the rig that it holds.

use std::f64::consts::TAU;

use crate::plant::whole_turns;
use crate::reality::hanging_by_hand;
use crate::rig::{PlantDescription, Rig};

/// Speed of a hand: joints (rad/s), cart (m/s).
const RATE: [f64; 2] = [2.0, 0.5];

/// A rig that is held and moved by hand, tick by tick.
#[derive(Debug, Clone)]
pub struct Grasp {
    hanging: Vec<f64>,
    held: Vec<f64>,
    /// Largest movement per tick of a joint (rad) and of the cart (m).
    step: [f64; 2],
}

impl Grasp {
    /// The rig hanging, with the cart at 0.
    pub fn hanging(rig: &Rig) -> Self {
        let hanging = match &rig.plant {
            PlantDescription::Chain(_) => hanging_by_hand(rig),
            PlantDescription::Model(_) => vec![0.0; rig.states()],
        };
        Self { held: hanging.clone(), hanging, step: RATE.map(|rate| rate * rig.tick.period_s) }
    }

    /// The state in which the rig is held (m, m/s, rad, rad/s …).
    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// Takes hold of the rig in `state` and keeps its rates.
    pub fn take(&mut self, state: &[f64]) {
        self.held.copy_from_slice(state);
    }

    /// Sets all rates to 0.
    pub fn stop(&mut self) {
        self.held.iter_mut().skip(1).step_by(2).for_each(|rate| *rate = 0.0);
    }

    /// Moves the links by one tick's step towards hanging; the cart stays where it is. Returns whether they hang.
    pub fn rest(&mut self) -> bool {
        self.move_to(&self.at_rest())
    }

    /// The state in which the links hang and the cart stays where it is.
    pub fn at_rest(&self) -> Vec<f64> {
        let mut rest = self.hanging.clone();
        rest[0] = self.held[0];
        rest
    }

    /// Moves the rig by one tick's step towards the cart at 0 and the links hanging, whatever whole turns they have
    /// made; returns whether it is there.
    pub fn put_back(&mut self) -> bool {
        let nearest = |(hanging, held): (&f64, &f64)| hanging + whole_turns(held - hanging);
        let mut middle = self.hanging.clone();
        let joints = self.hanging.iter().zip(&self.held).skip(2).step_by(2).map(nearest);
        middle.iter_mut().skip(2).step_by(2).zip(joints).for_each(|(to, nearest)| *to = nearest);
        self.move_to(&middle)
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
