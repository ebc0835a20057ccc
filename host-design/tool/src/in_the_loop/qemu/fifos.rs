//! FIFOs that the image opens as files.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command};

use rustix::fs::{Mode, OFlags};

use super::EmulatorError;
use super::channels::{Channels, NO_CHANNEL, spawn, wait};

/// Makes the FIFOs in `directory`, starts QEMU there, and waits until the image has opened them.
pub(super) fn open(
    command: Command,
    directory: &Path,
    image: &Path,
) -> Result<(Child, Channels), EmulatorError> {
    let no_channel = |error: rustix::io::Errno| EmulatorError::at(NO_CHANNEL)(error.into());
    let open = |name: &str, flags: OFlags| -> Result<File, EmulatorError> {
        make(&directory.join(name), flags).map_err(EmulatorError::at(NO_CHANNEL))
    };
    // Open for reading and writing, the first neither waits for the image nor fails without it. The other two must not
    // be open for writing here, so that their end of file is seen.
    let to_pins = open("pins.in", OFlags::RDWR)?;
    let from_pins = open("pins.out", OFlags::RDONLY | OFlags::NONBLOCK)?;
    let serial = open("serial.out", OFlags::RDONLY | OFlags::NONBLOCK)?;
    let mut process = spawn(command)?;
    wait(&mut process, image, || {
        // An empty FIFO blocks once the image has opened it for writing; before that it is at its end.
        match (&from_pins).read(&mut [0]) {
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => Some(()),
            _ => None,
        }
    })?;
    for channel in [&from_pins, &serial] {
        rustix::fs::fcntl_setfl(channel, OFlags::empty()).map_err(no_channel)?;
    }
    let channels =
        Channels { to_pins: Box::new(to_pins), from_pins: Box::new(from_pins), serial: Box::new(serial) };
    Ok((process, channels))
}

/// Makes a FIFO and opens it. The program `mkfifo` is on every Unix; the system call differs between them.
fn make(path: &Path, flags: OFlags) -> std::io::Result<File> {
    let status = Command::new("mkfifo").args(["-m", "600"]).arg(path).status()?;
    if !status.success() {
        return Err(std::io::Error::other(format!("mkfifo has failed: {status}")));
    }
    Ok(File::from(rustix::fs::open(path, flags | OFlags::CLOEXEC, Mode::empty())?))
}
