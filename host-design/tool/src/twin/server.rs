//! The server: listens, lets viewers in, and runs the machine.

use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};

use serde_json::Value;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_page::twin::{Console, Properties, SimulatedMachine, TELEMETRY_S, greeting};

use super::access::{Access, Admitted, accept, send};
use super::connected;
use super::connections::Connections;
use super::dispatcher::{Dispatcher, SharedCsv};
use super::half_open::HalfOpen;
use super::simulated::{RunEnd, run};
use crate::campaign::{Defect, kinds};
use crate::figure::page_theme;
use crate::in_the_loop::{RunError, RunPlace};
use crate::monitor::{Monitor, SerialLine};

/// Serves a page at an address that only the person who started it knows.
pub struct Server {
    listener: TcpListener,
    secret: String,
    recording: SharedCsv,
}

impl Server {
    /// Listens at this address; port 0 picks a free one.
    ///
    /// # Errors
    /// If the address cannot be listened at.
    pub fn listen(address: SocketAddr) -> std::io::Result<Self> {
        let secret = format!("{:032x}", rand::random::<u128>());
        Ok(Self { listener: TcpListener::bind(address)?, secret, recording: SharedCsv::default() })
    }

    /// The address of the page, with its secret.
    ///
    /// # Errors
    /// If the system does not tell the port.
    pub fn address(&self) -> std::io::Result<String> {
        let local = self.listener.local_addr()?;
        let host = match local.ip() {
            // On every interface: the loopback interface is always among them.
            ip if ip.is_unspecified() => SocketAddr::new(IpAddr::from([127, 0, 0, 1]), local.port()),
            ip => SocketAddr::new(ip, local.port()),
        };
        Ok(format!("http://{host}/{}/", self.secret))
    }

    /// Runs the firmware of `machine` in `place` with the simulated rig, in real time from the first viewer on, while
    /// `goes_on` holds. If `upright`, the rig is raised at the start; otherwise it hangs.
    ///
    /// # Errors
    /// [`RunError`] if the firmware cannot be started.
    pub fn simulate(
        self,
        machine: SimulatedMachine<'_>,
        place: RunPlace<'_>,
        upright: bool,
        goes_on: &dyn Fn() -> bool,
    ) -> Result<(), RunError> {
        let SimulatedMachine { rig, table, .. } = machine;
        let defects: Vec<Defect> =
            kinds(table, place).into_iter().filter(|kind| kind.can_begin_while_balancing()).collect();
        let (viewers, events) = Connections::new(themed(greeting(rig, table, place.name(), Some(&defects))));
        let _accepting = accepting(self.listener, self.secret, viewers.clone(), Arc::clone(&self.recording))?;
        let monitor = || match place {
            // Its serial line carries no more than the usual rate.
            RunPlace::Board { .. } => Monitor::new(&rig.name),
            _ => Monitor::with_telemetry_every(TELEMETRY_S, &rig.name),
        };
        let console = Console::new(monitor(), rig.base());
        let mut dispatcher = Dispatcher::new(console, (viewers, events), self.recording);
        let mut properties = Properties::of(rig);
        let mut upright = upright;
        loop {
            let ended = place.with_target(table, |target| {
                run(machine, target, &mut dispatcher, &mut properties, upright, goes_on)
                    .map_err(RunError::from)
            });
            upright = match ended {
                Ok(RunEnd::Stopped) => return Ok(()),
                Ok(RunEnd::Restart { upright }) => upright,
                // It has stopped after it was running: say so, and wait for the power to be switched off and on.
                Err(error) if dispatcher.was_seen => {
                    match dispatcher.wait_for_restart(&error.to_string(), goes_on) {
                        Some(upright) => upright,
                        None => return Ok(()),
                    }
                }
                Err(error) => return Err(error),
            };
            dispatcher.begin_again(monitor());
        }
    }

    /// Shows the machine behind `line`, which has to be that of `rig`, while `goes_on` holds.
    ///
    /// # Errors
    /// [`RunError`] if the page cannot be served.
    pub fn connect(
        self,
        rig: &Rig,
        table: &TableValues,
        line: SerialLine,
        name: &str,
        goes_on: &dyn Fn() -> bool,
    ) -> Result<(), RunError> {
        let (viewers, events) = Connections::new(themed(greeting(rig, table, name, None)));
        let _accepting = accepting(self.listener, self.secret, viewers.clone(), Arc::clone(&self.recording))?;
        let console = Console::new(Monitor::new(name), rig.base());
        let mut dispatcher = Dispatcher::new(console, (viewers, events), self.recording);
        connected::run(line, &mut dispatcher, rig.into(), goes_on);
        Ok(())
    }
}

/// The greeting with the look of curves, as in a document.
fn themed(mut greeting: Value) -> Value {
    greeting["theme"] = page_theme();
    greeting
}

/// Lets viewers in, each in its own thread, until it is dropped.
struct Accepting {
    stop: Arc<AtomicBool>,
    address: SocketAddr,
}

impl Drop for Accepting {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        // Wakes the thread that waits for a viewer.
        let _ = TcpStream::connect(self.address);
    }
}

fn accepting(
    listener: TcpListener,
    secret: String,
    viewers: Connections,
    recording: SharedCsv,
) -> std::io::Result<Accepting> {
    let address = listener.local_addr()?;
    let access = Arc::new(Access::new(secret, address.ip(), address.port()));
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let half_open = HalfOpen::default();
    std::thread::spawn(move || {
        for (number, stream) in (0..).zip(listener.incoming()) {
            if stopped.load(Ordering::Relaxed) {
                return;
            }
            let Ok(mut stream) = stream else { continue };
            if half_open.begin(number, &stream).is_err() {
                continue;
            }
            let (access, viewers, recording) = (Arc::clone(&access), viewers.clone(), Arc::clone(&recording));
            let half_open = half_open.clone();
            std::thread::spawn(move || {
                let admitted = access.answer(&mut stream);
                half_open.end(number);
                // A client that goes away in the middle is no error of the server.
                let _ = admitted.and_then(|admitted| let_in(stream, admitted, &viewers, &recording));
            });
        }
    });
    Ok(Accepting { stop, address })
}

fn let_in(
    mut stream: TcpStream,
    admitted: Option<Admitted>,
    viewers: &Connections,
    recording: &SharedCsv,
) -> std::io::Result<()> {
    match admitted {
        Some(Admitted::File(asset)) => {
            send(&mut stream, "200 OK", asset.media_type, asset.content.as_bytes())
        }
        Some(Admitted::Recording) => {
            let recorded = recording.lock().unwrap_or_else(PoisonError::into_inner).clone();
            send(&mut stream, "200 OK", "text/csv", &recorded)
        }
        Some(Admitted::Socket(_)) if !viewers.has_room() => {
            send(&mut stream, "503 Service Unavailable", "text/plain", b"too many viewers")
        }
        Some(Admitted::Socket(key)) => {
            accept(&mut stream, &key)?;
            viewers.serve(stream);
            Ok(())
        }
        None => Ok(()),
    }
}
