//! `upright simulate`

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;
use upright::table::Law;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing, Summary, Trace, simulate};
use upright_design::table::{TableValues, write_atomically};
use upright_plan::{Demonstration, Script};
use upright_tool::figure::run_svg;
use upright_tool::in_the_loop::RunError;

use crate::variation::{Variation, Wanted, finite, law_option, not_negative, positive, with_stored_motions};
use upright_command::Failure;
use upright_command::progress::with_spinner;

/// Runs the firmware's own controller against the nonlinear plant.
///
/// Exit status 1 if the pendulum falls.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright simulate rigs/quadruple-paper.toml --step 1 --svg step.svg
  upright simulate rigs/quadruple-paper.toml --law pole-placement --tilt 0.01,-0.01
  upright simulate rigs/quadruple-paper.toml --disturbances paper --seed 7 --csv run.csv
  upright simulate rigs/quadruple-paper.toml --tick 0.005 --gains continuous --tilt 0.001   falls
  upright simulate rigs/quadruple-paper.toml --swing-up --svg swing-up.svg
  upright simulate rigs/double-quanser-dbpen.toml --transitions --svg route.svg
  upright simulate rigs/quadruple-paper.toml --csv - | head")]
pub(crate) struct SimulateCommand {
    #[command(flatten)]
    variation: Variation,

    /// Control law
    #[arg(long, value_parser = law_option(), default_value = Law::Lqr.option())]
    law: Law,
    /// Duration of the run (s)
    #[arg(long, default_value_t = 10.0, value_name = "S", value_parser = positive)]
    duration: f64,
    /// Step of the set-point (m)
    #[arg(long, default_value_t = 0.0, value_name = "M", value_parser = finite)]
    step: f64,
    /// When the set-point steps (s)
    #[arg(long, default_value_t = 0.0, value_name = "S", value_parser = not_negative)]
    step_at: f64,
    /// Apply the set-point as a step, without the governor
    #[arg(long)]
    raw_step: bool,
    /// What the controller measures [default: encoders if the rig file has [kalman]]
    #[arg(long, value_enum)]
    sensing: Option<SensingName>,
    /// Initial angles of the links, from the cart outwards (rad); missing ones are 0
    #[arg(long, value_delimiter = ',', value_name = "RAD,…", value_parser = finite)]
    tilt: Vec<f64>,
    /// The whole initial state: x, xdot, theta1, theta1dot … (SI), instead of --tilt
    #[arg(long, value_delimiter = ',', value_name = "X,…", value_parser = finite, conflicts_with = "tilt")]
    start: Vec<f64>,
    /// Disturbances: none, or the paper's force of 0.1 N rms and joint torques of 3.16e-5 N·m rms
    #[arg(long, value_enum, default_value_t = DisturbanceOptions::None)]
    disturbances: DisturbanceOptions,
    /// Disturbing force, drawn again in each tick (N rms)
    #[arg(long, value_name = "N", value_parser = not_negative)]
    force_noise: Option<f64>,
    /// Disturbing torque at each joint, drawn again in each tick (N·m rms)
    #[arg(long, value_name = "NM", value_parser = not_negative)]
    torque_noise: Option<f64>,
    /// Constant disturbing force on the cart, as from a tilted rail (N)
    #[arg(long, default_value_t = 0.0, value_name = "N", value_parser = finite)]
    force_offset: f64,
    /// Seed of the disturbances
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Integration steps per tick
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=1000))]
    substeps: u16,

    /// Raise the rig with its stored motion, balance, step, and lower it again, with encoders and the rig's noise
    #[arg(long, conflicts_with_all = ["law", "duration", "step", "step_at", "raw_step", "sensing", "tilt", "start",
          "disturbances", "force_noise", "torque_noise", "force_offset", "substeps"])]
    swing_up: bool,
    /// A run through all stored motions between equilibria, one after the other
    #[arg(long, conflicts_with_all = ["swing_up", "law", "duration", "step", "step_at", "raw_step", "sensing", "tilt",
          "start", "disturbances", "force_noise", "torque_noise", "force_offset", "substeps"])]
    transitions: bool,
    /// With --swing-up: masses and friction wrong by up to the spreads of [swing_up], drawn with the seed
    #[arg(long, requires = "swing_up")]
    wrong: bool,

    /// Write every tick as CSV to a file, or to stdout with `-`
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Draw position, angles, rates and force into an SVG file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum SensingName {
    FullState,
    Encoders,
}

#[derive(Clone, Copy, ValueEnum)]
enum DisturbanceOptions {
    None,
    Paper,
}

impl SimulateCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if self.is_swing_up() {
            return self.swing_up_with(|_, table, script| {
                Ok(with_spinner("simulating", || script.run(table)).map_err(RunError::from)?)
            });
        }
        self.run_with(|rig, table, scenario| {
            Ok(with_spinner("simulating", || simulate(rig, table, scenario))?)
        })
    }

    /// Runs the scenario with `run`, and writes and prints the result.
    pub(crate) fn run_with(
        &self,
        run: impl FnOnce(&Rig, &TableValues, &Scenario) -> Result<(Trace, Summary), Failure>,
    ) -> Result<(), Failure> {
        let (rig, table, scenario) = self.prepared()?;
        let (trace, summary) = run(&rig, &table, &scenario)?;
        self.write(&rig, &trace, &summary)?;
        match summary.fall_in_words() {
            Some(fall) => Err(Failure::check(format!("{}: {fall}", rig.name))),
            None => Ok(()),
        }
    }

    /// Whether stored motions are run: with --swing-up or --transitions.
    pub(crate) fn is_swing_up(&self) -> bool {
        self.swing_up || self.transitions
    }

    /// The rig, and its table with the stored motions.
    pub(crate) fn with_motions(&self) -> Result<(Rig, TableValues), Failure> {
        let (rig, _, table) = self.variation.designed()?;
        let table =
            with_stored_motions(&self.variation.rig, &rig, table, Wanted::from_option(self.transitions))?;
        Ok((rig, table))
    }

    /// Runs the stored motions, and the phases between them, with `run`, and writes and prints the result.
    pub(crate) fn swing_up_with(
        &self,
        run: impl FnOnce(&Rig, &TableValues, &Script) -> Result<Demonstration, Failure>,
    ) -> Result<(), Failure> {
        let (rig, table) = self.with_motions()?;
        let script = match self.transitions {
            true => Script::route(&rig, &table, self.seed),
            false => Script::draw(&rig, &table, self.seed, self.wrong),
        };
        let script = script.map_err(|source| Failure::of_rig(&rig.name, source))?;
        let run = run(&rig, &table, &script)?;
        let parts: Vec<_> =
            run.parts.iter().map(|(at_s, name)| json!({ "at_s": at_s, "part": name })).collect();
        let text = if self.json {
            let fault = run.fault.map(|fault| fault.to_string());
            json!({ "rig": rig.name, "arrived": run.arrived, "fault": fault, "parts": parts }).to_string()
        } else {
            let lines: Vec<String> =
                run.parts.iter().map(|(at_s, name)| format!("{at_s:>8.3} s  {name}")).collect();
            lines.join("\n")
        };
        let what =
            if self.transitions { "from equilibrium to equilibrium" } else { "up, balance, step, down" };
        let title = format!("{}: {what}", rig.name);
        self.write_record(&rig, &run.trace, &title, &text)?;
        if run.arrived {
            return Ok(());
        }
        let fault = run.fault.map_or_else(String::new, |fault| format!(": {fault}"));
        Err(Failure::check(format!("{}, seed {}: it does not arrive{fault}", rig.name, self.seed)))
    }

    /// The rig, its table and the scenario that the options ask for.
    pub(crate) fn prepared(&self) -> Result<(Rig, TableValues, Scenario), Failure> {
        let (rig, _, table) = self.variation.designed()?;
        let scenario = self.scenario(&rig)?;
        let table = if self.raw_step { table.without_governor() } else { table };
        Ok((rig, table, scenario))
    }

    fn scenario(&self, rig: &Rig) -> Result<Scenario, Failure> {
        let law = self.law;
        let mut scenario = Scenario::at_rest(rig, law);
        if let Some(sensing) = self.sensing {
            scenario.sensing = match sensing {
                SensingName::FullState => Sensing::FullState,
                SensingName::Encoders => Sensing::Encoders,
            };
        }
        scenario.start = self.initial_state(rig, law)?;
        // The paper's disturbances: F_d ~ N(0, 0.01), joint torques ~ N(0, 1e-9), given there as variances.
        let (force, torque) = match self.disturbances {
            DisturbanceOptions::None => (0.0, 0.0),
            DisturbanceOptions::Paper => (0.01f64.sqrt(), 1e-9f64.sqrt()),
        };
        Ok(Scenario {
            duration_s: self.duration,
            step_m: self.step,
            step_at_s: self.step_at,
            force_noise_n: self.force_noise.unwrap_or(force),
            torque_noise_n_m: self.torque_noise.unwrap_or(torque),
            force_offset_n: self.force_offset,
            seed: self.seed,
            substeps: self.substeps.into(),
            ..scenario
        })
    }

    /// The initial state that the options give; a small tilt if they give no step, tilt or disturbance.
    fn initial_state(&self, rig: &Rig, law: Law) -> Result<Vec<f64>, Failure> {
        let states = rig.states();
        let links = rig.links();
        let [values, angles] = [self.start.len(), self.tilt.len()];
        if values != 0 && values != states {
            return Err(Failure::argument(format!(
                "--start: {values} values for {states} states; give {states}"
            )));
        }
        if angles > links {
            return Err(Failure::argument(format!(
                "--tilt: {angles} angles for {links} links; give at most {links}"
            )));
        }
        if values != 0 {
            return Ok(self.start.clone());
        }
        let moves = self.step != 0.0
            || angles != 0
            || !matches!(self.disturbances, DisturbanceOptions::None)
            || self.force_noise.is_some()
            || self.torque_noise.is_some()
            || self.force_offset != 0.0;
        if !moves {
            // At exact rest even an unstable loop survives.
            eprintln!("no step, tilt or disturbance given: starting with a small tilt");
            return Ok(Scenario::acceptance(rig, law, 1.0).start);
        }
        let mut start = Scenario::at_rest(rig, law).start;
        for (link, &angle) in self.tilt.iter().enumerate() {
            start[2 + 2 * link] = angle;
        }
        Ok(start)
    }

    fn write(&self, rig: &Rig, trace: &Trace, summary: &Summary) -> Result<(), Failure> {
        let law = self.law;
        let title = format!(
            "{}, {law}, tick {} ms",
            rig.name,
            format!("{:.4}", rig.tick.period_s * 1e3).trim_end_matches('0').trim_end_matches('.')
        );
        let text = if self.json {
            let mut object = json!({ "rig": rig.name, "hash": format!("{:016x}", rig.hash()), "survives": summary.survives() });
            if let (Some(object), Ok(serde_json::Value::Object(figures))) =
                (object.as_object_mut(), serde_json::to_value(summary))
            {
                object.extend(figures);
            }
            object.to_string()
        } else {
            summary.to_string()
        };
        self.write_record(rig, trace, &title, &text)
    }

    /// Writes the files that are asked for, and prints `text`.
    fn write_record(&self, rig: &Rig, trace: &Trace, title: &str, text: &str) -> Result<(), Failure> {
        let csv_on_stdout = self.csv.as_ref().is_some_and(|path| path.as_os_str() == "-");
        let mut out = std::io::stdout().lock();
        if let Some(path) = &self.csv {
            let mut bytes = Vec::new();
            trace.write_csv(&mut bytes)?;
            if csv_on_stdout {
                out.write_all(&bytes)?;
            } else {
                write_atomically(path, &bytes)?;
            }
        }
        if let Some(path) = &self.svg {
            write_atomically(path, run_svg(rig, trace, title)?.as_bytes())?;
        }
        if csv_on_stdout {
            eprintln!("{text}");
        } else {
            writeln!(out, "{text}")?;
        }
        Ok(())
    }
}
