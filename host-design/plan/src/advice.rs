//! What would help when there is no motion: the search is repeated with other values in the rig file.

use super::SwingUpError;
use super::check::check;
use super::remedy::{Remedy, RigLimit};
use super::robustness::{RandomRuns, random_runs};
use super::search::{SearchRanges, candidates};
use super::setting::{JUDGING_RUNS, Setting};
use upright_design::motion::Transition;
use upright_design::parallel::{Progress, ProgressStep};
use upright_design::rig::Rig;

/// Candidates tried with each change, and how many of them, those with the best scores, go through the random runs.
const TRIED: u64 = 12;
const KEPT: usize = 3;
/// Factors by which a limit is relaxed, one after the other, until there is a motion.
const FACTORS: [f64; 4] = [1.2, 1.5, 2.0, 3.0];
/// Factors by which the errors that a motion has to survive are made smaller.
const NARROWER: [f64; 4] = [0.8, 0.6, 0.4, 0.2];

/// Result of the search with a changed rig file.
#[derive(Debug)]
struct RelaxedSearch {
    /// Candidates tried.
    tried: u64,
    /// Candidates that were solved.
    solved: usize,
    /// Random runs of the best one.
    runs: Option<RandomRuns>,
}

impl RelaxedSearch {
    /// Searches for a motion of `rig` among the first `tried` candidates; the random runs have no supervisor.
    fn run(rig: &Rig, transition: Transition, tried: u64) -> Result<Self, SwingUpError> {
        let setting = Setting::of(rig)?;
        let request = SearchRanges::of(&setting);
        let mut found = candidates(&setting, &request, transition, 0..tried, &|_| ())?;
        let solved = found.len();
        found.retain(|candidate| check(&setting, &candidate.motion, transition).is_ok());
        found.sort_by(|a, b| a.score.total_cmp(&b.score));
        let runs = |motion| random_runs(&setting, motion, transition, &request.spread, 1, JUDGING_RUNS);
        let all = found.iter().take(KEPT).map(|candidate| runs(&candidate.motion));
        let all: Vec<RandomRuns> = all.collect::<Result<_, _>>()?;
        Ok(Self { tried, solved, runs: all.into_iter().max_by_key(|runs| runs.arrived) })
    }

    /// Whether the search found a motion that would be stored.
    fn is_good(&self, rig: &Rig) -> bool {
        self.runs.as_ref().is_some_and(|runs| is_enough(rig, runs))
    }

    fn text(&self) -> String {
        let Self { tried, solved, runs } = self;
        match runs {
            Some(RandomRuns { arrived, runs, .. }) => {
                format!("{solved} of {tried} candidates solved, {arrived} of {runs} random runs arrive")
            }
            None => format!("none of {tried} candidates solved"),
        }
    }
}

/// Whether the lower end of the confidence interval reaches `success_percent` of `[swing_up]`.
pub(crate) fn is_enough(rig: &Rig, runs: &RandomRuns) -> bool {
    let needed = rig.swing_up.clone().unwrap_or_default().success_percent;
    100.0 * runs.interval[0] >= needed
}

/// Names the binding limit, the one for which the smallest factor helps, and what else helps. Every number was tried:
/// with it in the rig file there is a motion for `transition`, or none, as the text says.
///
/// # Errors
/// [`SwingUpError`] if the rig cannot be raised at all.
pub(crate) fn advice(
    rig: &Rig,
    transition: Transition,
    progress: Progress<'_>,
) -> Result<String, SwingUpError> {
    let steps = (RigLimit::ALL.len() * FACTORS.len()) as u64;
    progress(ProgressStep::Begin(&format!("{transition}: what would help"), steps));
    advice_from(rig, transition, TRIED, &|| progress(ProgressStep::Done))
}

fn advice_from(
    rig: &Rig,
    transition: Transition,
    tried: u64,
    done: &dyn Fn(),
) -> Result<String, SwingUpError> {
    let longest_s = SearchRanges::of(&Setting::of(rig)?).duration_s[1];
    let (mut helps, mut no_help): (Vec<Help>, Vec<String>) = Default::default();
    for limit in RigLimit::ALL {
        match relaxed(rig, transition, tried, &[limit], longest_s, done)? {
            Some(Tried::Helps(help)) => helps.push(help),
            Some(Tried::NoHelp(text)) => no_help.push(text),
            None => {}
        }
    }
    helps.sort_by(|a, b| a.factor.total_cmp(&b.factor));
    let texts: Vec<String> = helps.iter().map(|help| help.text.clone()).collect();
    let mut advice = match helps.first() {
        Some(Help { name, .. }) => {
            format!("the binding limit is the {name}; there is a motion with {}", texts.join(", or with "))
        }
        None => match relaxed(rig, transition, tried, &RigLimit::ALL, longest_s, done)? {
            Some(Tried::Helps(help)) => {
                format!("no limit alone is binding; there is a motion with {}", help.text)
            }
            _ => "no limit alone is binding, and more of everything does not help".to_owned(),
        },
    };
    if !no_help.is_empty() {
        advice += &format!("; there is none with {}", no_help.join(", or with "));
    }
    Ok(advice)
}

/// Result of relaxing some limits.
enum Tried {
    Helps(Help),
    /// The last change, in words.
    NoHelp(String),
}

struct Help {
    factor: f64,
    /// The first of the limits.
    name: &'static str,
    /// The change, in words.
    text: String,
}

/// Relaxes all of `limits` by the same factor, which is raised until it helps. None if the rig has none of them.
fn relaxed(
    rig: &Rig,
    transition: Transition,
    tried: u64,
    limits: &[RigLimit],
    longest_s: f64,
    done: &dyn Fn(),
) -> Result<Option<Tried>, SwingUpError> {
    let mut last = None;
    for factor in FACTORS {
        let mut remedy = Remedy::unchanged(rig);
        let changed = limits.iter().filter(|limit| limit.relax(&mut remedy, longest_s, factor).is_some());
        let named = changed.map(|limit| limit.name(rig));
        let Some(name) = named.reduce(|first, _| first) else { return Ok(None) };
        let outcome = RelaxedSearch::run(&remedy.rig, transition, tried)?;
        done();
        let text = format!("{} ({})", remedy.text(), outcome.text());
        if outcome.is_good(&remedy.rig) {
            return Ok(Some(Tried::Helps(Help { factor, name, text })));
        }
        last = Some(Tried::NoHelp(text));
    }
    Ok(last)
}

/// States with which smaller errors of masses and friction enough runs would arrive, or how many with the smallest that
/// were tried; `runs` makes the runs of a changed rig.
///
/// # Errors
/// Those of `runs`.
pub(crate) fn smaller_errors(
    rig: &Rig,
    runs: impl Fn(&Rig) -> Result<RandomRuns, SwingUpError>,
) -> Result<String, SwingUpError> {
    let mut last = String::new();
    for factor in NARROWER {
        let mut remedy = Remedy::unchanged(rig);
        remedy.narrow(factor);
        let found = runs(&remedy.rig)?;
        last = format!("{} of {} arrive with {}", found.arrived, found.runs, remedy.text());
        if is_enough(&remedy.rig, &found) {
            break;
        }
    }
    Ok(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use upright_design::rig::RigText;

    /// Number of candidates: enough to find a motion.
    const FEW: u64 = 3;

    /// The rig of the single's file, with further values.
    fn single(values: &str) -> Rig {
        let text = std::fs::read_to_string("../../rigs/single-quanser-ip02.toml").unwrap();
        let mut text = RigText::parse(&text, "single.toml".as_ref()).unwrap();
        for (key, value) in values.split(" and ").map(|value| value.split_once(" = ").unwrap()) {
            text.set(key, value).unwrap();
        }
        Rig::from_toml(&text.to_string(), "single.toml".as_ref()).unwrap()
    }

    /// Written into the file, the advised values lead to a motion, and those said not to help do not.
    #[test]
    fn every_advised_number_gives_a_motion() {
        let short = "swing_up.longest_s = 2.2";
        assert_eq!(RelaxedSearch::run(&single(short), Transition::Up, FEW).unwrap().solved, 0);
        let text = advice_from(&single(short), Transition::Up, FEW, &|| ()).unwrap();
        println!("{text}");
        let (helps, no_help) = text.split_once("; there is none with ").unwrap();
        let (binding, helps) = helps.split_once("; there is a motion with ").unwrap();
        assert_eq!(binding, "the binding limit is the duration");
        assert!(
            no_help.contains("cart.travel_m = [-1.2, 1.2]") && no_help.contains("actuator.supply_v = 30")
        );
        for (advised, is_good) in [(helps, true), (no_help, false)] {
            for change in advised.split(", or with ") {
                let (values, found) = change.split_once(" (").unwrap();
                let rig = single(&format!("{short} and {values}"));
                let outcome = RelaxedSearch::run(&rig, Transition::Up, FEW).unwrap();
                assert_eq!(outcome.text(), found.trim_end_matches(')'), "{change}");
                assert_eq!(outcome.is_good(&rig), is_good, "{change}");
            }
        }
    }

    #[test]
    fn a_key_is_raised_as_far_as_the_machine_goes_and_then_the_machine() {
        let relaxed = |limit: RigLimit, values: &str, factor: f64| {
            let mut remedy = Remedy::unchanged(&single(values));
            limit.relax(&mut remedy, 5.0, factor).unwrap();
            // As if the values were written into the file.
            assert_eq!(single(&format!("{values} and {}", remedy.text())), remedy.rig);
            remedy.text()
        };
        let rail = "swing_up.rail_m = 0.25";
        assert_eq!(relaxed(RigLimit::Rail, rail, 1.2), "swing_up.rail_m = 0.3");
        assert_eq!(
            relaxed(RigLimit::Rail, rail, 2.0),
            "swing_up.rail_m = 0.5 and cart.travel_m = [-0.5, 0.5]"
        );
        let force = "swing_up.force_n = 10";
        assert_eq!(relaxed(RigLimit::Input, force, 1.2), "swing_up.force_n = 12");
        assert_eq!(
            relaxed(RigLimit::Input, force, 2.0),
            "swing_up.force_n = 20 and actuator.force_limit_n = 20 and actuator.supply_v = 15.4"
        );
        assert_eq!(relaxed(RigLimit::Speed, rail, 2.0), "limits.speed_m_per_s = 3");
        assert_eq!(relaxed(RigLimit::Speed, "swing_up.speed_m_per_s = 1", 2.0), "swing_up.speed_m_per_s = 2");
        assert_eq!(relaxed(RigLimit::Duration, rail, 1.5), "swing_up.longest_s = 7.5");
    }
}
