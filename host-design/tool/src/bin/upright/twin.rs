//! `upright twin`

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use upright::table::Law;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing};
use upright_design::table::TableValues;
use upright_tool::in_the_loop::RunPlace;
use upright_tool::monitor::SerialLine;
use upright_tool::twin::{Server, SimulatedMachine};

use crate::target::TargetOption;
use crate::variation::{Variation, Wanted, law_option, positive, with_stored_motions};
use upright_command::Failure;

/// Serves a page on which the rig moves, run by the firmware itself: pull it, change it, break it, watch it.
///
/// Open the address that is printed; it contains a secret, so nobody else can move the motor. The page needs no
/// network. Ctrl-C ends it. If the page in command is closed or falls silent for two seconds, the motor is turned off.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright twin rigs/single-quanser-ip02.toml                  the firmware on this computer, the rig simulated
  upright twin rigs/quadruple-paper.toml                      four links: they stand a short tug only
  upright twin rigs/double-quanser-rotary.toml                an arm, from the side and from above
  upright twin rigs/quadruple-paper.toml --target board       the image that is flashed, on the virtual board
  upright twin rigs/single-quanser-ip02.toml --hanging        from power-up on, with every step left to you
  upright twin rigs/quadruple-paper.toml --port /dev/ttyACM0  a real board, without what only a simulation can do
  upright twin rigs/quadruple-paper.toml --listen 0.0.0.0:8080   for a phone on the same network: others can listen")]
pub(crate) struct TwinCommand {
    #[command(flatten)]
    variation: Variation,
    /// Where the firmware runs
    #[arg(long, value_enum, default_value_t = TargetOption::Host)]
    target: TargetOption,
    /// A board instead of a simulation: its serial port (/dev/ttyACM0, COM3 …), or tcp:HOST:PORT
    #[arg(long, conflicts_with_all = ["target", "hanging"])]
    port: Option<String>,
    /// Include the stored motions between other equilibria
    #[arg(long)]
    transitions: bool,
    /// Begin with the links hanging, not homed
    #[arg(long)]
    hanging: bool,
    /// Control law at the start
    #[arg(long, value_parser = law_option(), default_value = Law::Lqr.option())]
    law: Law,
    /// Address of the page; port 0 picks a free one
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:0")]
    listen: SocketAddr,
    /// End after this time (s)
    #[arg(long, value_name = "S", value_parser = positive)]
    duration: Option<f64>,
}

impl TwinCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let (rig, _, table) = self.variation.designed()?;
        let table =
            with_stored_motions(&self.variation.rig, &rig, table, Wanted::from_option(self.transitions))?;
        let built = match self.port {
            None => Some(self.target.built(&rig, &table)?),
            Some(_) => None,
        };
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        let until = self.duration.map(|duration| Instant::now() + Duration::from_secs_f64(duration));
        let goes_on = || !stop.load(Ordering::Relaxed) && until.is_none_or(|until| Instant::now() < until);
        if let Some(port) = &self.port {
            return show(port, &rig, &table, self.listen, &goes_on);
        }
        let place = built.as_ref().map_or(RunPlace::Host, |built| built.place(1));
        let scenario = Scenario { sensing: Sensing::Encoders, ..Scenario::at_rest(&rig, self.law) };
        let machine = SimulatedMachine { rig: &rig, table: &table, scenario: &scenario };
        Ok(listening(self.listen)?.simulate(machine, place, !self.hanging, &goes_on)?)
    }
}

/// Shows the machine behind a serial port, which must be that of `rig`, on a page at `address` while `goes_on` holds.
pub(crate) fn show(
    port: &str,
    rig: &Rig,
    table: &TableValues,
    address: SocketAddr,
    goes_on: &dyn Fn() -> bool,
) -> Result<(), Failure> {
    let line = SerialLine::open(port)?;
    Ok(listening(address)?.connect(rig, table, line, port, goes_on)?)
}

/// Starts the server and prints the address of its page.
fn listening(address: SocketAddr) -> Result<Server, Failure> {
    let server = Server::listen(address).map_err(|error| {
        Failure::argument(format!("{address}: {error}; the page needs another port, or 0 for a free one"))
    })?;
    println!("{}", server.address()?);
    eprintln!("open this address in a browser; Ctrl-C ends");
    Ok(server)
}
