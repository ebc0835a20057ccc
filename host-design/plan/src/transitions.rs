//! Motions between any two equilibria: search, check, storage. Runs of the firmware, in which the motions follow one
//! another, are in `route`.

use core::fmt::Write as _;
use core::ops::Range;
use std::collections::BTreeMap;
use std::path::{Path as FilePath, PathBuf};

use serde::{Deserialize, Serialize};

use super::SwingUpError;
use super::check::check;
use super::plan::{FoundMotion, best, restored};
use super::robustness::{MotionSpread, RandomRuns, random_runs};
use super::search::SearchRanges;
use super::setting::{JUDGING_RUNS, Setting};
use super::stored::{StoredKnots, header, read, request_hash};
use upright_design::motion::{PlannedMotion, Transition};
use upright_design::parallel::{self, Progress};
use upright_design::rig::Rig;

/// Share of random runs with the law alone that have to arrive before the firmware tries a motion.
const WORTH_A_RUN: f64 = 0.8;

/// Result of the search for a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Searched {
    /// Equilibria at which it starts and ends.
    pub transition: Transition,
    /// Number of candidates solved.
    pub solved: usize,
    /// Random runs of the best of them with the law alone; none if none is solved or the best does not pass the
    /// independent check.
    pub runs: Option<RandomRuns>,
    /// Whether its knots were stored: enough of the runs arrive.
    pub is_stored: bool,
}

/// Knots of motions between any equilibria.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct StoredTransitions {
    /// Name of the rig.
    rig: String,
    /// Hash of the rig and its `[swing_up]`.
    hash: String,
    /// Number of runs in which a motion arrived, and in which it was tried, by the name of its transition. A motion
    /// without an entry has not been judged.
    #[serde(rename = "tours")]
    judged: BTreeMap<String, [usize; 2]>,
    /// Knots of each motion, by the name of its transition.
    #[serde(flatten)]
    knots: BTreeMap<String, StoredKnots>,
}

impl StoredTransitions {
    /// Searches for a motion of `rig` for `transition` among the candidates `numbers`, and stores it if most random
    /// runs with the law alone arrive; runs of the firmware then judge it. Otherwise, a motion stored before is kept.
    ///
    /// # Errors
    /// [`SwingUpError`] if the rig cannot be raised at all.
    pub fn search(
        &mut self,
        rig: &Rig,
        transition: Transition,
        numbers: Range<u64>,
        progress: Progress<'_>,
    ) -> Result<Searched, SwingUpError> {
        let setting = Setting::with_transitions(rig, &[transition])?;
        let none = Searched { transition, solved: 0, runs: None, is_stored: false };
        let Some(found) = best(&setting, &SearchRanges::of(&setting), transition, numbers, progress)? else {
            return Ok(none);
        };
        let FoundMotion { motion, stored, search, .. } = found;
        let solved = search.map_or(0, |[_, solved]| solved);
        if check(&setting, &motion, transition).is_err() {
            return Ok(Searched { solved, ..none });
        }
        let runs = random_runs(&setting, &motion, transition, &MotionSpread::asked(rig), 1, JUDGING_RUNS)?;
        let is_stored = runs.arrived as f64 >= WORTH_A_RUN * runs.runs as f64;
        if is_stored {
            let name = transition.name(setting.chain.links.len());
            self.judged.remove(&name);
            self.knots.insert(name, stored);
        }
        Ok(Searched { transition, solved, runs: Some(runs), is_stored })
    }

    /// An empty set of motions for `rig`.
    pub fn none(rig: &Rig) -> Self {
        Self {
            rig: rig.name.clone(),
            hash: request_hash(rig),
            judged: BTreeMap::new(),
            knots: BTreeMap::new(),
        }
    }

    /// Whether these motions were planned for exactly these values of the rig file.
    pub fn is_of(&self, rig: &Rig) -> bool {
        self.hash == request_hash(rig)
    }

    /// Drops the motion of this transition.
    pub fn drop(&mut self, transition: Transition, links: usize) {
        self.judged.remove(&transition.name(links));
        self.knots.remove(&transition.name(links));
    }

    /// Records in how many runs this motion arrived, and in how many it was tried: from now on it is one of
    /// [`transitions`](Self::transitions).
    pub fn judge(&mut self, transition: Transition, links: usize, [arrived, tried]: [usize; 2]) {
        self.judged.insert(transition.name(links), [arrived, tried]);
    }

    /// The file beside a rig file: `rigs/my-rig.transitions.json` for `rigs/my-rig.toml`.
    pub fn path_beside(rig_file: &FilePath) -> PathBuf {
        rig_file.with_extension("transitions.json")
    }

    /// Reads the file beside a rig file.
    ///
    /// # Errors
    /// [`SwingUpError::NoFile`] if there is none; [`SwingUpError::BadFile`] if it cannot be used.
    pub fn beside(rig_file: &FilePath) -> Result<Self, SwingUpError> {
        read(Self::path_beside(rig_file), "transitions")
    }

    /// The motions that runs of the firmware have judged, refined for `rig`, with their gains.
    ///
    /// # Errors
    /// [`SwingUpError::Outdated`] if the rig file has changed since.
    pub fn transitions(&self, rig: &Rig) -> Result<Vec<(Transition, PlannedMotion)>, SwingUpError> {
        self.restored(rig, |name| self.judged.contains_key(name))
    }

    /// As [`transitions`](Self::transitions), including those that have not been judged yet.
    ///
    /// # Errors
    /// As for [`transitions`](Self::transitions).
    pub fn all(&self, rig: &Rig) -> Result<Vec<(Transition, PlannedMotion)>, SwingUpError> {
        self.restored(rig, |_| true)
    }

    fn restored(
        &self,
        rig: &Rig,
        is_wanted: impl Fn(&String) -> bool,
    ) -> Result<Vec<(Transition, PlannedMotion)>, SwingUpError> {
        let links = rig.links();
        if !self.is_of(rig) {
            return Err(SwingUpError::Outdated);
        }
        let named =
            |name| Transition::named(name, links).filter(|transition| !Transition::BOTH.contains(transition));
        let wanted = self.knots.iter().filter(|(name, _)| is_wanted(name));
        let transitions: Option<Vec<_>> = wanted.map(|(name, knots)| Some((named(name)?, knots))).collect();
        let transitions = transitions.ok_or(SwingUpError::Outdated)?;
        let setting = Setting::with_transitions(
            rig,
            &transitions.iter().map(|(transition, _)| *transition).collect::<Vec<_>>(),
        )?;
        let one = |index: usize| -> Result<(Transition, PlannedMotion), SwingUpError> {
            let (transition, knots) = transitions[index];
            let motion = restored(&setting, transition, knots)?;
            check(&setting, &motion, transition)?;
            Ok((transition, motion))
        };
        parallel::try_map(0..transitions.len(), one)
    }

    /// The motions as JSON, one knot per line.
    pub fn to_json(&self) -> String {
        let mut text = header(&self.rig, &self.hash);
        let entry =
            |(name, [arrived, tried]): (&String, &[usize; 2])| format!("\n\"{name}\": [{arrived}, {tried}]");
        let judged: Vec<String> = self.judged.iter().map(entry).collect();
        // Writing into a string cannot fail.
        let _ = write!(text, ",\n\"tours\": {{{}\n}}", judged.join(","));
        self.knots.iter().for_each(|(name, motion)| motion.write(&mut text, name));
        text.push_str("\n}\n");
        text
    }
}
