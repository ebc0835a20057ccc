//! Defects in a jog.

use upright::board::Output;
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::{Answer, Request};
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright_closed_loop::defects::{Expected, Injection};
use upright_closed_loop::harness::{Harness, HarnessError, Session};

use super::attempt::{DefectRun, spoil};
use super::observed::Observed;

/// Longest time from pressing the key until the motor is on (s).
const BEGIN_S: f64 = 0.5;

impl DefectRun<'_> {
    /// A jog, in which a person holds the key throughout.
    pub(super) fn jog(&self, harness: &mut Harness<'_>) -> Result<Observed, HarnessError> {
        let trial = self.trial;
        let is_there_before = matches!(trial.expected(), Expected::Found(_));
        let mut held = self.checked_and_hanging(harness)?;
        let mut observed = Observed::default();
        let mut injection = Injection::new(self.rig, self.table, trial.clone());
        // Number of ticks since the motor came on.
        let mut tick: Option<usize> = None;
        for turn in 0.. {
            let since = match tick {
                _ if !self.with_defect => None,
                _ if is_there_before => Some(turn),
                Some(tick) => (tick + 1).checked_sub(trial.onset),
                None => None,
            };
            if turn % self.ticks(KEEP_ALIVE.as_secs_f64()) == 0 && injection.host_is_alive(since) {
                harness.session.send(Request::Jog { along: trial.sign > 0.0 });
            }
            let output = self.control(harness, &mut injection, since, &mut false)?;
            if since == Some(0) {
                injection.serial(&mut harness.session);
            }
            let is_on = self.is_jogging(&harness.session, &output);
            tick = match tick {
                Some(tick) => Some(tick + 1),
                None => is_on.then_some(0),
            };
            let mut acting = output;
            if let Some(since) = since.filter(|_| is_there_before && output.enable) {
                spoil(harness, &mut injection, since, &mut acting);
            }
            self.move_rig(harness, &acting, &mut held, is_there_before);
            let Some(tick) = tick else {
                if turn > self.ticks(BEGIN_S) {
                    return Err(HarnessError::NotBalancing(harness.session.status().state));
                }
                continue;
            };
            let was_told = self.table.drive.pulses().is_some() && output.enable;
            observed.output(tick, output, is_on, was_told.into());
            observed.outside |= observed.off.is_none() && self.is_off_rail(harness.bench.state());
            if observed.off.is_some() {
                observed.fault = harness.session.fault();
            }
            if self.hanging_is_over(tick, &observed) {
                break;
            }
        }
        self.after_jog(harness, &mut observed)?;
        Ok(observed)
    }

    /// A tick of the rig, which hangs as in `held`: free, or held by a hand, which does not hold a cart that goes where
    /// its pulses say.
    fn move_rig(&self, harness: &mut Harness<'_>, output: &Output, held: &mut [f64], is_free: bool) {
        let is_free = is_free && output.enable;
        if is_free || self.table.drive.pulses().is_some() {
            harness.bench.tick(output.drive);
            held[0] = harness.bench.state()[0];
        }
        if !is_free {
            harness.bench.hold(held);
        }
    }

    /// Whether the motor pushes the cart: a drive with pulses, which also holds it, if telemetry says so.
    fn is_jogging(&self, session: &Session<'_>, output: &Output) -> bool {
        output.enable && (self.table.drive.pulses().is_none() || session.status().state == State::Jogging)
    }

    /// Checks the signs by hand, and lets the links hang still, wherever the cart is; returns that state.
    fn checked_and_hanging(&self, harness: &mut Harness<'_>) -> Result<Vec<f64>, HarnessError> {
        let mut held = harness.bench.state().to_vec();
        self.until_checked(harness)?;
        held[0] = harness.bench.state()[0];
        for _ in 0..self.ticks(self.rig.limits.arm_time_s) {
            harness.bench.hold(&held);
            let inputs = harness.inputs();
            harness.session.tick(&inputs)?;
        }
        Ok(held)
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
    fn after_jog(&self, harness: &mut Harness<'_>, observed: &mut Observed) -> Result<(), HarnessError> {
        self.find_reason(harness, observed);
        observed.motor = Some(harness.session.status().motor);
        let inputs = harness.inputs();
        observed.refused = match harness.session.ask(Request::Arm, &inputs) {
            Err(HarnessError::Refused { answer: Answer::NotNow(reasons), .. }) => Some(reasons),
            // A wire that is open, or a board that has stopped.
            Err(HarnessError::NoAnswer(_)) => Some(Inhibits::NONE),
            Err(error) => return Err(error),
            Ok(_) => None,
        };
        Ok(())
    }
}
