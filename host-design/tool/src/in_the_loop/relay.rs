//! The firmware's serial line over TCP, in real time: for a monitor without a board.

use std::cell::RefCell;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use upright::board::Output;
use upright::protocol::simulated_pins::PinsIn;

use super::in_process::{InProcess, Queues};
use super::qemu::Emulator;
use super::run::{RunError, Where};
use super::session::{Session, SessionError};
use super::stage::Stage;
use super::target::{Target, TargetError};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, SimulationError};
use upright_design::table::{TableValues, WithSize, with_firmware_size};

/// A relay that has ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum RelayError {
    /// The firmware or the rig.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The listening socket.
    #[error("nobody can connect: {0}")]
    Socket(#[from] std::io::Error),
}

/// Longest time in which a hand homes, checks and raises the rig (s).
const LONGEST_WAIT_S: f64 = 60.0;

/// Runs the firmware of `table` with the plant of `rig` for the duration of `scenario`, in real time from the first
/// client on, and passes the bytes of its serial line to and from whoever is connected to `listener`, one at a time.
///
/// A hand has homed, checked and raised the rig before, and balancing has begun. Whenever the motor is off, the hand
/// holds the rig at the scenario's start, so that it can be armed again.
///
/// # Errors
/// [`RelayError`] if the firmware does not run, the socket fails, or nobody connects for as long as the run would last.
pub fn serve(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    place: Where<'_>,
    listener: &TcpListener,
) -> Result<(), RelayError> {
    let (states, sensors) = (table.states, table.sensors);
    with_firmware_size(states, sensors, Relay { rig, table, scenario, place, listener })
        .ok_or_else(|| RunError::from(SimulationError::Size { states, sensors }))?
}

struct Relay<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    scenario: &'a Scenario,
    place: Where<'a>,
    listener: &'a TcpListener,
}

impl WithSize for Relay<'_> {
    type Output = Result<(), RelayError>;

    fn run<const NX: usize, const NY: usize>(self) -> Self::Output {
        match self.place {
            Where::Host => {
                let (table, mut queues) = (self.table.table::<NX, NY>(), Queues::default());
                let mut target = InProcess::<NX, NY>::new(&mut queues, &table, &self.table.build())
                    .map_err(RunError::from)?;
                self.with::<NX, NY>(&mut target)
            }
            Where::Qemu { image, link } => {
                let mut target = Emulator::start(image, link).map_err(RunError::from)?;
                self.with::<NX, NY>(&mut target)
            }
        }
    }
}

impl Relay<'_> {
    fn with<const NX: usize, const NY: usize>(self, target: &mut dyn Target<NY>) -> Result<(), RelayError> {
        let said = RefCell::new(Vec::new());
        let mut tap = Tap { target, said: &said };
        let mut stage = Stage::<NX, NY>::new(self.rig, self.table, self.scenario, Session::new(&mut tap))?;
        let mut output = raise(&mut stage, self.rig.tick.period_s)?;
        self.listener.set_nonblocking(true)?;
        let mut client = Some(self.first_client()?);
        said.borrow_mut().clear();
        let begin = Instant::now();
        let mut tick = 0u32;
        while f64::from(tick) * self.rig.tick.period_s < self.scenario.duration_s {
            if output.enable {
                stage.bench.tick(output.drive);
            } else {
                stage.bench.hold(&self.scenario.start);
            }
            if client.is_none() {
                client = accepted(self.listener)?;
            }
            let heard = client.as_mut().map_or(Some(Vec::new()), heard);
            stage.session.send_bytes(heard.as_deref().unwrap_or(&[]));
            output = stage.session.tick(&stage.inputs()).map_err(RunError::from)?;
            while stage.session.next_telemetry().is_some() || stage.session.next_reply().is_some() {}
            let told = client.as_mut().is_none_or(|stream| told(stream, &said.borrow()));
            said.borrow_mut().clear();
            if heard.is_none() || !told {
                client = None;
            }
            tick += 1;
            let due = begin + Duration::from_secs_f64(f64::from(tick) * self.rig.tick.period_s);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        Ok(())
    }

    /// Waits for somebody to connect, as long as the run would last.
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

/// Until the motor is on; commands no set-point, so that the firmware needs no beats.
fn raise<const NX: usize, const NY: usize>(
    stage: &mut Stage<'_, NX, NY>,
    period_s: f64,
) -> Result<Output, RunError> {
    for tick in 0..(LONGEST_WAIT_S / period_s) as u32 {
        let output = stage.by_hand(tick)?;
        if output.enable {
            return Ok(output);
        }
    }
    Err(SessionError::NotBalancing(stage.session.seen().state).into())
}

/// Whoever waits to be connected.
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

/// What has come from the client; none if it has gone.
fn heard(stream: &mut TcpStream) -> Option<Vec<u8>> {
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

/// Whether the client is still there. As on a serial line, what it does not take in time is lost.
fn told(stream: &mut TcpStream, mut bytes: &[u8]) -> bool {
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

/// A target whose serial line is listened to.
struct Tap<'a, const NY: usize> {
    target: &'a mut dyn Target<NY>,
    said: &'a RefCell<Vec<u8>>,
}

impl<const NY: usize> Target<NY> for Tap<'_, NY> {
    fn tick(&mut self, pins: &PinsIn<NY>, serial: &mut Vec<u8>) -> Result<Output, TargetError> {
        let begin = serial.len();
        let output = self.target.tick(pins, serial)?;
        self.said.borrow_mut().extend_from_slice(&serial[begin..]);
        Ok(output)
    }
}
