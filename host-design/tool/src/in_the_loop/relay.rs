//! The firmware's serial line over TCP, in real time: for a monitor without a board.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use upright::board::Output;
use upright_closed_loop::harness::{BeforeMotion, Target, World, until};
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
        let mut world = World::new(self.rig, self.table, self.scenario, target)?;
        // No set-point is commanded, so the firmware needs no keep-alives.
        world.raise(None)?;
        self.listener.set_nonblocking(true)?;
        let (period_s, mut client, mut failed) = (self.rig.tick.period_s, Some(self.first_client()?), None);
        let begin = Instant::now();
        let mut line = BeforeMotion(|world: &mut World<'_>, output: &mut Output| {
            client.take_if(|stream| !send(stream, world.session.last_bytes()));
            let due = begin + Duration::from_secs_f64(world.ticks() as f64 * period_s);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            if output.enable {
                world.hand.let_go();
            } else {
                world.hand.hold_in(&self.scenario.start);
            }
            if client.is_none() {
                client = accepted(self.listener).unwrap_or_else(|error| {
                    failed = Some(error);
                    None
                });
            }
            match client.as_mut().map_or(Some(Vec::new()), receive) {
                Some(bytes) => world.session.send_bytes(&bytes),
                None => client = None,
            }
            until(failed.is_some())
        });
        world.run((self.scenario.duration_s / period_s).ceil() as usize, &mut [&mut line])?;
        failed.map_or(Ok(()), |error| Err(error.into()))
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
