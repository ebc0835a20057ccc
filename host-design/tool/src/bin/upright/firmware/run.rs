//! `upright firmware run`

use std::net::TcpListener;

use clap::{Args, ValueEnum};
use upright_design::harness::Recording;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_tool::image::{self, Kind};
use upright_tool::in_the_loop::{Link, Place, run, serve};

use crate::failure::Failure;
use crate::progress::with_spinner;
use crate::simulate::Simulate;

/// Builds the image for the rig, runs it in QEMU in lock step with the nonlinear plant, and compares every bit with
/// the same run on the host; exit status 1 if the pendulum falls or a bit differs.
///
/// The rig is homed while it hangs, held by hand at the start of the scenario until the firmware begins to balance,
/// and released at time 0. Options are those of `upright simulate`.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware run rigs/quadruple-paper.toml --step 1 --svg qemu.svg
  upright firmware run rigs/quadruple-paper.toml --law pole-placement --tilt 0.004 --csv run.csv
  upright firmware run rigs/single-quanser-ip02.toml --link usart --duration 2
  upright firmware run rigs/single-quanser-ip02.toml --serve 127.0.0.1:7777 --duration 600")]
pub(crate) struct Run {
    #[command(flatten)]
    simulate: Simulate,
    /// How the pins of the image are connected: files of the emulator (fast; Unix only), or serial lines
    #[arg(long, value_enum, default_value_t = LinkName::Files)]
    link: LinkName,
    /// Serve `upright firmware monitor tcp:HOST:PORT`: in real time, for --duration, without the comparison
    #[arg(long, value_name = "HOST:PORT", conflicts_with_all = ["csv", "svg", "json"])]
    serve: Option<String>,
}

#[derive(Clone, Copy, ValueEnum)]
enum LinkName {
    Files,
    Usart,
}

impl Run {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let (link, kind) = match self.link {
            LinkName::Files => (Link::Files, Kind::InTheLoop),
            LinkName::Usart => (Link::Usart, Kind::InTheLoopUsart),
        };
        if let Some(address) = &self.serve {
            let listener = TcpListener::bind(address).map_err(|error| {
                Failure::BadArgument(format!("--serve {address}: {error}; give HOST:PORT"))
            })?;
            let (rig, table, scenario) = self.simulate.prepared()?;
            let image = with_spinner("building the image", || image::build_for(kind, &rig, &table))?;
            eprintln!("connect with: upright firmware monitor tcp:{}", listener.local_addr()?);
            let place = Place::Qemu { image: &image, link };
            return Ok(with_spinner("serving", || serve(&rig, &table, &scenario, place, &listener))?);
        }
        self.simulate.run_with(|rig, table, scenario| {
            let image = with_spinner("building the image", || image::build_for(kind, rig, table))?;
            let place = Place::Qemu { image: &image, link };
            let recording = with_spinner("running it in QEMU", || run(rig, table, scenario, place))?;
            compare(rig, table, scenario, &recording)?;
            Ok((recording.trace, recording.summary))
        })
    }
}

/// The same run on the host, bit by bit.
fn compare(rig: &Rig, table: &TableValues, scenario: &Scenario, qemu: &Recording) -> Result<(), Failure> {
    let host = run(rig, table, scenario, Place::Host)?;
    let difference = host.ticks.iter().zip(&qemu.ticks).position(|(host, qemu)| host != qemu);
    match difference {
        Some(tick) => {
            Err(Failure::CheckFailed(format!("QEMU and host differ in tick {tick} after the release")))
        }
        None if host.ticks.len() != qemu.ticks.len() => Err(Failure::CheckFailed(format!(
            "{} ticks in QEMU, {} on the host",
            qemu.ticks.len(),
            host.ticks.len()
        ))),
        None => {
            eprintln!(
                "{} ticks in QEMU, bit for bit as on the host; at most {} instructions per tick",
                qemu.ticks.len(),
                qemu.worst_cycles
            );
            if let Some(fault) = qemu.fault {
                eprintln!("the firmware has turned the motor off: {fault:?}");
            }
            Ok(())
        }
    }
}
