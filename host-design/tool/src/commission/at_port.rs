//! The real machine behind a port, and the person at the terminal.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use super::machine::{MachineAtHand, Stop};
use super::step::CommissionStep;
use super::task::PersonTask;
use crate::monitor::{SerialLine, now};

/// How long a person may take for a task.
const PATIENCE: Duration = Duration::from_secs(180);

/// A machine behind a port. The journal shows what the person is asked to do; the person's answers arrive as lines.
pub struct AtPort {
    line: SerialLine,
    said: Receiver<String>,
    /// Whether the person has asked to stop.
    stop: Arc<AtomicBool>,
    show: Box<dyn FnMut(&str)>,
}

impl AtPort {
    /// The machine behind `line`, with the lines that the person types. `stop` is set when everything has to end,
    /// `show` is for what the person has to read.
    pub fn new(
        line: SerialLine,
        said: Receiver<String>,
        stop: Arc<AtomicBool>,
        show: Box<dyn FnMut(&str)>,
    ) -> Self {
        Self { line, said, stop, show }
    }

    /// Shows `words`, and waits for the person's answer.
    ///
    /// # Errors
    /// [`Stop::Aborted`] if the person wants to stop or nobody is there, [`Stop::Line`] if the line is closed.
    pub fn consent(&mut self, words: &str) -> Result<String, Stop> {
        // What was typed before is no answer to this.
        while self.said.try_recv().is_ok() {}
        (self.show)(words);
        loop {
            match self.said.try_recv() {
                Ok(said) => return Ok(said),
                Err(TryRecvError::Disconnected) => return Err(Stop::Aborted),
                // The firmware keeps sending; what it sends meanwhile is out of date when the person answers.
                Err(TryRecvError::Empty) => self.exchange(&[])?,
            };
        }
    }
}

impl MachineAtHand for AtPort {
    fn exchange(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Stop> {
        // Reported only once: the motor still has to be turned off through this line.
        if self.stop.swap(false, Ordering::Relaxed) {
            return Err(Stop::Aborted);
        }
        let mut buffer = [0; 4096];
        let closed = |error: io::Error| {
            Stop::Line(format!("the connection is closed: {error}; start upright commission again"))
        };
        Ok(self.line.exchange(bytes, &mut buffer).map_err(closed)?.to_vec())
    }

    fn now(&self) -> Duration {
        now()
    }

    fn ask(&mut self, task: PersonTask) -> Result<(), Stop> {
        if task.needs_consent() {
            self.consent("    Enter when you are ready; Ctrl-C stops")?;
        }
        Ok(())
    }

    fn patience(&self) -> Duration {
        PATIENCE
    }

    fn again(&mut self, _: CommissionStep, back: CommissionStep) -> bool {
        let words = format!("    r and Enter: back to {}; only Enter: stop", back.name());
        self.consent(&words).is_ok_and(|said| said.trim() == "r")
    }
}
