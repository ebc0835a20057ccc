//! `upright transitions`

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use upright_design::motion::{PlannedMotion, RaiseAndLower, Transition};
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_design::table::write_atomically;
use upright_plan::{
    Route, RouteRuns, Searched, Stored, StoredTransitions, SwingUpError, TransitionRuns, designed_table_with,
    motions, on_route, route_runs,
};

use upright_command::Failure;
use upright_command::progress::{with_progress, with_spinner};
use upright_command::{print, warn_of_an_arm};

/// Plans motions between any two equilibria, in which each link is up or down, and tries them one after the other.
///
/// An equilibrium is written with a letter for each link, from the cart outwards: u if it is up, d if it is down. The
/// motions between hanging and upright are those of `upright swing-up`, and must be stored. The motions found are
/// written beside the rig file, as RIG.transitions.json. A motion that arrives in too few runs of the firmware is
/// dropped: success_percent in [swing_up] says how many it has to be.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright transitions rigs/double-quanser-dbpen.toml --stored            try the stored motions, print the table
  upright transitions rigs/double-quanser-dbpen.toml                     search all of them first, which takes minutes
  upright transitions rigs/double-quanser-dbpen.toml --only ud-uu --candidates 100..400
  upright firmware run rigs/double-quanser-dbpen.toml --transitions      all of them with the image")]
pub(crate) struct TransitionsCommand {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Search only these transitions; the stored motions of others stay
    #[arg(long, value_name = "FROM-TO,…", value_delimiter = ',', conflicts_with = "stored")]
    only: Vec<String>,
    /// Numbers of the candidates to try for each transition
    #[arg(long, value_name = "FIRST..END", default_value = "0..100", value_parser = numbers, conflicts_with = "stored")]
    candidates: (u64, u64),
    /// Do not search; try the stored motions
    #[arg(long)]
    stored: bool,
    /// With --stored: number of runs of the firmware, each with another machine, with the seeds from 1 on
    #[arg(long, value_name = "N", default_value_t = 200, requires = "stored", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    runs: u32,
    /// Write no file beside the rig
    #[arg(long)]
    no_write: bool,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

fn numbers(text: &str) -> Result<(u64, u64), String> {
    let ends = text.split_once("..").and_then(|(first, end)| Some((first.parse().ok()?, end.parse().ok()?)));
    ends.filter(|(first, end)| first < end).ok_or_else(|| "give two numbers as 0..100".to_owned())
}

impl TransitionsCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        warn_of_an_arm(&rig);
        let links = rig.links();
        let swing_up = Stored::beside(&self.rig)
            .and_then(|stored| motions(&rig, &stored))
            .map_err(|source| failed(&rig, source))?;
        let mut stored = self.old(&rig)?;
        let mut searched = Vec::new();
        let Judged { transitions, runs, .. } = if self.stored {
            let all = stored.transitions(&rig).map_err(|source| failed(&rig, source))?;
            self.route_runs(&rig, &swing_up, all)?
        } else {
            searched = self.search(&rig, &mut stored)?;
            self.judge(&rig, &swing_up, &mut stored)?
        };
        let fault = |(transition, fault): &(Transition, String)| json!([transition.name(links), fault]);
        let faults: Vec<_> = runs.faults.iter().map(fault).collect();
        let object = json!({ "rig": rig.name, "searched": searched, "transitions": runs.transitions, "faults": faults });
        print(self.json, &object, || {
            let ended = |(transition, fault): &(Transition, String)| {
                format!("a run ended at {}: {fault}\n", transition.name(links))
            };
            text(&rig, &swing_up, &transitions, &runs.transitions)
                + &runs.faults.iter().map(ended).collect::<String>()
        })
    }

    /// The motions beside the rig file; none if there are none yet, and those of another rig do not count.
    fn old(&self, rig: &Rig) -> Result<StoredTransitions, Failure> {
        match StoredTransitions::beside(&self.rig) {
            Ok(stored) if stored.is_of(rig) => Ok(stored),
            Err(SwingUpError::NoFile { .. }) | Ok(_) if !self.stored => Ok(StoredTransitions::none(rig)),
            Ok(_) => Err(failed(rig, SwingUpError::Outdated)),
            Err(error) => Err(failed(rig, error)),
        }
    }

    fn write(&self, stored: &StoredTransitions) -> Result<(), Failure> {
        if !self.no_write {
            write_atomically(&StoredTransitions::path_beside(&self.rig), stored.to_json().as_bytes())?;
        }
        Ok(())
    }

    /// Searches a motion for each transition. The file is written after each, so that an interrupted search keeps what
    /// it has found.
    fn search(&self, rig: &Rig, stored: &mut StoredTransitions) -> Result<Vec<Searched>, Failure> {
        let links = rig.links();
        let (first, end) = self.candidates;
        let mut searched = Vec::new();
        for transition in self.wanted(links)? {
            let found = with_progress(|progress| stored.search(rig, transition, first..end, progress))
                .map_err(|source| failed(rig, source))?;
            eprintln!("{}", searched_line(&found, end - first, links));
            self.write(stored)?;
            searched.push(found);
        }
        Ok(searched)
    }

    /// Makes all motions that a route from hanging can reach, one after the other, with the whole firmware.
    fn route_runs(
        &self,
        rig: &Rig,
        swing_up: &RaiseAndLower,
        all: Vec<(Transition, PlannedMotion)>,
    ) -> Result<Judged, Failure> {
        let failed = |source| failed(rig, source);
        let links = rig.links();
        let held = on_route(&all.iter().map(|(transition, _)| *transition).collect::<Vec<_>>(), links);
        let (transitions, lost): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|(transition, _)| held.contains(transition));
        let table =
            with_spinner("the table", || designed_table_with(rig, swing_up, &transitions)).map_err(failed)?;
        let route = Route::of(rig, &table).ok_or_else(|| failed(SwingUpError::NoRoute))?;
        let runs = with_spinner("runs of the firmware", || {
            route_runs(rig, &table, &route, 1, self.runs as usize, &Study::whole())
        })
        .map_err(failed)?;
        Ok(Judged { transitions, lost, runs })
    }

    /// Judges the motions in runs of the firmware. One that arrives too rarely is dropped, and the others are judged
    /// again without it.
    fn judge(
        &self,
        rig: &Rig,
        swing_up: &RaiseAndLower,
        stored: &mut StoredTransitions,
    ) -> Result<Judged, Failure> {
        let links = rig.links();
        let needed = rig.swing_up.clone().unwrap_or_default().success_percent;
        let mut all = stored.all(rig).map_err(|source| failed(rig, source))?;
        loop {
            let judged = self.route_runs(rig, swing_up, all.clone())?;
            let others =
                || judged.runs.transitions.iter().filter(|one| !Transition::BOTH.contains(&one.transition));
            if let Some(one) = others().find(|one| 100.0 * one.interval[0] < needed) {
                eprintln!(
                    "{} is dropped: {} of {} arrive",
                    one.transition.name(links),
                    one.arrived,
                    one.tried
                );
                stored.drop(one.transition, links);
                all.retain(|(transition, _)| *transition != one.transition);
                continue;
            }
            // Of a motion that occurs more than once on the route, the first time counts: it is stored last.
            others().rev().for_each(|one| stored.judge(one.transition, links, [one.arrived, one.tried]));
            for (transition, _) in &judged.lost {
                let name = transition.name(links);
                eprintln!("{name} is not judged: the other motions do not lead there from hanging, and back");
            }
            self.write(stored)?;
            return Ok(judged);
        }
    }

    /// The transitions to search.
    fn wanted(&self, links: usize) -> Result<Vec<Transition>, Failure> {
        if self.only.is_empty() {
            return Ok(Transition::all(links)
                .into_iter()
                .filter(|transition| !Transition::BOTH.contains(transition))
                .collect());
        }
        let named = |name: &String| match Transition::named(name, links) {
            Some(transition) if !Transition::BOTH.contains(&transition) => Ok(transition),
            Some(_) => Err(Failure::argument(format!("{name} belongs to `upright swing-up`"))),
            None => {
                let example = format!("{}-{}", "u".repeat(links), "d".repeat(links));
                Err(Failure::argument(format!("{name}: give a letter for each link, as in {example}")))
            }
        };
        self.only.iter().map(named).collect()
    }
}

/// Runs with the motions between equilibria.
struct Judged {
    /// The motions on the route.
    transitions: Vec<(Transition, PlannedMotion)>,
    /// Those that no route can reach.
    lost: Vec<(Transition, PlannedMotion)>,
    runs: RouteRuns,
}

fn failed(rig: &Rig, source: SwingUpError) -> Failure {
    Failure::of_rig(&rig.name, source)
}

fn searched_line(searched: &Searched, tried: u64, links: usize) -> String {
    let Searched { transition, solved, runs, is_stored } = searched;
    let runs = runs.as_ref().map_or_else(String::new, |runs| {
        format!(", {} of {} random runs of the law arrive", runs.arrived, runs.runs)
    });
    let kept = if *is_stored { "" } else { ": not stored" };
    format!("{}: {solved} of {tried} candidates solved{runs}{kept}", transition.name(links))
}

/// The motions of the route as a table.
fn text(
    rig: &Rig,
    swing_up: &RaiseAndLower,
    transitions: &[(Transition, PlannedMotion)],
    runs: &[TransitionRuns],
) -> String {
    let (links, input) = (rig.links(), rig.input_quantity());
    let mut text = format!("{}, one motion after the other\n", rig.name);
    let (largest, farthest) = (input.title(), format!("farthest ({})", rig.output_quantity().unit));
    let width = largest.len() + 2;
    // Writing into a string cannot fail.
    let _ = writeln!(text, "motion      duration (s)  {largest}  {farthest}     arrive  95 % interval (%)");
    for TransitionRuns { transition, tried, arrived, interval } in runs {
        let motion = match transition {
            Transition::Up => Some(&swing_up.raise),
            Transition::Down => Some(&swing_up.lower),
            transition => {
                transitions.iter().find(|(planned, _)| planned == transition).map(|(_, motion)| motion)
            }
        };
        let [duration_s, largest, position_m] =
            motion.map_or([0.0; 3], |motion| [motion.duration_s(), motion.input(), motion.position_m()]);
        let [low, high] = interval.map(|end| 100.0 * end);
        let arrive = format!("{arrived} of {tried}");
        let _ = writeln!(
            text,
            "{:<11} {duration_s:>12.2} {largest:>width$.1} {position_m:>13.3} {arrive:>10}  {low:.1} to {high:.1}",
            transition.name(links)
        );
    }
    text
}
