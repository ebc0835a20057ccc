//! `upright firmware cycles`

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use upright::boards::BoardRow;
use upright::table::Law;
use upright_board::{Conditions, CoreTiming, Image};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing};
use upright_design::table::TableValues;
use upright_tool::image::{self, conditions};
use upright_tool::in_the_loop::{self, Span, TickFigures};
use upright_trust::verify::at_rest_disturbed;

use super::board::BoardOption;
use super::built::{ForRig, designed};
use crate::building::building;
use crate::target::read;
use crate::variation::{Wanted, law_option, positive};
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::with_spinner;

/// Measures what the ticks of the flashed image cost, on the virtual board: latency from the tick to the output,
/// jitter of the output, and the whole task by part. The run goes from power-up through arming to balancing, and
/// through raising and lowering if the rig has stored motions.
///
/// Cycle counts follow ARM's instruction timings and the wait states of the flash, by a quick and by a slow model of
/// what the manuals leave open; they are approximate. Exit status 1 if a tick takes longer than a quarter of its period
/// by the slow one.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware cycles rigs/quadruple-paper.toml
  upright firmware cycles rigs/single-quanser-ip02.toml --law pole-placement --board nucleo-f446
  upright firmware cycles rigs/quadruple-paper.toml --json | jq .cycles.balancing.latency.us")]
pub(crate) struct CyclesCommand {
    /// Rig file (TOML)
    rig: PathBuf,
    #[command(flatten)]
    on: BoardOption,
    /// Control law
    #[arg(long, value_parser = law_option(), default_value = Law::Lqr.option())]
    law: Law,
    /// Time for which it balances (s)
    #[arg(long, default_value_t = 2.0, value_name = "S", value_parser = positive)]
    duration: f64,
    /// Print the figures as one JSON object
    #[arg(long)]
    json: bool,
}

impl CyclesCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let typical = conditions(self.on.board, 1)?;
        let (rig, table) = designed(&self.rig, Wanted::SwingUp)?;
        let image = building(self.on.board, || image::build_for(self.on.board, &rig, &table))?;
        let image = read(&image.elf)?;
        let by = |timing| {
            let conditions = Conditions { timing, ..typical };
            measured(&rig, &table, &image, &conditions, self.law, self.duration)
        };
        let [cycles, slow] = CoreTiming::ALL.map(by);
        let (cycles, slow) = (cycles?, slow?);
        let (board, law) = (self.on.board.name, self.law.option());
        let object = json!({ "rig": rig.name, "board": board, "law": law, "cycles": cycles, "slow": slow });
        print(self.json, &object, || {
            CoreTiming::ALL
                .into_iter()
                .zip([&cycles, &slow])
                .map(|(timing, cycles)| table_of(timing, cycles))
                .collect()
        })?;
        if let Some(ended) = &slow.ended {
            eprintln!("it does not balance for {} s: {ended}", self.duration);
        }
        slow.check().map_err(|error| Failure::check(error.to_string()))
    }
}

/// Measures the ticks of the image, with the disturbances that the rig file expects.
pub(super) fn measured(
    rig: &Rig,
    table: &TableValues,
    image: &Image,
    conditions: &Conditions,
    law: Law,
    duration_s: f64,
) -> Result<in_the_loop::TickCycles, Failure> {
    let scenario = Scenario { sensing: Sensing::Encoders, duration_s, ..at_rest_disturbed(rig, law, 1) };
    Ok(with_spinner("measuring its ticks", || {
        in_the_loop::measure(rig, table, &scenario, image, conditions)
    })?)
}

/// Time for which an image balances when it is checked (s).
const CHECKED_S: f64 = 0.5;

/// Refuses an image with a tick that is too long for the board. Where the ticks of other rigs with the same code do not
/// show that there is none, it is run, and refused, too, if it has an observer but does not balance, so that its ticks
/// cannot be measured. Only the virtual board measures: a Pico's ticks are known from its emulator.
pub(super) fn check_ticks(board: &'static BoardRow, built: &mut ForRig) -> Result<(), Failure> {
    let Ok(conditions) = conditions(board, 1) else { return Ok(()) };
    let ForRig { rig, table, image } = built;
    let period_us = 1e6 * rig.tick.period_s;
    if let Some(us) = image.ticks.bound_us().filter(|&us| us <= period_us / 4.0) {
        let percent = 100.0 * us / period_us;
        eprintln!(
            "no tick takes longer than {us:.1} µs, {percent:.1} % of its period: other rigs with this code"
        );
        return Ok(());
    }
    let law = table.laws.present().next().map_or(Law::Lqr, |(law, _)| law);
    let cycles = measured(rig, table, &read(&image.elf)?, &conditions, law, CHECKED_S)?;
    let Span { cycles: longest, us } = cycles.all.whole;
    eprintln!(
        "the longest of {} ticks takes {us:.1} µs ({longest} cycles, approximately), {:.1} % of its period",
        cycles.all.ticks,
        100.0 * us / cycles.period.us
    );
    cycles.check().map_err(|error| Failure::check(error.to_string()))?;
    match &cycles.ended {
        Some(ended) if table.observer.is_some() => Err(Failure::check(format!(
            "the ticks of this image cannot be measured on the virtual board: {ended}"
        ))),
        Some(_) => {
            eprintln!("only ticks with the motor off were measured: without [kalman], it never balances");
            Ok(())
        }
        None => {
            if table.swing_up.is_none() || cycles.moving.is_some() {
                image.ticks.keep(us);
            }
            Ok(())
        }
    }
}

fn table_of(timing: CoreTiming, cycles: &in_the_loop::TickCycles) -> String {
    let columns = [
        ("motor off, most", cycles.off),
        ("balancing, median", cycles.typical),
        ("balancing, most", cycles.balancing),
        ("swinging up, median", cycles.typical_moving),
        ("swinging up, most", cycles.moving),
        ("all ticks, most", Some(cycles.all)),
    ];
    let mut text = format!("{:28}", format!("by the {} model", timing.name()));
    for (name, _) in columns {
        // Writing to a string cannot fail.
        _ = write!(text, "{name:>20}");
    }
    _ = write!(text, "\n{:28}", "");
    for _ in columns {
        _ = write!(text, "{:>10}{:>10}", "cycles", "µs");
    }
    let mut row = |name: &str, of: &dyn Fn(&TickFigures) -> Option<Span>| {
        _ = write!(text, "\n{name:28}");
        for (_, worst) in &columns {
            match worst.as_ref().and_then(of) {
                Some(Span { cycles, us }) => _ = write!(text, "{cycles:>10}{us:>10.2}"),
                None => _ = write!(text, "{:>10}{:>10}", "-", "-"),
            }
        }
    };
    row("from tick to output", &|worst| worst.latency);
    row("jitter of the output", &|worst| worst.jitter);
    row("whole task", &|worst| Some(worst.whole));
    row("  interrupt entry", &|worst| Some(worst.entry));
    row("  read inputs", &|worst| Some(worst.inputs));
    row("  supervise and control", &|worst| Some(worst.control));
    row("  drive the motor", &|worst| Some(worst.output));
    row("  command … prediction", &|worst| Some(worst.rest));
    row("controller alone", &|worst| Some(worst.controller));
    _ = write!(
        text,
        "\n{} ticks from power-up on, at {} MHz; the longest takes {:.1} % of its period. Cycles are approximate.\n",
        cycles.all.ticks,
        cycles.core_hz / 1_000_000,
        100.0 * cycles.all.whole.us / cycles.period.us
    );
    text
}
