//! `upright transitions`

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_design::swing_up::{
    Leg, Searched, Stored, StoredTransitions, SwingUp, SwingUpError, Tour, Tours, Transition, Way,
    designed_table_with, motions, on_tour, tours,
};
use upright_design::table::write_atomically;

use crate::failure::Failure;
use crate::progress::{with_search, with_spinner};

/// Plans motions between any two equilibria, in which each link is up or down, and tries them one after the other.
///
/// An equilibrium is written with a letter for each link, from the cart outwards: u if it is up, d if it is down. The
/// motions between hanging and upright are those of `upright swing-up`, and must be stored. The motions found are
/// written beside the rig file, as RIG.transitions.json. A motion that arrives in too few tours of the firmware is
/// dropped: success_percent in [swing_up] says how many it has to be.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright transitions rigs/double-quanser-dbpen.toml --stored            try the stored motions, print the table
  upright transitions rigs/double-quanser-dbpen.toml                     search all ways first, which takes minutes
  upright transitions rigs/double-quanser-dbpen.toml --ways ud-uu --candidates 100..400
  upright firmware run rigs/double-quanser-dbpen.toml --transitions      all of them in QEMU, bit for bit")]
pub(crate) struct Transitions {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Search only these ways; the stored motions of others stay
    #[arg(long, value_name = "FROM-TO,…", value_delimiter = ',', conflicts_with = "stored")]
    ways: Vec<String>,
    /// Numbers of the candidates to try for each way
    #[arg(long, value_name = "FIRST..END", default_value = "0..100", value_parser = numbers, conflicts_with = "stored")]
    candidates: (u64, u64),
    /// Do not search; try the stored motions
    #[arg(long)]
    stored: bool,
    /// With --stored: number of tours of the firmware, each with another machine, with the seeds from 1 on
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

impl Transitions {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        let links = rig.states() / 2 - 1;
        let swing_up = Stored::beside(&self.rig)
            .and_then(|stored| motions(&rig, &stored))
            .map_err(|source| failed(&rig, source))?;
        let mut stored = self.old(&rig)?;
        let mut searched = Vec::new();
        let Toured { transitions, tours, .. } = if self.stored {
            let all = stored.transitions(&rig).map_err(|source| failed(&rig, source))?;
            self.toured(&rig, &swing_up, all)?
        } else {
            searched = self.search(&rig, &mut stored)?;
            self.judge(&rig, &swing_up, &mut stored)?
        };
        let mut out = std::io::stdout().lock();
        if self.json {
            let faults: Vec<_> =
                tours.faults.iter().map(|(way, fault)| json!([way.name(links), fault])).collect();
            let object =
                json!({ "rig": rig.name, "searched": searched, "tour": tours.legs, "faults": faults });
            return Ok(writeln!(out, "{object}")?);
        }
        write!(out, "{}", text(&rig, &swing_up, &transitions, &tours.legs))?;
        for (way, fault) in tours.faults {
            writeln!(out, "a tour ended at {}: {fault}", way.name(links))?;
        }
        Ok(())
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

    /// Searches a motion for each way. The file is written after each, so that an interrupted search keeps what it has
    /// found.
    fn search(&self, rig: &Rig, stored: &mut StoredTransitions) -> Result<Vec<Searched>, Failure> {
        let links = rig.states() / 2 - 1;
        let (first, end) = self.candidates;
        let mut searched = Vec::new();
        for way in self.ways(links)? {
            let found = with_search(|progress| stored.search(rig, way, first..end, progress))
                .map_err(|source| failed(rig, source))?;
            eprintln!("{}", searched_line(&found, end - first, links));
            self.write(stored)?;
            searched.push(found);
        }
        Ok(searched)
    }

    /// Makes all motions that a tour from hanging can reach, one after the other, with the whole firmware.
    fn toured(&self, rig: &Rig, swing_up: &SwingUp, all: Vec<Transition>) -> Result<Toured, Failure> {
        let failed = |source| failed(rig, source);
        let links = rig.states() / 2 - 1;
        let held = on_tour(&all.iter().map(|transition| transition.way).collect::<Vec<_>>(), links);
        let (transitions, lost): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|transition| held.contains(&transition.way));
        let table =
            with_spinner("the table", || designed_table_with(rig, swing_up, &transitions)).map_err(failed)?;
        let tour = Tour::of(rig, &table).ok_or_else(|| failed(SwingUpError::NoTour))?;
        let tours =
            with_spinner("tours", || tours(rig, &table, &tour, 1, self.runs as usize, &Study::whole()))
                .map_err(failed)?;
        Ok(Toured { transitions, lost, tours })
    }

    /// Judges the motions on tours. One that arrives too rarely is dropped, and the others are judged again without it.
    fn judge(
        &self,
        rig: &Rig,
        swing_up: &SwingUp,
        stored: &mut StoredTransitions,
    ) -> Result<Toured, Failure> {
        let links = rig.states() / 2 - 1;
        let needed = rig.swing_up.clone().unwrap_or_default().success_percent;
        let mut all = stored.all(rig).map_err(|source| failed(rig, source))?;
        loop {
            let toured = self.toured(rig, swing_up, all.clone())?;
            let others = || toured.tours.legs.iter().filter(|leg| !Way::BOTH.contains(&leg.way));
            if let Some(leg) = others().find(|leg| 100.0 * leg.interval[0] < needed) {
                eprintln!("{} is dropped: {} of {} arrive", leg.way.name(links), leg.arrived, leg.tried);
                stored.drop(leg.way, links);
                all.retain(|transition| transition.way != leg.way);
                continue;
            }
            // Of a motion that occurs more than once in the tour, the first leg counts: it is stored last.
            others().rev().for_each(|leg| stored.judge(leg.way, links, [leg.arrived, leg.tried]));
            for Transition { way, .. } in &toured.lost {
                let name = way.name(links);
                eprintln!("{name} is not judged: the other motions do not lead there from hanging, and back");
            }
            self.write(stored)?;
            return Ok(toured);
        }
    }

    /// The ways to search.
    fn ways(&self, links: usize) -> Result<Vec<Way>, Failure> {
        if self.ways.is_empty() {
            return Ok(Way::all(links).into_iter().filter(|way| !Way::BOTH.contains(way)).collect());
        }
        let named = |name: &String| match Way::named(name, links) {
            Some(way) if !Way::BOTH.contains(&way) => Ok(way),
            Some(_) => Err(Failure::BadArgument(format!("{name} belongs to `upright swing-up`"))),
            None => {
                let example = format!("{}-{}", "u".repeat(links), "d".repeat(links));
                Err(Failure::BadArgument(format!("{name}: give a letter for each link, as in {example}")))
            }
        };
        self.ways.iter().map(named).collect()
    }
}

/// Tours by the motions between equilibria.
struct Toured {
    /// The motions on the tour.
    transitions: Vec<Transition>,
    /// Those that no tour can reach.
    lost: Vec<Transition>,
    tours: Tours,
}

fn failed(rig: &Rig, source: SwingUpError) -> Failure {
    Failure::SwingUp { rig: rig.name.clone(), source }
}

fn searched_line(searched: &Searched, tried: u64, links: usize) -> String {
    let Searched { way, solved, runs, is_stored } = searched;
    let runs = runs.as_ref().map_or_else(String::new, |runs| {
        format!(", {} of {} random runs of the law arrive", runs.arrived, runs.runs)
    });
    let kept = if *is_stored { "" } else { ": not stored" };
    format!("{}: {solved} of {tried} candidates solved{runs}{kept}", way.name(links))
}

/// The legs of the tour as a table.
fn text(rig: &Rig, swing_up: &SwingUp, transitions: &[Transition], legs: &[Leg]) -> String {
    let links = rig.states() / 2 - 1;
    let mut text = format!("{}, one motion after the other\n", rig.name);
    // Writing into a string cannot fail.
    let _ = writeln!(text, "motion      duration (s)  force (N)  farthest (m)     arrive  95 % interval (%)");
    for Leg { way, tried, arrived, interval } in legs {
        let motion = match way {
            Way::Up => Some(&swing_up.raise),
            Way::Down => Some(&swing_up.lower),
            way => transitions.iter().find(|transition| transition.way == *way).map(|found| &found.motion),
        };
        let [duration_s, force_n, position_m] =
            motion.map_or([0.0; 3], |motion| [motion.duration_s(), motion.force_n(), motion.position_m()]);
        let [low, high] = interval.map(|end| 100.0 * end);
        let arrive = format!("{arrived} of {tried}");
        let _ = writeln!(
            text,
            "{:<11} {duration_s:>12.2} {force_n:>10.1} {position_m:>13.3} {arrive:>10}  {low:.1} to {high:.1}",
            way.name(links)
        );
    }
    text
}
