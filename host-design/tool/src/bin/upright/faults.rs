//! `upright faults`

mod healthy;

use std::io::Write;

use clap::Args;
use serde_json::json;
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_plan::SwingUpError;
use upright_tool::campaign::{Campaign, Defect, DefectRow, During, Setup, campaign, feed, kinds, one};
use upright_tool::in_the_loop::RunPlace;

use healthy::HealthyOptions;

use crate::split::Split;
use crate::target::TargetOption;
use crate::variation::{Variation, Wanted, with_stored_motions};
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::with_bar;

/// Fault injection: runs the firmware with one defect at a time and checks that the motor is off in time; exit status
/// 1 if it ever is not, or is turned off without a reason.
///
/// As a negative control, part of the campaign is repeated with a firmware without thresholds and limits: that
/// firmware must miss the defects, or the campaign proves nothing.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright faults rigs/quadruple-paper.toml
  upright faults rigs/single-quanser-ip02.toml --runs 10000 --seed 7
  upright faults rigs/quadruple-paper.toml --target board --runs 300
  upright faults rigs/quadruple-paper.toml --target board --runs 300
  upright faults rigs/quadruple-paper.toml --swing-up                while it is raised and lowered
  upright faults rigs/quadruple-paper.toml --jog             while the motor pushes the cart a little
  upright faults rigs/quadruple-paper.toml --shake                   while the motor shakes the links
  upright faults rigs/quadruple-paper.toml --only 1234               repeats one run, bit for bit
  upright faults rigs/quadruple-paper.toml --shard 2/3 > 2.jsonl     the second third of the runs
  upright faults rigs/quadruple-paper.toml --merge 1.jsonl 2.jsonl 3.jsonl
  upright faults rigs/quadruple-paper.toml --kind motor-dead --json
  upright faults rigs/quadruple-robust.toml --healthy                2 h of each law, 6 minutes for each machine
  upright faults rigs/single-quanser-ip02.toml --healthy --runs 100 --duration 3600
  upright faults rigs/quadruple-robust.toml --healthy --corners      every combination of wrong masses")]
pub(crate) struct FaultsCommand {
    #[command(flatten)]
    variation: Variation,
    /// Begin the defects while the rig is raised and lowered by the stored motions
    #[arg(long)]
    swing_up: bool,
    /// Begin the defects while the motor pushes the cart a little, with the links hanging
    #[arg(long, conflicts_with = "swing_up")]
    jog: bool,
    /// Begin the defects while the motor shakes the hanging links, as for `upright identify`
    #[arg(long, conflicts_with_all = ["swing_up", "jog"])]
    shake: bool,
    /// Where the firmware runs
    #[arg(long, value_enum, default_value_t = TargetOption::Host)]
    target: TargetOption,
    /// Seed of the campaign
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of runs: 1000, or with --healthy 20 for each law
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    runs: Option<u64>,
    /// Only defects of this kind
    #[arg(long, value_parser = kind)]
    kind: Option<Defect>,
    /// Only the run with this number
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["shard", "merge"])]
    only: Option<u64>,
    #[command(flatten)]
    split: Split,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Machines without a defect")]
    healthy: HealthyOptions,
}

/// Runs of a campaign.
const RUNS: u64 = 1000;

/// Runs of each kind in the negative control without detection.
const CONTROL_RUNS: u64 = 12;

fn kind(name: &str) -> Result<Defect, String> {
    let known = || Defect::ALL.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ");
    let found = Defect::ALL.iter().find(|kind| kind.name() == name);
    found.copied().ok_or_else(|| format!("known kinds: {}", known()))
}

impl FaultsCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if self.healthy.healthy {
            return self.healthy.run(&self.variation, self.runs, &self.split, self.json);
        }
        let runs = self.runs.unwrap_or(RUNS);
        let (rig, _, table) = self.variation.designed()?;
        let table = if self.swing_up {
            with_stored_motions(&self.variation.rig, &rig, table, Wanted::SwingUp)?
        } else {
            table
        };
        if self.swing_up && table.swing_up.is_none() {
            return Err(Failure::of_rig(rig.name, SwingUpError::NoMotions));
        }
        let built = self.target.built(&rig, &table)?;
        let place = built.place(self.seed);
        let mut possible = kinds(&table, place);
        let forces = if self.shake { Some(feed(&rig, &table, self.seed)?) } else { None };
        let during = match &forces {
            Some(forces) => During::Shaking(forces),
            None if self.jog => During::Jog,
            None => During::Balancing,
        };
        possible.retain(|&kind| during.is_proof(kind));
        let chosen: Vec<Defect> = match self.kind {
            Some(kind) if possible.contains(&kind) => vec![kind],
            Some(kind) => {
                return Err(Failure::argument(format!(
                    "--kind {}: not possible with this rig and --target",
                    kind.name()
                )));
            }
            None => possible,
        };
        let setup = Setup { rig: &rig, table: &table, place, detection: true, guards: true, during };
        if let Some(number) = self.only {
            return print(true, &one(&setup, &chosen, self.seed, number)?, String::new);
        }
        let options = json!({
            "gains": self.variation.changes(), "swing_up": self.swing_up, "jog": self.jog,
            "shake": self.shake, "target": self.target.name(), "seed": self.seed, "runs": runs, "kind": self.kind,
        });
        let work = |study: &Study| -> Result<_, Failure> {
            let result = with_bar("faults", runs, |tick| {
                campaign(&setup, &chosen, self.seed, runs, (study, "faults"), tick)
            })?;
            let control = self.control(&setup, &chosen, study)?;
            Ok((result, control, self.unguarded(&setup, &chosen, study)?))
        };
        self.split.study("faults", &rig, &options, work, |(result, control, unguarded)| {
            self.print(&rig, &result, control.as_ref())?;
            if let Some(unguarded) = &unguarded {
                self.say_unguarded(unguarded)?;
            }
            self.verdict(&result, control.as_ref())
        })
    }

    /// The negative control: the same on the host, without thresholds and limits.
    fn control(
        &self,
        setup: &Setup<'_>,
        chosen: &[Defect],
        study: &Study,
    ) -> Result<Option<Campaign>, Failure> {
        let chosen: Vec<Defect> =
            chosen.iter().copied().filter(|&kind| setup.during.needs_detection(kind)).collect();
        if chosen.is_empty() {
            return Ok(None);
        }
        let setup = Setup { place: RunPlace::Host, detection: false, ..*setup };
        let runs = CONTROL_RUNS * chosen.len() as u64;
        let part = "without detection";
        let result =
            with_bar(part, runs, |tick| campaign(&setup, &chosen, self.seed, runs, (study, part), tick))?;
        Ok(Some(result))
    }

    /// The other negative control, on the board: without watchdog, break input, MPU and register read-back.
    fn unguarded(
        &self,
        setup: &Setup<'_>,
        chosen: &[Defect],
        study: &Study,
    ) -> Result<Option<Campaign>, Failure> {
        let chosen: Vec<Defect> = chosen.iter().copied().filter(|kind| kind.needs_guard()).collect();
        if self.target != TargetOption::Board || chosen.is_empty() {
            return Ok(None);
        }
        let setup = Setup { guards: false, ..*setup };
        let runs = 2 * chosen.len() as u64;
        let part = "without guards";
        let result =
            with_bar(part, runs, |tick| campaign(&setup, &chosen, self.seed, runs, (study, part), tick))?;
        Ok(Some(result))
    }

    /// Prints how many runs without guards miss the defect; each kind must be missed at least once.
    fn say_unguarded(&self, unguarded: &Campaign) -> Result<(), Failure> {
        let missed: usize = unguarded.rows.iter().map(|row| row.missed).sum();
        let text = format!("without guards, {missed} of {} runs miss the defect", unguarded.runs);
        // With --json, stdout is one object.
        if self.json {
            eprintln!("{text}")
        } else {
            writeln!(std::io::stdout(), "{text}")?
        }
        match unguarded.rows.iter().find(|row| row.missed == 0) {
            Some(row) => Err(Failure::check(format!(
                "without guards, `{}` is never missed: the campaign proves nothing",
                row.kind.name()
            ))),
            None => Ok(()),
        }
    }

    fn print(&self, rig: &Rig, result: &Campaign, control: Option<&Campaign>) -> Result<(), Failure> {
        let object = json!({
            "rig": rig.name, "hash": format!("{:016x}", rig.hash()), "target": self.target.name(),
            "campaign": result, "without_detection": control,
        });
        print(self.json, &object, || text(result, control))
    }

    fn verdict(&self, result: &Campaign, control: Option<&Campaign>) -> Result<(), Failure> {
        let seen = |row: &&DefectRow| row.missed == 0;
        if let Some(row) = control.and_then(|control| control.rows.iter().find(seen)) {
            return Err(Failure::check(format!(
                "without detection, `{}` is never missed: the campaign proves nothing",
                row.kind.name()
            )));
        }
        let Some((row, number)) =
            result.rows.iter().find_map(|row| row.wrong.first().map(|number| (row, number)))
        else {
            return Ok(());
        };
        let wrong: usize = result.rows.iter().map(|row| row.wrong.len()).sum();
        let target = match self.target {
            TargetOption::Host => String::new(),
            other => format!(" --target {}", other.name()),
        };
        // A campaign of one kind numbers its runs differently.
        let kind = self.kind.map_or(String::new(), |kind| format!(" --kind {}", kind.name()));
        let phase = match (self.swing_up, self.jog, self.shake) {
            (true, ..) => " --swing-up",
            (_, true, _) => " --jog",
            (.., true) => " --shake",
            _ => "",
        };
        Err(Failure::check(format!(
            "{wrong} of {} runs have a wrong outcome; to repeat the first of `{}`: upright faults {} --seed {}{target}{kind}{phase} --only {number}",
            result.runs,
            row.kind.name(),
            self.variation.as_typed(),
            self.seed
        )))
    }
}

/// How many pushes by hand keep balancing, of those that would without the tests of the innovation.
fn pushes(row: &DefectRow) -> String {
    let mistaken: usize = row.mistaken.values().sum();
    if row.rejected + mistaken == 0 {
        return String::new();
    }
    let faults = row.mistaken.iter().map(|(fault, count)| format!("; {count} end with {fault}"));
    format!(
        "pushes that are survived without fault detection: {} of {} keep balancing{}\n",
        row.rejected,
        row.rejected + mistaken,
        faults.collect::<String>()
    )
}

/// The campaign as a table, a line for each defect.
fn text(result: &Campaign, control: Option<&Campaign>) -> String {
    let line = |name: &str, numbers: Vec<String>, faults: &str| {
        let widths = [6, 8, 9, 9, 6, 7, 7, 9, 8, 8];
        let cells = numbers.iter().zip(widths).map(|(number, width)| format!("{number:>width$}"));
        format!("{name:22}{}  {faults}\n", cells.collect::<String>())
    };
    let head = "runs masked rejected detected late missed false allowed worst onset";
    let mut text = line("defect", head.split(' ').map(str::to_owned).collect(), "faults");
    let counts = |row: &DefectRow| {
        [row.runs, row.masked, row.rejected, row.detected, row.late, row.missed, row.false_alarms]
    };
    for row in &result.rows {
        let ticks = [row.allowed, row.worst, row.worst_from_onset];
        let ticks = ticks.map(|ticks| ticks.map_or("-".to_owned(), |ticks| ticks.to_string()));
        let numbers = counts(row).map(|count| count.to_string()).into_iter().chain(ticks).collect();
        text += &line(row.kind.name(), numbers, &row.faults.join(", "));
    }
    let sum = |column: usize| result.rows.iter().map(|row| counts(row)[column]).sum::<usize>().to_string();
    text += &line("all", (0..7).map(sum).collect(), "");
    text.extend(result.rows.iter().filter(|row| row.kind == Defect::Push).map(pushes));
    if let Some(us) = result.rows.iter().find_map(|row| row.stop_to_off_us) {
        text += &format!("emergency stop between ticks: PWM inactive at most {us:.3} µs after the edge\n");
    }
    if let Some(control) = control {
        let missed: usize = control.rows.iter().map(|row| row.missed).sum();
        let runs: usize = control.rows.iter().map(|row| row.runs).sum();
        text += &format!("without detection, {missed} of {runs} runs miss the defect, as they must\n");
    }
    text
}
