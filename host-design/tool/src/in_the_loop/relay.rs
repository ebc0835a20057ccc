//! The firmware's serial line over TCP, in real time: for a monitor without a board.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use upright::board::Output;
use upright_closed_loop::harness::{Flow, Participant, Target, World, until};
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
        let mut line = SocketLine {
            relay: &self,
            client: Some(self.first_client()?),
            begin: Instant::now(),
            failed: None,
        };
        let ticks = (self.scenario.duration_s / self.rig.tick.period_s).ceil() as usize;
        world.run(ticks, &mut [&mut line])?;
        line.failed.map_or(Ok(()), |error| Err(error.into()))
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

/// The line between the client and the firmware.
struct SocketLine<'a> {
    relay: &'a Relay<'a>,
    client: Option<TcpStream>,
    begin: Instant,
    /// Why no client can connect any more.
    failed: Option<std::io::Error>,
}

impl Participant for SocketLine<'_> {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) {
        if output.enable {
            world.hand.let_go();
        } else {
            world.hand.hold_in(&self.relay.scenario.start);
        }
        if self.client.is_none() {
            match accepted(self.relay.listener) {
                Ok(client) => self.client = client,
                Err(error) => self.failed = Some(error),
            }
        }
        match self.client.as_mut().map_or(Some(Vec::new()), receive) {
            Some(bytes) => world.session.send_bytes(&bytes),
            None => self.client = None,
        }
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        self.client.take_if(|stream| !send(stream, world.session.last_bytes()));
        let passed_s = world.ticks() as f64 * self.relay.rig.tick.period_s;
        let due = self.begin + Duration::from_secs_f64(passed_s);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        until(self.failed.is_some())
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
