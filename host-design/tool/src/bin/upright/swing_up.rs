//! `upright swing-up`

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use serde_json::json;
use upright_design::design::Stilling;
use upright_design::motion::Transition;
use upright_design::rig::Rig;
use upright_design::simulate::Trace;
use upright_design::study::Study;
use upright_design::table::{TableValues, write_atomically};
use upright_plan::{
    Condition, FirmwareRuns, Margin, MotionJudgement, RecoveryRuns, Script, SolvedCandidate, StillingRuns,
    Stored, SwingUpError, SwingUpPlan, Tumbling, designed_table, firmware_runs, judge, margins, motions,
    recovered, refined, search, solved, stilled,
};
use upright_tool::figure::{Figure, margins_figure, run_svg, stroboscope_svg, trade_figure};
use upright_tool::in_the_loop::RunError;

use crate::split::Split;
use upright_command::Failure;
use upright_command::progress::{with_bar, with_progress, with_spinner};
use upright_command::{print, warn_of_an_arm};

/// Plans the motions with which the rig raises itself from hanging to upright, and lowers itself again.
///
/// They are written beside the rig file, as RIG.swing-up.json. Nothing is written if the motions fail the random runs
/// that [swing_up] asks for. Exit status 3 if there is no motion; the message names the binding limit and what
/// would help.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright swing-up rigs/quadruple-paper.toml                  search, judge, write rigs/quadruple-paper.swing-up.json
  upright swing-up rigs/quadruple-paper.toml --stored         judge the stored motions again, in seconds
  upright swing-up rigs/quadruple-paper.toml --stored --falls 100    and how many of 100 falls are recovered
  upright swing-up rigs/quadruple-paper.toml --check          search again; exit status 1 if the file differs
  upright swing-up rigs/quadruple-paper.toml --table          200 runs of the firmware with each of eight errors
  upright swing-up rigs/quadruple-paper.toml --margins        how hard each link may be pushed on the way
  upright swing-up rigs/quadruple-paper.toml --trade --svg trade.svg
  upright swing-up rigs/single-quanser-ip02.toml --no-write --json
  upright swing-up rigs/quadruple-paper.toml --stored --svg run.svg --csv run.csv")]
pub(crate) struct SwingUpCommand {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Judge the stored motions instead of searching; the rig file may have changed since
    #[arg(long)]
    stored: bool,
    /// Write nothing; exit status 1 if the file beside the rig differs
    #[arg(long)]
    check: bool,
    /// Write no file beside the rig
    #[arg(long, conflicts_with = "check")]
    no_write: bool,
    /// Write a complete run (up, balance, step, down) as CSV; with --margins or --trade, the data of the figure
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Draw it as SVG
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Draw the raising as a stroboscopic picture (SVG)
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Run the firmware with the stored motions under each of several conditions, and print the table
    #[arg(long, conflicts_with_all = ["stored", "check", "no_write", "csv", "svg", "picture", "seed"])]
    table: bool,
    /// With --table: runs under each condition, with the seeds from 1 on
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    runs: u32,
    #[command(flatten)]
    split: Split,
    /// How hard each link may be pushed at each moment of the stored motions
    #[arg(long, conflicts_with_all = ["table", "stored", "check", "no_write", "picture", "seed"])]
    margins: bool,
    /// Duration against force and robustness of the candidates of a search
    #[arg(long, conflicts_with_all = ["margins", "table", "stored", "check", "no_write", "picture"])]
    trade: bool,
    /// Fell the raised rig so many times: how often the motor stills the links and they are raised again
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with_all = ["table", "margins", "trade"])]
    falls: u32,
    /// Seed of the complete run; with --trade, of candidates and random runs
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Number of moments of a motion at which margins are computed.
const MOMENTS: usize = 40;
/// Number of candidates of --trade.
const TRADED: u64 = 40;

impl SwingUpCommand {
    /// Runs of the stored motions under all conditions.
    fn rows(&self, rig: &Rig, study: &Study) -> Result<Vec<SwingUpRow>, SwingUpError> {
        let stored = Stored::beside(&self.rig)?;
        let designed = |rig: &Rig| -> Result<_, SwingUpError> {
            let motions = refined(rig, &stored)?;
            Ok((designed_table(rig, &motions)?, motions))
        };
        let usual = designed(rig)?;
        let row = |condition: Condition| {
            let rig = condition.designed(rig);
            let (table, motions) = if condition.joint_counts.is_some() { &designed(&rig)? } else { &usual };
            let runs = firmware_runs(&rig, table, motions, &condition, 1..1 + u64::from(self.runs), study)?;
            Ok(SwingUpRow { condition, runs })
        };
        Condition::all().into_iter().map(row).collect()
    }

    /// Prints and draws the margins of both stored motions.
    fn margins(&self, rig: &Rig) -> Result<(), Failure> {
        let failed = |source: SwingUpError| Failure::of_rig(&rig.name, source);
        let stored = Stored::beside(&self.rig).map_err(failed)?;
        let table =
            motions(rig, &stored).and_then(|motions| designed_table(rig, &motions)).map_err(failed)?;
        let both = with_margins(rig, &table)?;
        let title = format!("{}: how hard a link may be pushed", rig.name);
        self.draw(&margins_figure(&title, &both))?;
        let one = |(transition, margins): &(_, _)| json!({ "transition": transition, "margins": margins });
        let transitions: Vec<_> = both.iter().map(one).collect();
        print(self.json, &json!({ "rig": rig.name, "transitions": transitions }), || {
            both.iter().map(|(transition, margins)| margins_text(*transition, margins)).collect()
        })
    }

    /// Prints and draws duration, force and robustness of the candidates of a search.
    fn trade(&self, rig: &Rig) -> Result<(), Failure> {
        let failed = |source: SwingUpError| Failure::of_rig(&rig.name, source);
        let solved = with_progress(|progress| solved(rig, TRADED, self.seed, progress)).map_err(failed)?;
        let title = format!("{}: candidates of a raising", rig.name);
        self.draw(&trade_figure(&title, &solved, rig))?;
        let object = json!({ "rig": rig.name, "tried": TRADED, "solved": solved });
        print(self.json, &object, || traded_text(&solved, rig))
    }

    /// Writes a figure as --svg and --csv say.
    fn draw(&self, figure: &Figure) -> Result<(), Failure> {
        if let Some(path) = &self.csv {
            write_atomically(path, figure.csv()?.as_bytes())?;
        }
        if let Some(path) = &self.svg {
            write_atomically(path, figure.svg()?.as_bytes())?;
        }
        Ok(())
    }

    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        warn_of_an_arm(&rig);
        let failed = |source: SwingUpError| Failure::of_rig(&rig.name, source);
        if self.table {
            // The outcome depends on the motions as well as on the rig file.
            let stored = Stored::beside(&self.rig).map_err(failed)?.to_json();
            let options = json!({ "runs": self.runs, "motions": stored });
            let work = |study: &Study| with_spinner("random runs", || self.rows(&rig, study)).map_err(failed);
            return self
                .split
                .study("swing-up --table", &rig, &options, work, |rows| print_rows(&rig, &rows, self.json));
        }
        if self.split.is_used() {
            return Err(Failure::argument("--shard and --merge are for --table".to_owned()));
        }
        if self.margins {
            return self.margins(&rig);
        }
        if self.trade {
            return self.trade(&rig);
        }
        let old = Stored::beside(&self.rig);
        let plan = if self.stored {
            let old = old.clone().map_err(failed)?;
            with_progress(|progress| judge(&rig, &old, progress)).map_err(failed)?
        } else {
            with_progress(|progress| search(&rig, progress)).map_err(failed)?
        };
        let script = Script::draw(&rig, &plan.table, self.seed, false).map_err(failed)?;
        let demonstration = script.run(&plan.table).map_err(RunError::from)?;
        self.write_files(&rig, &demonstration.trace, plan.raise.peaks.duration_s)?;
        let file = Stored::path_beside(&self.rig);
        let differs = old.map_or(true, |old| old.to_json() != plan.stored.to_json());
        if !self.check && !self.no_write && differs {
            write_atomically(&file, plan.stored.to_json().as_bytes())?;
        }
        let stilling = stilling(&rig, &plan.table).map_err(failed)?;
        let falls = self.falls(&rig, &plan.table).map_err(failed)?;
        let object = json!({
            "rig": rig.name, "raise": plan.raise, "lower": plan.lower, "stilling": stilling, "falls": falls,
        });
        let falls = || falls.map_or(String::new(), |falls| format!("\nfalls\n  {falls}\n"));
        print(self.json, &object, || text(&rig, &plan) + &stilling_text(&stilling) + &falls())?;
        if self.check && differs {
            return Err(Failure::check(format!("{} differs from these motions", file.display())));
        }
        Ok(())
    }

    /// Runs in which the rig is felled, if they are wanted.
    fn falls(&self, rig: &Rig, table: &TableValues) -> Result<Option<RecoveryRuns>, SwingUpError> {
        if self.falls == 0 {
            return Ok(None);
        }
        let runs = || recovered(rig, table, (1, u64::from(self.falls)), &Study::whole());
        Ok(Some(RecoveryRuns::of(&with_spinner("falls", runs)?)))
    }

    /// Writes the files that are wanted of a run, in which the rig is raised for `raised_s`.
    fn write_files(&self, rig: &Rig, trace: &Trace, raised_s: f64) -> Result<(), Failure> {
        if let Some(path) = &self.csv {
            let mut bytes = Vec::new();
            trace.write_csv(&mut bytes)?;
            write_atomically(path, &bytes)?;
        }
        if let Some(path) = &self.svg {
            let title = format!("{}: up, balance, step, down", rig.name);
            write_atomically(path, run_svg(rig, trace, &title)?.as_bytes())?;
        }
        if let (Some(path), Some(chain)) = (&self.picture, rig.chain()) {
            let picture = stroboscope_svg(chain, trace, 0.0, raised_s);
            write_atomically(path, picture.as_bytes())?;
        }
        Ok(())
    }
}

/// Energy of the links in the runs of stilling, as a multiple of that of upright ones, and the number of runs.
const TUMBLING: Tumbling = Tumbling { energies: 1.0, has_dry_friction: false };
const STILLED: u64 = 40;

/// The law with which the motor stills the links, and runs of it; none if it cannot.
fn stilling(rig: &Rig, table: &TableValues) -> Result<Option<(Stilling, StillingRuns)>, SwingUpError> {
    let Ok(law) = Stilling::of(rig) else { return Ok(None) };
    let runs = stilled(rig, table, TUMBLING, (1, STILLED), &Study::whole())?;
    Ok(Some((law, StillingRuns::of(table, &runs))))
}

fn stilling_text(stilling: &Option<(Stilling, StillingRuns)>) -> String {
    stilling.as_ref().map_or_else(String::new, |(law, runs)| format!("\n{law}{runs}"))
}

/// Margins of both motions of `table`, with a progress bar.
pub(crate) fn with_margins(
    rig: &Rig,
    table: &TableValues,
) -> Result<Vec<(Transition, Vec<Margin>)>, Failure> {
    let of = |transition, done: &(dyn Fn() + Sync)| {
        Ok((transition, margins(rig, table, transition, MOMENTS, done)?))
    };
    let both: Result<_, SwingUpError> =
        with_bar("margins", (Transition::BOTH.len() * MOMENTS) as u64, |done| {
            Transition::BOTH.into_iter().map(|transition| of(transition, done)).collect()
        });
    both.map_err(|source| Failure::of_rig(&rig.name, source))
}

/// Duration, force and robustness of each candidate.
fn traded_text(solved: &[SolvedCandidate], rig: &Rig) -> String {
    let (largest, unit) = (rig.input_quantity().title(), rig.output_quantity().unit);
    let width = largest.len() + 1;
    let head =
        format!("duration (s)  {largest}  farthest ({unit})  fragility     arrive  with twice the errors");
    let line = |SolvedCandidate { duration_s, input, position_m, score, runs, wider }: &SolvedCandidate| {
        let [arrive, twice] = [runs, wider].map(|runs| format!("{} of {}", runs.arrived, runs.runs));
        format!(
            "{duration_s:>12.2} {input:>width$.2} {position_m:>13.3} {score:>10.2} {arrive:>10} {twice:>22}\n"
        )
    };
    format!("{} of {TRADED} candidates are solved\n{head}\n", solved.len())
        + &solved.iter().map(line).collect::<String>()
}

/// Both margins of each link at each moment, and the least of each link.
fn margins_text(transition: Transition, margins: &[Margin]) -> String {
    let links = margins.first().map_or(0, |margin| margin.links_n.len());
    let least = |link: usize| {
        let of_link = |margin: &Margin| margin.links_n[link].into_iter().fold(f64::INFINITY, f64::min);
        margins.iter().map(|margin| (of_link(margin), margin.at_s)).min_by(|(a, _), (b, _)| a.total_cmp(b))
    };
    let mut text =
        format!("{transition}: largest push against each link's angle and along it (N)\n  time (s)");
    // Writing into a string cannot fail.
    (1..=links).for_each(|link| _ = write!(text, "{:>16}", format!("link {link}")));
    text.push('\n');
    for Margin { at_s, links_n } in margins {
        let _ = write!(text, "{at_s:>10.3}");
        links_n.iter().for_each(|[down, up]| _ = write!(text, "{:>8.3}{up:>8.3}", -down));
        text.push('\n');
    }
    for (link, (least, at_s)) in (0..links).filter_map(|link| Some((link, least(link)?))) {
        let _ = writeln!(text, "  least of link {}: {least:.3} N at {at_s:.3} s", link + 1);
    }
    text
}

/// Runs under a condition.
#[derive(Serialize)]
struct SwingUpRow {
    condition: Condition,
    runs: FirmwareRuns,
}

/// Prints the rows as Markdown, or as one JSON object.
fn print_rows(rig: &Rig, rows: &[SwingUpRow], is_json: bool) -> Result<(), Failure> {
    let line = |SwingUpRow { condition, runs }: &SwingUpRow| {
        let FirmwareRuns { refused, raise, lower, faults } = runs;
        let ended = refused.iter().chain(faults).map(|(reason, count)| format!("{reason}: {count}"));
        let ended = ended.collect::<Vec<_>>().join(", ");
        let [raised, lowered] = [raise, lower].map(|runs| format!("{} of {}", runs.arrived, runs.runs));
        format!("| {} | {} | {raised} | {lowered} | {ended} |\n", rig.name, condition.name)
    };
    print(is_json, &json!({ "rig": rig.name, "rows": rows }), || rows.iter().map(line).collect())
}

fn text(rig: &Rig, plan: &SwingUpPlan) -> String {
    let (mut text, input) = (format!("{}\n", rig.name), rig.input_quantity());
    let (position, speed, noun) = (rig.base().position(), rig.base().speed(), rig.base().noun());
    for MotionJudgement { transition, search, score, peaks, runs } in [&plan.raise, &plan.lower] {
        let percent = runs.interval.map(|end| 100.0 * end);
        // Writing into a string cannot fail.
        let _ = writeln!(text, "\n{transition}");
        if let Some([tried, solved]) = search {
            let _ = writeln!(text, "  trajectories solved       {solved:>10} of {tried}");
        }
        let _ = write!(
            text,
            "  duration                  {:>10.3} s\n  \
               {:<25} {:>10.2} {}\n  \
               farthest from the middle  {:>10.3} {}\n  \
               {:<25} {:>10.2} {}\n  \
               largest rate of a joint   {:>10.1} rad/s\n  \
               used of the nearest limit {:>10.0} %\n  \
               error of a tick           {:>10.1e} (adaptive integrator)\n  \
               fragility                 {score:>10.2}\n  \
               random runs that arrive   {:>10} of {} (95 % interval {:.1} to {:.1} %)\n  \
               largest deviation         {:>10.3} rad\n",
            peaks.duration_s,
            format!("largest {}", input.name),
            peaks.input,
            input.unit,
            peaks.position_m,
            position.unit,
            format!("largest speed of the {noun}"),
            peaks.speed_m_per_s,
            speed.unit,
            peaks.rate_rad_per_s,
            100.0 * peaks.used,
            peaks.drift,
            runs.arrived,
            runs.runs,
            percent[0],
            percent[1],
            runs.deviation_rad,
        );
    }
    text
}
