//! The conversation with a machine during a step.

use std::time::Duration;

use upright::protocol::message::{Answer, Request};
use upright::supervision::supervisor::State;
use upright_closed_loop::client::{AnyTelemetry, ExpectedRig};

use super::machine::{MachineAtHand, Stop};
use super::record::Journal;
use super::task::PersonTask;
use crate::monitor::{Ended, Monitor, MonitorAction};

/// Time without telemetry after which the step ends.
const SILENCE: Duration = Duration::from_secs(2);
/// Time between two tries of the same request.
const RETRY: Duration = Duration::from_millis(500);
/// Time in which a request is answered and its effect reported.
const ANSWER: Duration = Duration::from_millis(100);
/// Longest wait for the motor to be off.
const OFF: Duration = Duration::from_secs(1);

/// Leads the person through a step, and watches the telemetry.
pub(super) struct Guide<'a> {
    pub(super) machine: &'a mut dyn MachineAtHand,
    pub(super) journal: &'a mut Journal,
    conversation: Monitor,
    heard: Duration,
    last_tick: Option<u32>,
}

impl<'a> Guide<'a> {
    pub(super) fn new(machine: &'a mut dyn MachineAtHand, journal: &'a mut Journal) -> Self {
        let heard = machine.now();
        Self { machine, journal, conversation: Monitor::new(""), heard, last_tick: None }
    }

    /// The conversation so far.
    pub(super) fn conversation(&self) -> &Monitor {
        &self.conversation
    }

    /// Ends the conversation unless the firmware is that of `rig`.
    pub(super) fn expect_rig(&mut self, rig: ExpectedRig) -> Result<(), Stop> {
        self.conversation.expect_rig(rig);
        self.ended()
    }

    /// Asks the person to do something.
    pub(super) fn ask(&mut self, task: PersonTask) -> Result<(), Stop> {
        self.journal.asked(task);
        self.machine.ask(task)?;
        // Consent may have taken long.
        self.listen();
        Ok(())
    }

    /// Restarts the timeout for telemetry, after a time in which nobody has listened.
    pub(super) fn listen(&mut self) {
        self.heard = self.machine.now();
    }

    /// Adds a finding to the journal.
    pub(super) fn found(&mut self, words: impl Into<String>) {
        self.journal.found(words);
    }

    /// Sends a request.
    pub(super) fn send(&mut self, request: Request) {
        let now = self.machine.now();
        self.conversation.act(MonitorAction::Send(request), now);
    }

    /// Sends what is due and receives: some milliseconds pass.
    pub(super) fn turn(&mut self) -> Result<(), Stop> {
        self.conversation.poll(self.machine.now());
        let bytes = self.machine.exchange(&self.conversation.take_outgoing())?;
        let now = self.machine.now();
        self.conversation.receive(&bytes, now);
        self.ended()?;
        let tick = self.conversation.telemetry.as_ref().map(|telemetry| telemetry.tick);
        if tick != self.last_tick {
            (self.heard, self.last_tick) = (now, tick);
        } else if now.saturating_sub(self.heard) > SILENCE {
            let words = "nothing is heard from the firmware: check port, cable, power, and that no other program has the port";
            return Err(Stop::Line(words.to_owned()));
        }
        Ok(())
    }

    fn ended(&self) -> Result<(), Stop> {
        match &self.conversation.ended {
            None => Ok(()),
            Some(ended @ Ended::Closed(_)) => Err(Stop::Line(ended.to_string())),
            Some(ended) => Err(Stop::Machine(ended.to_string())),
        }
    }

    /// Waits until `done` finds something in the telemetry; `None` if that takes longer than `patience`.
    pub(super) fn wait<R>(
        &mut self,
        patience: Duration,
        mut done: impl FnMut(&AnyTelemetry) -> Option<R>,
    ) -> Result<Option<R>, Stop> {
        let end = self.machine.now() + patience;
        loop {
            if let Some(found) = self.conversation.telemetry.as_ref().and_then(&mut done) {
                return Ok(Some(found));
            }
            if self.machine.now() >= end {
                return Ok(None);
            }
            self.turn()?;
        }
    }

    /// As [`Guide::wait`], for as long as the person may take for a task.
    pub(super) fn wait_for_person<R>(
        &mut self,
        done: impl FnMut(&AnyTelemetry) -> Option<R>,
    ) -> Result<Option<R>, Stop> {
        self.wait(self.machine.patience(), done)
    }

    /// Waits until `holds`, for as long as the person may take; after that, the step is not passed for this reason.
    pub(super) fn need(
        &mut self,
        holds: impl Fn(&AnyTelemetry) -> bool,
        otherwise: &str,
    ) -> Result<(), Stop> {
        let held = self.wait_for_person(|now| holds(now).then_some(()))?;
        held.ok_or_else(|| Stop::Machine(otherwise.to_owned()))
    }

    /// Sends a request again and again until `done` holds.
    pub(super) fn request_until(
        &mut self,
        request: Request,
        done: impl Fn(&AnyTelemetry) -> bool,
    ) -> Result<(), Stop> {
        let end = self.machine.now() + self.machine.patience();
        while self.machine.now() < end {
            self.send(request);
            // Telemetry that arrives before the answer may date from before the request.
            self.pause(ANSWER)?;
            if self.wait(RETRY, |telemetry| done(telemetry).then_some(()))?.is_some() {
                return Ok(());
            }
        }
        Err(Stop::Machine(format!("the firmware refuses to go on: {}", self.refusal())))
    }

    /// Waits, and keeps listening.
    pub(super) fn pause(&mut self, time: Duration) -> Result<(), Stop> {
        self.wait(time, |_| None::<()>)?;
        Ok(())
    }

    /// The reasons of the last refusal, or the fault.
    pub(super) fn refusal(&self) -> String {
        if let Some(fault) = self.conversation.telemetry.as_ref().and_then(|telemetry| telemetry.fault) {
            return format!("fault {fault}");
        }
        match self.conversation.refusal {
            Some(Answer::NotNow(reasons)) => reasons.texts().collect::<Vec<_>>().join("; "),
            Some(Answer::Rejected(rejected)) => rejected.to_string(),
            _ => "no answer".to_owned(),
        }
    }

    /// Clears a fault once its cause is gone.
    pub(super) fn clear(&mut self) -> Result<(), Stop> {
        let is_clear = |telemetry: &AnyTelemetry| telemetry.state != State::Fault;
        if self.conversation.telemetry.as_ref().is_some_and(is_clear) {
            return Ok(());
        }
        self.request_until(Request::Clear, is_clear)
    }

    /// Turns the motor off, whatever is going on.
    pub(super) fn turn_off(&mut self) {
        self.send(Request::Disarm);
        // The line may be closed: then the firmware turns the motor off by itself.
        let _ = self.wait(OFF, |telemetry| (!telemetry.state.motor_is_on()).then_some(()));
    }
}
