//! The connections to a running emulator.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use super::EmulatorError;

/// Longest wait for the image to connect to its pins, which takes a fraction of a second on an idle computer.
const START: Duration = Duration::from_secs(120);
/// The step that has failed if a channel cannot be opened.
pub(super) const NO_CHANNEL: &str = "no channel to it";

/// The channels of the pins, both ways, and the serial line from the firmware.
pub(super) struct Channels {
    pub(super) to_pins: Box<dyn Write>,
    pub(super) from_pins: Box<dyn Read>,
    pub(super) serial: Box<dyn Read>,
}

pub(super) fn spawn(mut command: Command) -> Result<Child, EmulatorError> {
    command.spawn().map_err(|source| match source.kind() {
        std::io::ErrorKind::NotFound => EmulatorError::Missing,
        _ => EmulatorError::at("cannot be started")(source),
    })
}

/// Sockets of this machine that QEMU connects to its serial lines.
pub(super) fn serial_lines(mut command: Command, image: &Path) -> Result<(Child, Channels), EmulatorError> {
    let no_channel = || EmulatorError::at(NO_CHANNEL);
    let mut listen = || -> std::io::Result<TcpListener> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        command.arg("-serial").arg(format!("tcp:{},nodelay=on", listener.local_addr()?));
        Ok(listener)
    };
    let (pins, serial) = (listen().map_err(no_channel())?, listen().map_err(no_channel())?);
    let mut process = spawn(command)?;
    let mut accept = |listener: &TcpListener| -> Result<TcpStream, EmulatorError> {
        let stream = wait(&mut process, image, || listener.accept().ok().map(|(stream, _)| stream))?;
        stream.set_nodelay(true).map_err(no_channel())?;
        Ok(stream)
    };
    let (mut pins, serial) = (accept(&pins)?, accept(&serial)?);
    pins.set_nonblocking(true).map_err(no_channel())?;
    // The image sends its first byte once its receiver is on.
    wait(&mut process, image, || pins.read(&mut [0]).ok().filter(|&length| length == 1))?;
    pins.set_nonblocking(false).map_err(no_channel())?;
    serial.set_nonblocking(false).map_err(no_channel())?;
    let to_pins = pins.try_clone().map_err(no_channel())?;
    let channels =
        Channels { to_pins: Box::new(to_pins), from_pins: Box::new(pins), serial: Box::new(serial) };
    Ok((process, channels))
}

/// Waits until `done` detects something that the image does at its start.
pub(super) fn wait<T>(
    process: &mut Child,
    image: &Path,
    mut done: impl FnMut() -> Option<T>,
) -> Result<T, EmulatorError> {
    let begin = Instant::now();
    loop {
        if let Some(result) = done() {
            return Ok(result);
        }
        let ended = matches!(process.try_wait(), Ok(Some(_)));
        if ended || begin.elapsed() > START {
            let _ = process.kill();
            let _ = process.wait();
            return Err(EmulatorError::Silent(image.to_owned()));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
