//! Defects in a jog.

use upright::board::Output;
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::{Answer, Request};
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright_closed_loop::defects::{Defective, Expected};
use upright_closed_loop::harness::{Flow, HarnessError, Participant, Pins, World, until};

use super::attempt::DefectRun;
use super::observed::Observed;

/// Longest time from pressing the key until the motor is on (s).
const BEGIN_S: f64 = 0.5;

impl DefectRun<'_> {
    /// A jog, in which a person holds the key throughout.
    pub(super) fn jog(&self, world: &mut World<'_>) -> Result<Observed, HarnessError> {
        self.check_and_hang(world)?;
        let is_there_before = matches!(self.trial.expected(), Expected::Found(_));
        let defect = self.defective(is_there_before.then_some(1));
        let observed = Observed::default();
        let mut jogged = Jogged { run: self, is_there_before, defect, observed, on: None };
        world.run(usize::MAX, &mut [&mut jogged])?;
        let mut observed = jogged.observed;
        self.after_jog(world, &mut observed)?;
        Ok(observed)
    }

    /// Checks the signs by hand, and lets the links hang still, wherever the cart is.
    fn check_and_hang(&self, world: &mut World<'_>) -> Result<(), HarnessError> {
        let mut hanging = world.bench.state().to_vec();
        self.until_checked(world)?;
        hanging[0] = world.bench.state()[0];
        world.hand.hold_in(&hanging);
        world.run(self.ticks(self.rig.limits.arm_time_s), &mut [])?;
        world.count_from_here();
        Ok(())
    }

    /// Whether nothing is left to be observed after `tick` of a rig that hangs.
    pub(super) fn hanging_is_over(&self, tick: usize, observed: &Observed) -> bool {
        let wants_reason = !matches!(self.trial.expected(), Expected::Found(_) | Expected::LetGo);
        match observed.off {
            Some(off) => tick > off + self.ticks_after(wants_reason && observed.fault.is_none()),
            None => tick >= self.trial.onset + self.trial.watched,
        }
    }

    /// Reads what the firmware has found out, and whether it would arm.
    fn after_jog(&self, world: &mut World<'_>, observed: &mut Observed) -> Result<(), HarnessError> {
        self.find_reason(world, observed);
        observed.motor = Some(world.session.status().motor);
        let inputs = world.inputs();
        observed.refused = match world.session.ask(Request::Arm, &inputs) {
            Err(HarnessError::Refused { answer: Answer::NotNow(reasons), .. }) => Some(reasons),
            // A wire that is open, or a board that has stopped.
            Err(HarnessError::NoAnswer(_)) => Some(Inhibits::NONE),
            Err(error) => return Err(error),
            Ok(_) => None,
        };
        Ok(())
    }
}

/// A rig that is pushed by its motor as long as a key is held, with a defect.
struct Jogged<'r> {
    run: &'r DefectRun<'r>,
    /// Whether the defect is there before the motor comes on. The rig is free while it is on then, and otherwise held
    /// by a hand, which does not hold a cart that goes where its pulses say.
    is_there_before: bool,
    defect: Defective<'r>,
    observed: Observed,
    /// The tick in which the motor came on.
    on: Option<usize>,
}

impl Jogged<'_> {
    /// Moves the rig, which hangs: free, or held by the hand.
    fn move_rig(&self, world: &mut World<'_>, output: &Output) {
        if self.is_there_before && output.enable {
            return world.hand.let_go();
        }
        if self.run.table.drive.pulses().is_some() {
            world.bench.tick(output.drive);
        }
        let cart_m = world.bench.state()[0];
        world.hand.hold_again_at(cart_m);
    }
}

impl Participant for Jogged<'_> {
    fn say(&mut self, world: &World<'_>) -> Option<Request> {
        let is_due = world.ticks() % self.run.ticks(KEEP_ALIVE.as_secs_f64()) == 0;
        let presses = is_due && self.defect.host_is_alive(world.ticks() + 1);
        presses.then_some(Request::Jog { along: self.run.trial.sign > 0.0 })
    }

    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        let (run, now) = (self.run, world.ticks());
        if now == 0 {
            return until(false);
        }
        // The motor pushes the cart: a drive with pulses, which also holds it, if telemetry says so.
        let is_pulsed = run.table.drive.pulses().is_some();
        let is_on = output.enable && (!is_pulsed || world.session.status().state == State::Jogging);
        if is_on && self.on.is_none() {
            self.on = Some(now);
            if !self.is_there_before && run.with_defect {
                self.defect.begin_in(now + run.trial.onset);
            }
        }
        if let Some(on) = self.on {
            self.observed.output(now - on, *output, is_on, usize::from(is_pulsed && output.enable));
        }
        let _ = self.defect.act(world, output)?;
        self.move_rig(world, output);
        until(false)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        self.run.disturb(world, &mut self.defect, pins)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        let Some(on) = self.on else {
            if world.ticks() > self.run.ticks(BEGIN_S) + 2 {
                return Err(HarnessError::NotBalancing(world.session.status().state));
            }
            return until(false);
        };
        let observed = &mut self.observed;
        observed.outside |= observed.off.is_none() && self.run.is_off_rail(world.bench.state());
        if observed.off.is_some() {
            observed.fault = world.session.fault();
        }
        until(self.run.hanging_is_over(world.ticks() - 1 - on, observed))
    }
}
