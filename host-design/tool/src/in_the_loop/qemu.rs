//! The image in QEMU: pins and serial line as files of the emulator, or as serial lines.

mod answer_limit;
mod channels;
mod error;
#[cfg(unix)]
mod fifos;

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tempfile::TempDir;
use upright::board::Output;
use upright::protocol::frame::{self, Receiver};
use upright::protocol::simulated_pins::{MAX_PINS_IN, MAX_PINS_OUT, PinsOut};
use upright_closed_loop::harness::{HarnessError, Pins, Target};

use answer_limit::{AnswerLimit, LONGEST};
use channels::{Channels, serial_lines};
pub use error::EmulatorError;

/// The emulated board: an STM32F405.
const MACHINE: &str = "netduinoplus2";
const PROGRAM: &str = "qemu-system-arm";

/// How the pins of the image are connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinLink {
    /// Files of the emulator (semihosting): the image with the feature `in-the-loop`. They are FIFOs, which only Unix
    /// has.
    Files,
    /// Serial lines: the image with the feature `in-the-loop-usart`.
    Usart,
}

/// An image that runs in QEMU. Dropping it ends the emulator.
pub struct Emulator {
    process: Arc<Mutex<Child>>,
    limit: AnswerLimit,
    channels: Channels,
    receiver: Receiver<MAX_PINS_OUT>,
    /// Bytes read from the serial line so far.
    received: u32,
    _directory: TempDir,
}

impl Emulator {
    /// Starts QEMU with the `image` and waits until it has opened its pins.
    ///
    /// # Errors
    /// [`EmulatorError`] if QEMU is missing, or the image is not one for the loop.
    pub fn start(image: &Path, link: PinLink) -> Result<Self, EmulatorError> {
        let directory = tempfile::tempdir().map_err(EmulatorError::at("no directory for its files"))?;
        let mut command = Command::new(PROGRAM);
        // One instruction is one nanosecond, and idle time is skipped: the same run every time.
        command.args(["-machine", MACHINE, "-nographic", "-monitor", "none", "-icount", "shift=0,sleep=off"]);
        command.args(["-semihosting-config", "enable=on,target=native"]).arg("-kernel");
        command.arg(std::path::absolute(image).map_err(EmulatorError::at("no such image"))?);
        command.current_dir(directory.path());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let (process, channels) = match link {
            #[cfg(unix)]
            PinLink::Files => fifos::open(command, directory.path(), image)?,
            #[cfg(not(unix))]
            PinLink::Files => return Err(EmulatorError::NeedsUnix),
            PinLink::Usart => serial_lines(command, image)?,
        };
        let process = Arc::new(Mutex::new(process));
        let limit = AnswerLimit::of(&process, LONGEST);
        Ok(Self { process, limit, channels, receiver: Receiver::new(), received: 0, _directory: directory })
    }

    fn process(&self) -> MutexGuard<'_, Child> {
        // The process is as it is, whatever panicked.
        self.process.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The error for an image that has ended, or is ended because it does not answer, with what QEMU printed.
    fn stopped(&self) -> HarnessError {
        let mut process = self.process();
        let _ = process.kill();
        let status = process.wait().ok().and_then(|status| status.code()).unwrap_or(-1);
        let mut message = String::new();
        if let Some(mut errors) = process.stderr.take() {
            let _ = errors.read_to_string(&mut message);
        }
        let message = message.trim();
        HarnessError::Stopped {
            status,
            message: if message.is_empty() { String::new() } else { format!(": {message}") },
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // The image may wait inside the emulator, which then does not react to anything else.
        let mut process = self.process();
        let _ = process.kill();
        let _ = process.wait();
    }
}

impl Target for Emulator {
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError> {
        let (mut scratch, mut out) = ([0; MAX_PINS_IN], [0; MAX_PINS_IN]);
        let frame = frame::encode(pins, &mut scratch, &mut out)?;
        self.limit.exchange();
        if self.channels.to_pins.write_all(frame).and_then(|()| self.channels.to_pins.flush()).is_err() {
            return Err(self.stopped());
        }
        let mut buffer = [0; 64];
        let PinsOut { output, sent } = loop {
            let length = match self.channels.from_pins.read(&mut buffer) {
                Ok(length) if length > 0 => length,
                _ => return Err(self.stopped()),
            };
            // The image answers once per tick: nothing follows the end of the frame.
            let message = buffer[..length].iter().find_map(|&byte| self.receiver.push::<PinsOut>(byte));
            if let Some(message) = message {
                break message?;
            }
        };
        let begin = serial.len();
        serial.resize(begin + sent.wrapping_sub(self.received) as usize, 0);
        self.received = sent;
        if self.channels.serial.read_exact(&mut serial[begin..]).is_err() {
            return Err(self.stopped());
        }
        self.limit.exchange();
        Ok(output)
    }
}
