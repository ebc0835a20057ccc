//! The image in QEMU: pins and serial line as FIFOs in a directory of their own, or as serial lines.

use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};
use tempfile::TempDir;
use upright::board::Output;
use upright::protocol::frame::{self, Receiver};
use upright::protocol::simulated_pins::{MAX_PINS_IN, MAX_PINS_OUT, PinsIn, PinsOut};

use super::target::{Target, TargetError};

/// The emulated board: an STM32F405.
const MACHINE: &str = "netduinoplus2";
const PROGRAM: &str = "qemu-system-arm";
/// Longest wait for the image's first sign of life.
const START: Duration = Duration::from_secs(20);

/// What the pins of the image are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Link {
    /// Files of the emulator (semihosting): the image with the feature `in-the-loop`.
    Files,
    /// Serial lines: the image with the feature `in-the-loop-usart`.
    Usart,
}

/// An image that runs in QEMU. Dropping it ends the emulator.
pub struct Emulator {
    process: Child,
    wires: Wires,
    receiver: Receiver<MAX_PINS_OUT>,
    /// Bytes read from the serial line.
    heard: u32,
    _directory: TempDir,
}

struct Wires {
    to_pins: Box<dyn Write>,
    from_pins: Box<dyn Read>,
    serial: Box<dyn Read>,
}

impl Emulator {
    /// Starts QEMU with the `image` and waits until its pins are there.
    ///
    /// # Errors
    /// [`TargetError`] if QEMU is missing, or the image is not one for the loop.
    pub fn start(image: &Path, link: Link) -> Result<Self, TargetError> {
        let directory = tempfile::tempdir().map_err(failed("no directory for its channels"))?;
        let mut command = Command::new(PROGRAM);
        // One instruction is one nanosecond, and idle time is skipped: the same run every time.
        command.args(["-machine", MACHINE, "-nographic", "-monitor", "none", "-icount", "shift=0,sleep=off"]);
        command.args(["-semihosting-config", "enable=on,target=native"]).arg("-kernel");
        command.arg(std::path::absolute(image).map_err(failed("no such image"))?);
        command.current_dir(directory.path());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let (process, wires) = match link {
            Link::Files => files(command, directory.path(), image)?,
            Link::Usart => usart(command, directory.path(), image)?,
        };
        Ok(Self { process, wires, receiver: Receiver::new(), heard: 0, _directory: directory })
    }

    fn stopped(&mut self) -> TargetError {
        let _ = self.process.kill();
        let status = self.process.wait().ok().and_then(|status| status.code()).unwrap_or(-1);
        let mut said = String::new();
        if let Some(mut errors) = self.process.stderr.take() {
            let _ = errors.read_to_string(&mut said);
        }
        let said = said.trim();
        TargetError::Stopped {
            status,
            said: if said.is_empty() { String::new() } else { format!(": {said}") },
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // The image may wait inside the emulator, which then hears nothing but this.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl<const NY: usize> Target<NY> for Emulator {
    fn tick(&mut self, pins: &PinsIn<NY>, serial: &mut Vec<u8>) -> Result<Output, TargetError> {
        let (mut scratch, mut out) = ([0; MAX_PINS_IN], [0; MAX_PINS_IN]);
        let frame = frame::encode(pins, &mut scratch, &mut out)?;
        if self.wires.to_pins.write_all(frame).and_then(|()| self.wires.to_pins.flush()).is_err() {
            return Err(self.stopped());
        }
        let mut buffer = [0; 64];
        let PinsOut { output, sent } = loop {
            let length = match self.wires.from_pins.read(&mut buffer) {
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
        serial.resize(begin + sent.wrapping_sub(self.heard) as usize, 0);
        self.heard = sent;
        if self.wires.serial.read_exact(&mut serial[begin..]).is_err() {
            return Err(self.stopped());
        }
        Ok(output)
    }
}

fn failed(what: &'static str) -> impl FnOnce(std::io::Error) -> TargetError {
    move |source| TargetError::Emulator { what, source }
}

fn spawn(mut command: Command) -> Result<Child, TargetError> {
    command.spawn().map_err(|source| match source.kind() {
        std::io::ErrorKind::NotFound => TargetError::NoEmulator,
        _ => TargetError::Emulator { what: "cannot be started", source },
    })
}

/// FIFOs that the image opens as files.
fn files(command: Command, directory: &Path, image: &Path) -> Result<(Child, Wires), TargetError> {
    let open = |name: &str, flags: OFlags| -> Result<File, TargetError> {
        let path = directory.join(name);
        let failed = |source: rustix::io::Errno| TargetError::Emulator {
            what: "no channel to it",
            source: source.into(),
        };
        rustix::fs::mknodat(rustix::fs::CWD, &path, rustix::fs::FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)
            .map_err(failed)?;
        Ok(File::from(rustix::fs::open(&path, flags | OFlags::CLOEXEC, Mode::empty()).map_err(failed)?))
    };
    // Open for both, the first neither waits for the image nor fails without it. The other two must not be open for
    // writing here: their end has to be seen.
    let to_pins = open("pins.in", OFlags::RDWR)?;
    let from_pins = open("pins.out", OFlags::RDONLY | OFlags::NONBLOCK)?;
    let serial = open("serial.out", OFlags::RDONLY | OFlags::NONBLOCK)?;
    let mut process = spawn(command)?;
    wait(&mut process, image, || {
        // An empty FIFO that somebody has open for writing would block; before that it is at its end.
        match (&from_pins).read(&mut [0]) {
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => Some(()),
            _ => None,
        }
    })?;
    for channel in [&from_pins, &serial] {
        rustix::fs::fcntl_setfl(channel, OFlags::empty())
            .map_err(|error| failed("no channel to it")(error.into()))?;
    }
    let wires =
        Wires { to_pins: Box::new(to_pins), from_pins: Box::new(from_pins), serial: Box::new(serial) };
    Ok((process, wires))
}

/// Unix sockets that QEMU connects to its serial lines.
fn usart(mut command: Command, directory: &Path, image: &Path) -> Result<(Child, Wires), TargetError> {
    let listen = |name: &str| -> Result<UnixListener, TargetError> {
        let listener = UnixListener::bind(directory.join(name)).map_err(failed("no channel to it"))?;
        listener.set_nonblocking(true).map_err(failed("no channel to it"))?;
        Ok(listener)
    };
    let (pins, serial) = (listen("pins")?, listen("serial")?);
    command.args(["-serial", "unix:pins", "-serial", "unix:serial"]);
    let mut process = spawn(command)?;
    let accept = |process: &mut Child, listener: &UnixListener| -> Result<UnixStream, TargetError> {
        wait(process, image, || listener.accept().ok().map(|(stream, _)| stream))
    };
    let (mut pins, serial) = (accept(&mut process, &pins)?, accept(&mut process, &serial)?);
    pins.set_nonblocking(true).map_err(failed("no channel to it"))?;
    // The image's receiver is on when its first byte comes.
    wait(&mut process, image, || pins.read(&mut [0]).ok().filter(|&length| length == 1))?;
    pins.set_nonblocking(false).map_err(failed("no channel to it"))?;
    serial.set_nonblocking(false).map_err(failed("no channel to it"))?;
    let to_pins = pins.try_clone().map_err(failed("no channel to it"))?;
    let wires = Wires { to_pins: Box::new(to_pins), from_pins: Box::new(pins), serial: Box::new(serial) };
    Ok((process, wires))
}

/// Waits for something that the image does at its start.
fn wait<T>(process: &mut Child, image: &Path, mut done: impl FnMut() -> Option<T>) -> Result<T, TargetError> {
    let begin = Instant::now();
    loop {
        if let Some(result) = done() {
            return Ok(result);
        }
        let ended = matches!(process.try_wait(), Ok(Some(_)));
        if ended || begin.elapsed() > START {
            let _ = process.kill();
            let _ = process.wait();
            return Err(TargetError::Silent(image.to_owned()));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
