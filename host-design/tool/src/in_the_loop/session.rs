//! A conversation with the firmware: commands with their answers, telemetry.

use std::collections::VecDeque;

use upright::board::{Inputs, Output};
use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{Answer, Command, Info, Message, PROTOCOL, Reply, Request, Telemetry};
use upright::protocol::serial_link::{MAX_COMMAND, MAX_MESSAGE};
use upright::protocol::simulated_pins::{PinsIn, Sabotage};
use upright::supervision::fault::Fault;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;

use super::target::{Target, TargetError};
use upright_design::simulate::Seen;

/// A firmware that does not do what it is asked for.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// It does not run.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// It does not answer within the ticks in which it has to.
    #[error("the firmware does not answer {0:?}")]
    NoAnswer(Request),
    /// It says no.
    #[error("the firmware does not follow {request:?}: {answer:?}")]
    Refused {
        /// What was asked for.
        request: Request,
        /// What it said.
        answer: Answer,
    },
    /// It never began to balance.
    #[error("the firmware does not begin to balance; its state is {0:?}")]
    NotBalancing(State),
    /// It speaks another language.
    #[error("the firmware speaks version {0} of the messages, this tool version {PROTOCOL}: build it again")]
    Protocol(u8),
    /// It was built for another rig.
    #[error(
        "the firmware was built for a rig with hash {found:016x}, this one has {wanted:016x}: build it again"
    )]
    Rig {
        /// Hash in the firmware.
        found: u64,
        /// Hash of the rig file.
        wanted: u64,
    },
}

/// Ticks in which every command is answered: its bytes are read after the tick they came with, it is taken in the next,
/// and the answer is heard with the one after.
const TICKS_TO_ANSWER: usize = 4;

/// A firmware in lock step, and what it said.
pub struct Session<'a, const NX: usize, const NY: usize> {
    target: &'a mut dyn Target<NY>,
    receiver: Receiver<MAX_MESSAGE>,
    serial: Vec<u8>,
    to_send: VecDeque<u8>,
    last_id: u64,
    sabotage: Option<Sabotage>,
    telemetry: VecDeque<Telemetry<NX, NY>>,
    replies: VecDeque<(u64, Answer)>,
    seen: Seen,
    fault: Option<Fault>,
    /// Frames from the firmware that could not be read.
    pub damaged: usize,
}

impl<'a, const NX: usize, const NY: usize> Session<'a, NX, NY> {
    /// A conversation with `target`, just started: its commands are numbered from 1.
    pub fn new(target: &'a mut dyn Target<NY>) -> Self {
        Self {
            target,
            receiver: Receiver::new(),
            serial: Vec::new(),
            to_send: VecDeque::new(),
            last_id: 0,
            sabotage: None,
            telemetry: VecDeque::new(),
            replies: VecDeque::new(),
            seen: Seen { state: State::Disarmed, signs: Signs::Unchecked },
            fault: None,
            damaged: 0,
        }
    }

    /// Sends a command with the next tick; gives its number.
    pub fn send(&mut self, request: Request) -> u64 {
        self.last_id += 1;
        let command = Command { id: self.last_id, request };
        let (mut scratch, mut out) = ([0; MAX_COMMAND], [0; MAX_COMMAND]);
        // Every command fits: a test of the messages says so.
        if let Ok(frame) = frame::encode(&command, &mut scratch, &mut out) {
            self.to_send.extend(frame);
        }
        self.last_id
    }

    /// Number of the last command.
    pub fn last_id(&self) -> u64 {
        self.last_id
    }

    /// Sends bytes that need not be a command with the next tick.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.to_send.extend(bytes);
    }

    /// Lets something go wrong inside the microcontroller in the next tick.
    pub fn sabotage(&mut self, sabotage: Sabotage) {
        self.sabotage = Some(sabotage);
    }

    /// One tick with these inputs.
    ///
    /// # Errors
    /// [`TargetError`] if the firmware does not answer.
    pub fn tick(&mut self, inputs: &Inputs<NY>) -> Result<Output, TargetError> {
        let mut pins = PinsIn::of(inputs);
        while !pins.received.is_full() {
            let Some(byte) = self.to_send.pop_front() else { break };
            // Not full.
            let _ = pins.received.push(byte);
        }
        pins.sabotage = self.sabotage.take();
        let output = self.target.tick(&pins, &mut self.serial)?;
        for byte in self.serial.drain(..) {
            match self.receiver.push::<Message<NX, NY>>(byte) {
                Some(Ok(Message::Telemetry(telemetry))) => {
                    self.fault = telemetry.fault;
                    self.seen = Seen { state: telemetry.state, signs: telemetry.signs };
                    self.telemetry.push_back(telemetry);
                }
                Some(Ok(Message::Reply(Reply { id, answer }))) => self.replies.push_back((id, answer)),
                Some(Err(_)) => self.damaged += 1,
                None => (),
            }
        }
        Ok(output)
    }

    /// The latched fault, as last heard.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// What a person at the rig has last seen of the firmware.
    pub fn seen(&self) -> Seen {
        self.seen
    }

    /// The oldest telemetry that was not yet looked at.
    pub fn next_telemetry(&mut self) -> Option<Telemetry<NX, NY>> {
        self.telemetry.pop_front()
    }

    /// The oldest answer that was not yet looked at, with the number of its command.
    pub fn next_reply(&mut self) -> Option<(u64, Answer)> {
        self.replies.pop_front()
    }

    /// Sends a command and lets ticks with these inputs pass until it is answered.
    ///
    /// # Errors
    /// [`SessionError`] if it is refused or not answered.
    pub fn ask(&mut self, request: Request, inputs: &Inputs<NY>) -> Result<Answer, SessionError> {
        let id = self.send(request);
        for _ in 0..TICKS_TO_ANSWER {
            self.tick(inputs)?;
            if let Some(answer) = self.answer_to(id, request)? {
                return Ok(answer);
            }
        }
        Err(SessionError::NoAnswer(request))
    }

    fn answer_to(&mut self, id: u64, request: Request) -> Result<Option<Answer>, SessionError> {
        while let Some((answered, answer)) = self.next_reply() {
            match answer {
                _ if answered != id => (),
                Answer::NotNow(_) | Answer::Rejected(_) => {
                    return Err(SessionError::Refused { request, answer });
                }
                answer => return Ok(Some(answer)),
            }
        }
        Ok(None)
    }

    /// Asks who is there, and checks that it is the firmware for the rig with this hash.
    ///
    /// # Errors
    /// [`SessionError`] if it is another one, or silent.
    pub fn meet(&mut self, rig_hash: u64, inputs: &Inputs<NY>) -> Result<Info, SessionError> {
        match self.ask(Request::Info, inputs)? {
            Answer::Info(info) if info.protocol != PROTOCOL => Err(SessionError::Protocol(info.protocol)),
            Answer::Info(info) if info.rig_hash != rig_hash => {
                Err(SessionError::Rig { found: info.rig_hash, wanted: rig_hash })
            }
            Answer::Info(info) => Ok(info),
            answer => Err(SessionError::Refused { request: Request::Info, answer }),
        }
    }
}
