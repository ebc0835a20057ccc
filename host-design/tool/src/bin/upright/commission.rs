//! `upright commission`

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use upright_design::rig::{CartOnly, Rig};
use upright_design::table::{Gains, write_atomically};
use upright_identify::IdentifyError;
use upright_tool::commission::{
    AtPort, CommissionPlan, CommissionRecord, CommissionStep, Commissioning, Journal, Planted, Simulated,
    measured_zeros,
};
use upright_tool::monitor::SerialLine;

use crate::firmware::lines_of_stdin;
use crate::target::{Built, TargetOption};
use crate::variation::with_table;
use upright_command::Failure;
use upright_command::print;

/// Guides you from a wired rig to a balancing one, step by step: what to do, what was found, and whether it is right.
///
/// With --target, the machine and the person beside it are simulated. With --port, the machine is real: its board runs
/// the image of the rig file (upright firmware flash RIG), and Ctrl-C turns the motor off. The command stops at the
/// first step that shows that the machine must not be run: exit status 3.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright commission rigs/single-quanser-ip02.toml --target host --write as-it-is.toml
  upright commission rigs/double-quanser-dbpen.toml --target host --defect encoders-swapped    exit status 3
  upright commission my.toml --target board --machine as-it-is.toml --record record.json
  upright commission my.toml --port /dev/ttyACM0 --write as-it-is.toml --record record.json    the real machine
  upright commission my.toml --port /dev/ttyACM0 --zeros --write my.toml     only the zeros of absolute sensors")]
pub(crate) struct CommissionCommand {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Where the firmware runs, with a simulated machine
    #[arg(long, value_enum, required_unless_present = "port")]
    target: Option<TargetOption>,
    /// The real machine: serial port of its board (/dev/ttyACM0, COM3 …), or tcp:HOST:PORT
    #[arg(long, conflicts_with_all = ["target", "machine", "defect"], requires = "write")]
    port: Option<String>,
    /// Rig file of the simulated machine as it really is, with its [reality] [default: RIG]
    #[arg(long, value_name = "TRUE.toml")]
    machine: Option<PathBuf>,
    /// Defect of the simulated machine
    #[arg(long, value_name = "NAME")]
    defect: Option<Planted>,
    /// Seed of everything random in the simulated machine
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Time for which the machine is shaken (s)
    #[arg(long, default_value_t = 20, value_name = "S", value_parser = clap::value_parser!(u16).range(5..=3600))]
    seconds: u16,
    /// Write the rig file of the machine as identified, once its design is verified
    #[arg(long, value_name = "NEW.toml")]
    write: Option<PathBuf>,
    /// Only measure the zeros of absolute sensors, while the links hang; --write, which may be RIG, gets them
    #[arg(long, conflicts_with = "defect")]
    zeros: bool,
    /// Write a record of what was asked, found and decided to this file, after each step
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Print the record as one JSON object
    #[arg(long)]
    json: bool,
}

impl CommissionCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        rig.needs_cart(CartOnly::Conversation, &self.rig)?;
        commissionable(&rig)?;
        if self.zeros && rig.sensors().iter().skip(1).all(|sensor| sensor.absolute.is_none()) {
            let file = self.rig.display();
            return Err(Failure::argument(format!("{file}: no link has an absolute sensor: sensor_bits")));
        }
        let text = std::fs::read_to_string(&self.rig)?;
        let (_, table) = with_table(&rig, &self.rig, Gains::Sampled)?;
        let seconds = f64::from(self.seconds);
        let plan = CommissionPlan {
            rig: &rig,
            table: &table,
            file: &self.rig,
            text: &text,
            seconds,
            seed: self.seed,
        };
        let journal = |machine: &str| {
            Journal::new(CommissionRecord::new(&rig, machine), self.record.clone(), self.show())
        };
        let (journal, result) = match (&self.port, self.target) {
            (Some(port), _) => {
                let mut journal = journal(port);
                let result = self.at_port(plan, port, &mut journal);
                (journal, result)
            }
            (None, target) => {
                let target = target.unwrap_or(TargetOption::Host);
                let machine = self.true_machine(&rig)?;
                let built = target.built(&rig, &table)?;
                let mut journal = journal(built.place(self.seed).name());
                let result = self.simulated(plan, &machine, target, &built, &mut journal);
                (journal, result)
            }
        };
        if self.json {
            print(true, &journal.record, String::new)?;
        }
        result
    }

    /// Runs all steps with the real machine.
    fn at_port(&self, plan: CommissionPlan<'_>, port: &str, journal: &mut Journal) -> Result<(), Failure> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        let mut machine = AtPort::new(SerialLine::open(port)?, lines_of_stdin(), stop, self.show());
        if self.zeros {
            return self.write(&measured_zeros(plan, &mut machine, journal)?);
        }
        let designed = Commissioning::first(plan, &mut machine, journal)?;
        self.write(&designed.text)?;
        let new = self.write.as_deref().unwrap_or(&self.rig).display();
        journal.step(CommissionStep::Image, |journal| {
            journal.asked(format!("flash it: upright firmware flash {new}, with --board as before"));
            machine.consent("    Enter when it is flashed; Ctrl-C stops").map(drop)
        })?;
        Ok(Commissioning::second(designed.plan(plan), &mut machine, journal)?)
    }

    /// Runs all steps with the simulated machine.
    fn simulated(
        &self,
        plan: CommissionPlan<'_>,
        machine: &Rig,
        target: TargetOption,
        built: &Built,
        journal: &mut Journal,
    ) -> Result<(), Failure> {
        if self.zeros {
            let text = built.place(self.seed).with_target(plan.table, |target| {
                let mut machine = Simulated::new(machine, plan.table, None, target, self.seed)?;
                measured_zeros(plan, &mut machine, journal)
            })?;
            return self.write(&text);
        }
        let designed = built.place(self.seed).with_target(plan.table, |target| {
            let mut machine = Simulated::new(machine, plan.table, self.defect, target, self.seed)?;
            Commissioning::first(plan, &mut machine, journal)
        })?;
        self.write(&designed.text)?;
        let (rig, table) = (&designed.rig, &designed.table);
        let built = journal.step(CommissionStep::Image, |journal| {
            let built = target.built(rig, table)?;
            journal.found(format!("rig {:016x}, table {:08x}", table.rig_hash, table.crc()));
            Ok::<_, Failure>(built)
        })?;
        // As on another day: everything random is drawn again.
        let seed = self.seed.wrapping_add(1);
        Ok(built.place(seed).with_target(table, |target| {
            let mut machine = Simulated::new(machine, table, self.defect, target, seed)?;
            Commissioning::second(designed.plan(plan), &mut machine, journal)
        })?)
    }

    /// Writes the text of the rig file of the machine as found, if --write is given.
    fn write(&self, text: &str) -> Result<(), Failure> {
        let Some(path) = &self.write else { return Ok(()) };
        write_atomically(path, text.as_bytes())?;
        eprintln!("{} written", path.display());
        Ok(())
    }

    /// Prints progress lines: to stderr with --json, otherwise to stdout.
    fn show(&self) -> Box<dyn FnMut(&str)> {
        // A closed pipe must not abort the procedure.
        match self.json {
            true => Box::new(|line| {
                let _ = writeln!(std::io::stderr(), "{line}");
            }),
            false => Box::new(|line| {
                let _ = writeln!(std::io::stdout(), "{line}");
            }),
        }
    }

    /// The simulated machine as it really is: the rig of --machine, otherwise RIG.
    fn true_machine(&self, rig: &Rig) -> Result<Rig, Failure> {
        let Some(path) = &self.machine else { return Ok(rig.clone()) };
        let machine = Rig::from_path(path)?;
        commissionable(&machine)?;
        let differs = |what: &str| {
            let [path, rig] = [path, &self.rig].map(|path: &PathBuf| Path::display(path));
            Failure::argument(format!(
                "{path}: has another {what} than {rig}; give a file of the same machine"
            ))
        };
        if machine.states() != rig.states() {
            return Err(differs("number of links"));
        }
        if machine.tick.period_s != rig.tick.period_s {
            return Err(differs("period_s"));
        }
        if machine.actuator.motor().is_some() != rig.actuator.motor().is_some() {
            return Err(differs("kind of actuator"));
        }
        Ok(machine)
    }
}

/// Refuses a rig whose cart or joints lack an encoder.
fn commissionable(rig: &Rig) -> Result<(), IdentifyError> {
    if rig.chain().is_some() && rig.sensors().len() == rig.links() + 1 {
        Ok(())
    } else {
        Err(IdentifyError::NoEncoders(rig.name.clone()))
    }
}
