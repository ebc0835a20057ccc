//! A conversation with the firmware: commands with their answers, telemetry.

use std::collections::VecDeque;
use std::time::Duration;

use upright::board::Output;
use upright::protocol::message::{Answer, Info, Request};
use upright::protocol::simulated_pins::InjectedFault;
use upright::supervision::fault::Fault;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;

use super::error::HarnessError;
use super::operator::Status;
use super::target::{Pace, Pins, Target};
use crate::client::{AnyTelemetry, AnyTickLog, Client, ExpectedRig, Mismatch, Received};

/// Commands are numbered from 1, not by the time.
const NOW: Duration = Duration::ZERO;

/// A firmware in lock step, and what it has sent.
pub struct Session<'a> {
    target: &'a mut dyn Target,
    client: Client,
    serial: Vec<u8>,
    to_send: VecDeque<u8>,
    injected_fault: Option<InjectedFault>,
    telemetry: VecDeque<AnyTelemetry>,
    replies: VecDeque<(u64, Answer)>,
    logs: VecDeque<AnyTickLog>,
    status: Status,
    fault: Option<Fault>,
    /// The tick of that fault.
    cause_tick: u32,
    ticks: u32,
}

impl<'a> Session<'a> {
    /// A conversation with `target`, just started: its commands are numbered from 1.
    pub fn new(target: &'a mut dyn Target) -> Self {
        Self {
            target,
            client: Client::default(),
            serial: Vec::new(),
            to_send: VecDeque::new(),
            injected_fault: None,
            telemetry: VecDeque::new(),
            replies: VecDeque::new(),
            logs: VecDeque::new(),
            status: Status { state: State::Disarmed, signs: Signs::Unchecked, motor: MotorSign::Unchecked },
            fault: None,
            cause_tick: 0,
            ticks: 0,
        }
    }

    /// Queues a command for the next tick and returns its number.
    pub fn send(&mut self, request: Request) -> u64 {
        let id = self.client.send_once(request, NOW);
        self.to_send.extend(self.client.take_outgoing());
        id
    }

    /// Numbers the next commands from above `id`, because somebody else has sent commands with numbers up to it.
    pub fn count_from(&mut self, id: u64) {
        self.client.count_from(id);
    }

    /// Delays of the firmware's serial line.
    pub fn pace(&self) -> Pace {
        self.target.pace()
    }

    /// Number of the last tick, counted from 0 at the start of the firmware.
    pub fn tick_number(&self) -> u32 {
        self.ticks.wrapping_sub(1)
    }

    /// Number of the last command.
    pub fn last_id(&self) -> u64 {
        self.client.last_id()
    }

    /// Queues bytes for the next tick; they need not be a command.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.to_send.extend(bytes);
    }

    /// Injects a fault inside the microcontroller in the next tick.
    pub fn injected_fault(&mut self, injected_fault: InjectedFault) {
        self.injected_fault = Some(injected_fault);
    }

    /// Runs one tick with these inputs and collects what the firmware has sent.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer.
    pub fn tick(&mut self, inputs: &Pins) -> Result<Output, HarnessError> {
        let mut pins = inputs.clone();
        while !pins.received.is_full() {
            let Some(byte) = self.to_send.pop_front() else { break };
            // Cannot fail: the loop has checked that there is room.
            let _ = pins.received.push(byte);
        }
        pins.injected_fault = self.injected_fault.take();
        self.serial.clear();
        let output = self.target.tick(&pins, &mut self.serial)?;
        self.ticks = self.ticks.wrapping_add(1);
        for &byte in &self.serial {
            match self.client.receive(byte, NOW) {
                Some(Received::Telemetry(telemetry)) => {
                    (self.fault, self.cause_tick) = (telemetry.fault, telemetry.cause_tick);
                    let AnyTelemetry { state, signs, motor, .. } = telemetry;
                    self.status = Status { state, signs, motor };
                    self.telemetry.push_back(telemetry);
                }
                Some(Received::Answer { id, answer, .. }) => self.replies.push_back((id, answer)),
                Some(Received::Log(log)) => self.logs.push_back(log),
                None => (),
            }
        }
        Ok(output)
    }

    /// Forgets what was received: somebody else reads the bytes.
    pub fn forget_received(&mut self) {
        self.telemetry.clear();
        self.replies.clear();
        self.logs.clear();
    }

    /// Bytes on the serial line that came with the last tick.
    pub fn last_bytes(&self) -> &[u8] {
        &self.serial
    }

    /// Stops reading the firmware's serial line.
    ///
    /// # Errors
    /// [`HarnessError::Unsupported`] unless the firmware runs in this process.
    pub fn stop_reading(&mut self) -> Result<(), HarnessError> {
        self.target.stop_reading()
    }

    /// The latched fault according to the last telemetry.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Number of ticks since the latched fault, according to the last telemetry; `None` without one, and if the
    /// firmware has restarted since.
    pub fn ticks_since_fault(&self) -> Option<usize> {
        let since = self.ticks.wrapping_sub(1).wrapping_sub(self.cause_tick);
        // No telemetry is on its way for longer.
        let latest = u32::from(self.pace().telemetry_ticks) + 4;
        self.fault.filter(|_| since <= latest).map(|_| since as usize)
    }

    /// What the last telemetry says about the firmware.
    pub fn status(&self) -> Status {
        self.status
    }

    /// Takes the oldest telemetry that was not yet taken.
    pub fn next_telemetry(&mut self) -> Option<AnyTelemetry> {
        self.telemetry.pop_front()
    }

    /// Takes the oldest part of the tick log that was not yet taken.
    pub fn next_log(&mut self) -> Option<AnyTickLog> {
        self.logs.pop_front()
    }

    /// Takes the oldest answer that was not yet taken, with the number of its command.
    pub fn next_reply(&mut self) -> Option<(u64, Answer)> {
        self.replies.pop_front()
    }

    /// Sends a command and runs ticks with these inputs until it is answered.
    ///
    /// # Errors
    /// [`HarnessError`] if it is refused or not answered.
    pub fn ask(&mut self, request: Request, inputs: &Pins) -> Result<Answer, HarnessError> {
        let id = self.send(request);
        for _ in 0..self.pace().answer_ticks {
            self.tick(inputs)?;
            if let Some(answer) = self.answer_to(id, request)? {
                return Ok(answer);
            }
        }
        Err(HarnessError::NoAnswer(request))
    }

    fn answer_to(&mut self, id: u64, request: Request) -> Result<Option<Answer>, HarnessError> {
        while let Some((answered, answer)) = self.next_reply() {
            match answer {
                _ if answered != id => (),
                Answer::NotNow(_) | Answer::Rejected(_) => {
                    return Err(HarnessError::Refused { request, answer });
                }
                answer => return Ok(Some(answer)),
            }
        }
        Ok(None)
    }

    /// Asks for the firmware's identity, and checks that it was built for the rig `wanted`.
    ///
    /// # Errors
    /// [`HarnessError`] if it is for another rig, or does not answer.
    pub fn check_info(&mut self, wanted: ExpectedRig, inputs: &Pins) -> Result<Info, HarnessError> {
        match self.ask(Request::Info, inputs)? {
            Answer::Info(info) => Ok(Mismatch::check(&info, wanted).map(|()| info)?),
            answer => Err(HarnessError::Refused { request: Request::Info, answer }),
        }
    }
}
