//! The drive of the simulated rig: how the cart moves while it holds a command.

use upright::control::actuator::Drive;

use super::driven_cart::DrivenCart;
use super::sensor::nearest;
use super::servo::Servo;
use crate::reality::{Driver, StepMotor};
use crate::rig::{Actuator, Rig};

/// What is wrong with a drive that takes pulses. The board counts its pulses whatever it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepDefect {
    /// It is off: it lets go of a cart that its motor moved; without a motor, the cart stands.
    Off,
    /// The cart is stuck.
    Jammed,
    /// It misses this share of its pulses.
    Misses(f64),
}

/// The drive of the real machine.
pub(super) enum SimulatedDrive {
    /// It produces the commanded force.
    Force,
    /// Driver and supply between the command and the force; a motor holds its voltage.
    Driver(Driver),
    /// It takes pulses.
    Pulses(PulseDrive),
}

impl SimulatedDrive {
    /// The drive of the machine of `rig`, which starts at `start`.
    pub(super) fn of(rig: &Rig, start: &[f64]) -> Self {
        match &rig.actuator {
            Actuator::Pulses(drive) => Self::Pulses(PulseDrive::of(rig, drive.step_m, start)),
            Actuator::Force(_) | Actuator::Motor(..) => Driver::of(rig).map_or(Self::Force, Self::Driver),
        }
    }

    /// Simulates a part of a tick of `length_s` (s) in which a force or a voltage is held, with a disturbing force (N);
    /// returns the drive's force at its start (N).
    pub(super) fn push(
        &mut self,
        drive: Drive,
        disturbance: f64,
        length_s: f64,
        cart: &mut DrivenCart<'_>,
    ) -> f64 {
        let substeps = cart.substeps_in(length_s);
        let Self::Driver(driver) = self else {
            let force = commanded_n(drive);
            cart.advance(force + disturbance, length_s, substeps);
            return force;
        };
        let acting = driver.acting(drive, disturbance);
        let at_start = acting.first_n(cart.motor_speed());
        cart.plant.advance_with(&acting, cart.torques, length_s, substeps);
        cart.plant.write_state(cart.state);
        driver.finish(drive, length_s, cart.motor_speed());
        at_start
    }
}

/// Force on the cart (N) of a drive that produces the commanded one.
pub(super) fn commanded_n(drive: Drive) -> f64 {
    match drive {
        Drive::Force(force) => f64::from(force),
        Drive::Duty(_) | Drive::Steps(_) => 0.0,
    }
}

/// A drive that imposes the cart's motion by pulses, which are spread evenly over a tick.
pub(super) struct PulseDrive {
    /// Travel per pulse (m).
    step_m: f64,
    /// The pulses so far, from position 0.
    pulses: i64,
    /// Those that it has missed.
    missed: i64,
    /// What is wrong with it in the next tick.
    defect: Option<StepDefect>,
    follower: PulseFollower,
}

/// How the cart follows the pulses.
enum PulseFollower {
    /// It has their mean speed at once; forces on the cart change nothing.
    AtOnce,
    /// A servo, which approaches their speed.
    Servo(Servo),
    /// A motor, which pulls the cart to their position.
    Motor(StepMotor),
}

impl PulseFollower {
    fn of(rig: &Rig) -> Self {
        match (StepMotor::of(rig), Servo::of(rig)) {
            (Some(motor), _) => Self::Motor(motor),
            (None, Some(servo)) => Self::Servo(servo),
            (None, None) => Self::AtOnce,
        }
    }
}

impl PulseDrive {
    fn of(rig: &Rig, step_m: f64, start: &[f64]) -> Self {
        let follower = PulseFollower::of(rig);
        let mut drive = Self { step_m, pulses: 0, missed: 0, defect: None, follower };
        drive.rest_at(start);
        drive
    }

    /// Its pulses have brought the cart into this state, and none is missing: a servo's cart is behind its command.
    pub(super) fn rest_at(&mut self, state: &[f64]) {
        let lag_s = match &mut self.follower {
            PulseFollower::Servo(servo) => {
                servo.rest();
                servo.lag_s()
            }
            PulseFollower::AtOnce | PulseFollower::Motor(_) => 0.0,
        };
        self.pulses = nearest((state[0] + lag_s * state[1]) / self.step_m);
        self.missed = 0;
    }

    /// Continues with the pulses of `before`.
    pub(super) fn take_over(&mut self, before: &Self) {
        (self.pulses, self.missed) = (before.pulses, before.missed);
    }

    /// Spoils it in the next tick.
    pub(super) fn spoil(&mut self, defect: StepDefect) {
        self.defect = Some(defect);
    }

    /// The pulses that the board has counted, from position 0.
    pub(super) fn counted(&self) -> i64 {
        self.pulses
    }

    /// Simulates a tick with the pulses of `now`, while those of `drive` are counted; they are the same unless the cart
    /// moves a tick late (`is_late`). A drive that is off lets go of a cart that its motor moved; without a motor, the
    /// cart stands.
    pub(super) fn tick(
        &mut self,
        drive: Drive,
        now: Drive,
        is_late: bool,
        disturbance: f64,
        cart: &mut DrivenCart<'_>,
    ) {
        let of = |drive: Drive| if let Drive::Steps(pulses) = drive { Some(pulses) } else { None };
        let (counted, pulses) = (of(drive).unwrap_or(0), of(now).unwrap_or(0));
        let defect = self.defect.take();
        let missed = match defect {
            None => 0.0,
            Some(StepDefect::Off | StepDefect::Jammed)
                if matches!(self.follower, PulseFollower::Motor(_)) =>
            {
                0.0
            }
            Some(StepDefect::Off | StepDefect::Jammed) => f64::from(pulses),
            Some(StepDefect::Misses(share)) => (share * f64::from(pulses)).round(),
        };
        let on_the_way = if is_late { i64::from(pulses) } else { 0 };
        let (before, arrive) = (self.pulses - self.missed - on_the_way, f64::from(pulses) - missed);
        self.pulses += i64::from(counted);
        self.missed += missed as i64;
        let speed = arrive * self.step_m / cart.period_s;
        match &mut self.follower {
            PulseFollower::AtOnce => {
                cart.plant.set_cart_speed(speed);
                cart.advance(0.0, cart.period_s, cart.substeps);
            }
            PulseFollower::Servo(servo) => servo.follow(speed, cart),
            PulseFollower::Motor(motor) => {
                let is_on = of(drive).is_some() && defect != Some(StepDefect::Off);
                let parts = motor.parts(cart.period_s);
                for part in 0..parts {
                    // Pulse j of n begins at (j + 1/2) / n of the tick.
                    let given = ((part as f64 + 0.5) / parts as f64 * arrive).round() as i64;
                    let commanded = [(before + given) as f64 * self.step_m, speed];
                    if defect == Some(StepDefect::Jammed) {
                        cart.plant.set_cart_speed(0.0);
                    }
                    let of_cart = [cart.state[0], cart.state[1]];
                    let force = if is_on { motor.force_n(commanded, of_cart) } else { 0.0 };
                    cart.advance(force + disturbance, cart.period_s / parts as f64, 1);
                }
            }
        }
    }
}
