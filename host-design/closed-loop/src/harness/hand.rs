//! A person's hand at the rig.

use std::f64::consts::TAU;

use upright::board::Output;
use upright_design::plant::whole_turns;
use upright_design::reality::hanging_by_hand;
use upright_design::rig::{PlantDescription, Rig};

/// Speed of a hand: joints (rad/s), cart (m/s).
const RATE: [f64; 2] = [2.0, 0.5];

/// What a person wants the hand to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wish {
    /// To let the rig go.
    Free,
    /// To hold it where it is.
    Still,
    /// To let the links hang with the turns that they have made, where the cart is.
    Rest,
    /// To let the links hang on the shortest way, where the cart is.
    Hang,
    /// To turn a link counter-clockwise, or to push the cart (0) along +x.
    Turn(u8),
    /// To push the cart to this position (m) while the links hang.
    PushTo(f64),
    /// To raise the links where the cart is.
    Raise,
}

/// A hand that holds and moves the rig, tick by tick, or has let it go.
#[derive(Debug, Clone)]
pub struct Hand {
    has_hold: bool,
    /// Travel per pulse (m) of a drive that takes them.
    pulse_m: Option<f64>,
    hanging: Vec<f64>,
    held: Vec<f64>,
    /// Where each joint's potentiometer reads nothing (rad).
    dead_rad: Vec<Option<f64>>,
    /// Largest movement per tick of a joint (rad) and of the cart (m).
    step: [f64; 2],
}

impl Hand {
    /// A hand that holds the rig hanging, with the cart at 0.
    pub fn hanging(rig: &Rig) -> Self {
        let hanging = match &rig.plant {
            PlantDescription::Chain(_) => hanging_by_hand(rig),
            PlantDescription::Model(_) => vec![0.0; rig.states()],
        };
        let mut dead_rad = vec![None; rig.states() / 2];
        for sensor in rig.sensors().iter().filter(|_| rig.chain().is_some()) {
            dead_rad[sensor.state / 2] = sensor.dead_rad();
        }
        let step = RATE.map(|rate| rate * rig.tick.period_s);
        let pulse_m = rig.actuator.pulses().map(|drive| drive.step_m);
        Self { has_hold: true, pulse_m, held: hanging.clone(), hanging, dead_rad, step }
    }

    /// Whether it holds the rig.
    pub fn has_hold(&self) -> bool {
        self.has_hold
    }

    /// Lets the rig go.
    pub fn let_go(&mut self) {
        self.has_hold = false;
    }

    /// Takes hold of a rig in `state`, and stills it; a hand that has hold of it goes on holding it where it is.
    pub(super) fn take_hold(&mut self, state: &[f64]) {
        if !self.has_hold {
            self.take(state);
            self.stop();
            self.has_hold = true;
        }
    }

    /// Holds the rig in `state`.
    pub fn hold_in(&mut self, state: &[f64]) {
        self.take(state);
        self.has_hold = true;
    }

    /// Takes hold of the rig as it was held last, with the cart at this position (m).
    pub fn hold_again_at(&mut self, cart_m: f64) {
        self.held[0] = cart_m;
        self.has_hold = true;
    }

    /// The state in which the rig is held (m, m/s, rad, rad/s …).
    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// Takes hold of the rig in `state` and keeps its rates.
    pub(super) fn take(&mut self, state: &[f64]) {
        self.held.copy_from_slice(state);
    }

    /// Does what is wished for one tick, with a rig in `state`, in which its motor has this output. A drive with pulses
    /// that is on moves the cart, and the hand does not.
    pub fn does(&mut self, wish: Wish, state: &[f64], output: &Output) {
        if wish == Wish::Free {
            return self.let_go();
        }
        self.take_hold(state);
        self.carry(output);
        let (cart_m, is_driven) = (self.held[0], self.pulse_m.is_some() && output.enable);
        match wish {
            Wish::Free | Wish::Still => true,
            Wish::Turn(0) if is_driven => self.rest(),
            Wish::Rest => self.rest(),
            Wish::Hang => self.push_to(cart_m),
            Wish::Turn(sensor) => {
                self.turn(sensor);
                true
            }
            Wish::PushTo(to_m) => self.push_to(if is_driven { cart_m } else { to_m }),
            Wish::Raise => self.raise(),
        };
    }

    /// A drive with pulses moves the cart while the links are held.
    pub(super) fn carry(&mut self, output: &Output) {
        self.held[0] += f64::from(output.pulses()) * self.pulse_m.unwrap_or_default();
    }

    /// Sets all rates to 0.
    pub(super) fn stop(&mut self) {
        self.held.iter_mut().skip(1).step_by(2).for_each(|rate| *rate = 0.0);
    }

    /// Moves the links by one tick's step towards hanging; the cart stays where it is. Returns whether they hang.
    pub(super) fn rest(&mut self) -> bool {
        let mut rest = self.hanging.clone();
        rest[0] = self.held[0];
        self.move_to(&rest)
    }

    /// Moves the cart by one tick's step towards this position (m) and the links towards hanging, whatever whole turns
    /// they have made; returns whether the rig is there.
    pub(super) fn push_to(&mut self, cart_m: f64) -> bool {
        let mut to = self.hanging.clone();
        to[0] = cart_m;
        self.move_nearest(to)
    }

    /// Moves the links by one tick's step towards upright, whatever whole turns they have made; the cart stays where it
    /// is. Returns whether they are upright.
    pub(super) fn raise(&mut self) -> bool {
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
    pub(super) fn turn(&mut self, sensor: u8) {
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
    fn move_to(&mut self, to: &[f64]) -> bool {
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

    use upright::control::actuator::Drive;

    use super::*;

    fn hand_at(name: &str) -> Hand {
        let mut hand = Hand::hanging(&Rig::from_path(Path::new(&format!("../../rigs/{name}.toml"))).unwrap());
        hand.let_go();
        hand
    }

    #[test]
    fn a_hand_moves_the_cart_only_while_a_drive_that_takes_pulses_is_off() {
        let mut hand = hand_at("single-stepper");
        let pulse_m = hand.pulse_m.unwrap();
        let mut cart_m = |output: &Output| {
            hand.does(Wish::PushTo(0.0), &[0.1, 0.0, 0.0, 0.0], output);
            hand.held()[0]
        };
        let on = |pulses| Output { enable: true, duty: 0.0, drive: Drive::Steps(pulses) };
        let driven_m = cart_m(&on(20));
        assert!((driven_m - 0.1 - 20.0 * pulse_m).abs() < 1e-12);
        assert_eq!(cart_m(&on(0)), driven_m);
        assert!(cart_m(&Output::OFF) < driven_m, "the hand pushes it to the middle");
    }

    #[test]
    fn a_rig_that_is_let_go_is_held_again_where_it_is() {
        let mut hand = hand_at("single-quanser-ip02");
        hand.does(Wish::Raise, &[0.2, 0.0, 0.0, 0.0], &Output::OFF);
        hand.does(Wish::Free, &[0.2, 0.0, 0.0, 0.0], &Output::OFF);
        assert!(!hand.has_hold());
        hand.does(Wish::Raise, &[0.25, 0.3, 0.0, 0.1], &Output::OFF);
        assert!(hand.has_hold());
        assert_eq!(hand.held(), [0.25, 0.0, 0.0, 0.0]);
        // A hand that holds on does not follow.
        hand.does(Wish::Raise, &[0.3; 4], &Output::OFF);
        assert_eq!(hand.held(), [0.25, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_rig_that_has_turned_over_is_raised_on_the_shorter_way() {
        let Ok(rig) = Rig::from_path(Path::new("../../rigs/single-quanser-ip02.toml")) else {
            panic!("no such rig")
        };
        let mut held = Hand::hanging(&rig);
        held.take(&[0.2, 0.0, 4.0 * TAU + 0.5, 0.0]);
        let needed = (0.5 / RATE[0] / rig.tick.period_s).ceil() as usize;
        for tick in 1..=needed {
            assert_eq!(held.raise(), tick == needed, "{tick}");
        }
        assert!((held.held()[2] - 4.0 * TAU).abs() < 1e-9 && held.held()[0] == 0.2, "{:?}", held.held());
    }
}
