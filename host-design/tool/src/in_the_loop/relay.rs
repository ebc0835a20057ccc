//! The firmware's serial line over TCP, in real time: for a monitor without a board.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use upright_closed_loop::harness::{Harness, Target};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;

use super::error::RunError;
use super::place::RunPlace;

/// Runs the firmware of `table` with the plant of `rig` for the duration of `scenario`, in real time from the first
/// client on, and passes the bytes of its serial line to and from whoever is connected to `listener`, one at a time.
///
/// Before that, the simulated hand has homed, checked and raised the rig, and balancing has begun. While the motor is
/// off, the hand holds the rig at the scenario's start, so that it can be armed again.
///
/// # Errors
/// [`RunError`] if the firmware does not run, the socket fails, or no client connects within the duration of the
/// run.
pub fn serve(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    place: RunPlace<'_>,
    listener: &TcpListener,
) -> Result<(), RunError> {
    place.with_target(table, |target| Relay { rig, table, scenario, listener }.run(target))
}

struct Relay<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    scenario: &'a Scenario,
    listener: &'a TcpListener,
}

impl Relay<'_> {
    fn run(self, target: &mut dyn Target) -> Result<(), RunError> {
        let period_s = self.rig.tick.period_s;
        let mut harness = Harness::new(self.rig, self.table, self.scenario, target)?;
        // No set-point is commanded, so the firmware needs no keep-alives.
        let mut output = harness.raise(None)?;
        self.listener.set_nonblocking(true)?;
        let mut client = Some(self.first_client()?);
        let begin = Instant::now();
        let mut tick = 0u32;
        while f64::from(tick) * period_s < self.scenario.duration_s {
            if output.enable {
                harness.bench.tick(output.drive);
            } else {
                harness.bench.hold(&self.scenario.start);
            }
            if client.is_none() {
                client = accepted(self.listener)?;
            }
            let received = client.as_mut().map_or(Some(Vec::new()), receive);
            harness.session.send_bytes(received.as_deref().unwrap_or(&[]));
            let inputs = harness.inputs();
            output = harness.session.tick(&inputs)?;
            harness.session.forget_received();
            let is_connected =
                client.as_mut().is_none_or(|stream| send(stream, harness.session.last_bytes()));
            if received.is_none() || !is_connected {
                client = None;
            }
            tick += 1;
            let due = begin + Duration::from_secs_f64(f64::from(tick) * period_s);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        Ok(())
    }

    /// Waits for the first client, as long as the run would last.
    fn first_client(&self) -> std::io::Result<TcpStream> {
        let begin = Instant::now();
        loop {
            if let Some(client) = accepted(self.listener)? {
                return Ok(client);
            }
            if begin.elapsed().as_secs_f64() > self.scenario.duration_s {
                return Err(ErrorKind::TimedOut.into());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// A client that waits to be connected, if there is one.
fn accepted(listener: &TcpListener) -> std::io::Result<Option<TcpStream>> {
    match listener.accept() {
        Ok((stream, _)) => {
            stream.set_nonblocking(true)?;
            Ok(Some(stream))
        }
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(None),
        Err(error) => Err(error),
    }
}

/// Bytes received from the client; `None` if it has disconnected.
fn receive(stream: &mut TcpStream) -> Option<Vec<u8>> {
    let mut buffer = [0; 256];
    match stream.read(&mut buffer) {
        Ok(0) => None,
        Ok(length) => Some(buffer[..length].to_vec()),
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
            Some(Vec::new())
        }
        Err(_) => None,
    }
}

/// Sends to the client; returns whether it is still connected. As on a serial line, bytes that it does not take in
/// time are lost.
fn send(stream: &mut TcpStream, mut bytes: &[u8]) -> bool {
    while !bytes.is_empty() {
        match stream.write(bytes) {
            Ok(0) => return false,
            Ok(length) => bytes = &bytes[length..],
            Err(error) if error.kind() == ErrorKind::WouldBlock => return true,
            Err(error) if error.kind() == ErrorKind::Interrupted => (),
            Err(_) => return false,
        }
    }
    true
}
