//! `upright firmware run`

use std::net::TcpListener;
use std::time::Instant;

use clap::Args;
use upright_board::{Conditions, Image, UNITS_PER_SECOND};
use upright_closed_loop::harness::Recording;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_tool::in_the_loop::{RunError, RunPlace, VirtualBoard, run, run_compared, serve};

use crate::simulate::SimulateCommand;
use crate::target::TargetOption;
use upright_command::Failure;
use upright_command::progress::with_spinner;

/// Builds the image that is flashed, and runs it on the virtual board with the nonlinear plant; exit status 1 if the
/// pendulum falls, or if a bit differs from the firmware on the host.
///
/// The image's pins drive the plant, and in each tick the firmware on the host gets the inputs that the image has
/// latched.
///
/// The rig is homed while it hangs, held by hand at the start of the scenario until the firmware begins to balance,
/// and released at time 0. With --swing-up, the image raises the rig from hanging, balances, moves, and lowers it
/// again by the stored motions. Options are those of `upright simulate`.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware run rigs/quadruple-paper.toml --step 1 --svg run.svg
  upright firmware run rigs/quadruple-paper.toml --law pole-placement --tilt 0.004 --csv run.csv
  upright firmware run rigs/quadruple-paper.toml --target host
  upright firmware run rigs/single-quanser-ip02.toml --swing-up
  upright firmware run rigs/double-quanser-dbpen.toml --transitions
  upright firmware run rigs/single-quanser-ip02.toml --serve 127.0.0.1:7777 --duration 600")]
pub(crate) struct RunCommand {
    #[command(flatten)]
    simulate: SimulateCommand,
    /// Where the firmware runs
    #[arg(long, value_enum, default_value_t = TargetOption::Board)]
    target: TargetOption,
    /// Serve `upright firmware monitor tcp:HOST:PORT`: in real time, for --duration (ten minutes with --swing-up),
    /// without the comparison
    #[arg(long, value_name = "HOST:PORT", conflicts_with_all = ["csv", "svg", "json"])]
    serve: Option<String>,
}

/// Duration of a served run with --swing-up (s).
const SERVED_S: f64 = 600.0;

impl RunCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if let Some(address) = &self.serve {
            return self.serve(address);
        }
        if self.simulate.is_swing_up() {
            return self.simulate.swing_up_with(|rig, table, script| {
                let recording = self.recorded([rig, &script.rig], table, &script.scenario)?;
                Ok(script.demonstration(recording))
            });
        }
        self.simulate.run_with(|rig, table, scenario| {
            let recording = self.recorded([rig; 2], table, scenario)?;
            Ok((recording.trace, recording.summary))
        })
    }

    fn serve(&self, address: &str) -> Result<(), Failure> {
        let listener = TcpListener::bind(address)
            .map_err(|error| Failure::argument(format!("--serve {address}: {error}; give HOST:PORT")))?;
        let (rig, table, scenario) = if self.simulate.is_swing_up() {
            let (rig, table) = self.simulate.with_motions()?;
            let hanging = Scenario::swing_up(&rig, SERVED_S, None);
            (rig, table, hanging)
        } else {
            self.simulate.prepared()?
        };
        let built = self.target.built(&rig, &table)?;
        eprintln!("connect with: upright firmware monitor tcp:{}", listener.local_addr()?);
        Ok(with_spinner("serving", || serve(&rig, &table, &scenario, built.place(1), &listener))?)
    }

    /// Runs `scenario` with the firmware of `table` for the rig `ours` against the rig `real`, and compares every bit
    /// with the host.
    fn recorded(
        &self,
        [ours, real]: [&Rig; 2],
        table: &TableValues,
        scenario: &Scenario,
    ) -> Result<Recording, Failure> {
        let built = self.target.built(ours, table)?;
        match built.place(scenario.seed) {
            RunPlace::Host => Ok(with_spinner("running it", || run(real, table, scenario, RunPlace::Host))?),
            RunPlace::Board { image, conditions } => on_the_board(real, table, scenario, image, &conditions),
        }
    }
}

/// Runs the image on the virtual board and the firmware on the host in step, and compares every bit.
fn on_the_board(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    image: &Image,
    conditions: &Conditions,
) -> Result<Recording, Failure> {
    let begin = Instant::now();
    let mut board = VirtualBoard::start(image, conditions, table).map_err(RunError::from)?;
    let ended =
        with_spinner("running it on the virtual board", || run_compared(rig, table, scenario, &mut board));
    let simulated_s = board.board().now() as f64 / UNITS_PER_SECOND as f64;
    let (recording, [ticks, messages]) = ended?;
    eprintln!(
        "{ticks} ticks and {messages} telemetry messages on the virtual board, bit for bit as on the host; {simulated_s:.1} s \
         from power-up in {:.1} s",
        begin.elapsed().as_secs_f64()
    );
    if let Some(fault) = recording.fault {
        eprintln!("the firmware has turned the motor off: {fault:?}");
    }
    Ok(recording)
}
