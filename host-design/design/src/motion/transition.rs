//! Transitions: from one state of rest to another.

use core::f64::consts::PI;

use serde::{Serialize, Serializer};
use upright::table::Equilibrium;

use crate::plant::whole_turns;

/// Start and end of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transition {
    /// From hanging to upright; then it balances.
    Up,
    /// From upright to hanging; then the motor is off.
    Down,
    /// Between any other two equilibria.
    Between {
        /// Where it begins.
        from: Equilibrium,
        /// Where it ends.
        to: Equilibrium,
        /// Number of links.
        links: usize,
    },
}

impl Transition {
    /// Both transitions between hanging and upright, in the order of a session.
    pub const BOTH: [Self; 2] = [Self::Up, Self::Down];

    /// The transition of a chain of `links` links from one equilibrium to another.
    pub fn between(from: Equilibrium, to: Equilibrium, links: usize) -> Self {
        let hanging = Equilibrium::hanging(links);
        match (from, to) {
            (Equilibrium::UPRIGHT, to) if to == hanging => Self::Down,
            (from, Equilibrium::UPRIGHT) if from == hanging => Self::Up,
            _ => Self::Between { from, to, links },
        }
    }

    /// All transitions between two equilibria of a chain of `links` links.
    pub fn all(links: usize) -> Vec<Self> {
        let equilibria = || (0..1 << links).map(Equilibrium::of_bits);
        let others = |from| equilibria().filter(move |&to| to != from);
        equilibria().flat_map(|from| others(from).map(move |to| Self::between(from, to, links))).collect()
    }

    /// The transition with this name, for example `uu-ud`; none if there is no such transition.
    pub fn named(name: &str, links: usize) -> Option<Self> {
        let (from, to) = name.split_once('-')?;
        let (from, to) = (equilibrium_named(from, links)?, equilibrium_named(to, links)?);
        (from != to).then(|| Self::between(from, to, links))
    }

    /// The name that [`named`](Self::named) accepts.
    pub fn name(self, links: usize) -> String {
        format!("{}-{}", posture_name(self.from(links), links), posture_name(self.to(links), links))
    }

    /// The equilibrium at which it begins.
    pub fn from(self, links: usize) -> Equilibrium {
        match self {
            Self::Up => Equilibrium::hanging(links),
            Self::Down => Equilibrium::UPRIGHT,
            Self::Between { from, .. } => from,
        }
    }

    /// The equilibrium at which it ends.
    pub fn to(self, links: usize) -> Equilibrium {
        match self {
            Self::Up => Equilibrium::UPRIGHT,
            Self::Down => Equilibrium::hanging(links),
            Self::Between { to, .. } => to,
        }
    }

    /// Whether all links hang at its beginning.
    pub fn begins_hanging(self) -> bool {
        match self {
            Self::Up => true,
            Self::Down => false,
            Self::Between { from, links, .. } => from == Equilibrium::hanging(links),
        }
    }

    /// Whether all links hang at its end.
    pub fn ends_hanging(self) -> bool {
        match self {
            Self::Up => false,
            Self::Down => true,
            Self::Between { to, links, .. } => to == Equilibrium::hanging(links),
        }
    }

    /// States of rest at the start and the end of the motion. A link that the motion changes turns the other way round
    /// if `reversed` says so.
    pub fn ends(self, states: usize, reversed: impl Fn(usize) -> bool) -> [Vec<f64>; 2] {
        let links = states / 2 - 1;
        let (from, to) = (self.from(links), self.to(links));
        let [start, mut end] = [from, to].map(|at| rest(at, states));
        let changed = |link: usize| from.is_down(link) != to.is_down(link);
        for link in (0..links).filter(|&link| changed(link) && reversed(link)) {
            // From π to 0 becomes from π to 2π, from 0 to π becomes from 0 to -π.
            let turn = if from.is_down(link) { 2.0 * PI } else { -2.0 * PI };
            end[2 + 2 * link] += turn;
            if link + 1 < links {
                end[4 + 2 * link] -= turn;
            }
        }
        [start, end]
    }

    /// The ends of a motion whose last state is near `last`, with the same whole turns.
    pub fn ends_near(self, last: &[f64]) -> [Vec<f64>; 2] {
        let [start, mut end] = self.ends(last.len(), |_| false);
        if let Self::Between { .. } = self {
            for (end, last) in end.iter_mut().zip(last).skip(2).step_by(2) {
                *end += whole_turns(last - *end);
            }
        }
        [start, end]
    }
}

/// The state at rest with the cart at 0, its angles within half a turn.
pub fn rest(at: Equilibrium, states: usize) -> Vec<f64> {
    let mut state = vec![0.0; states];
    for (joint, angle) in state.iter_mut().skip(2).step_by(2).enumerate() {
        *angle = f64::from(at.half_turns(joint)) * PI;
    }
    state
}

/// The posture of a chain at rest: a letter for each link, `u` if it is up and `d` if it is down.
pub fn posture_name(at: Equilibrium, links: usize) -> String {
    (0..links).map(|link| if at.is_down(link) { 'd' } else { 'u' }).collect()
}

/// The equilibrium with this [`posture_name`]; none if there is not exactly one valid letter for each link.
pub fn equilibrium_named(name: &str, links: usize) -> Option<Equilibrium> {
    let bit = |(link, letter)| match letter {
        'u' => Some(0),
        'd' => Some(1u32 << link),
        _ => None,
    };
    let bits = name.chars().enumerate().take(u32::BITS as usize).map(bit).sum::<Option<u32>>()?;
    (name.chars().count() == links).then(|| Equilibrium::of_bits(bits))
}

impl core::fmt::Display for Transition {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::Up => f.write_str("raising"),
            Self::Down => f.write_str("lowering"),
            Self::Between { links, .. } => f.write_str(&self.name(links)),
        }
    }
}

impl Serialize for Transition {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            Self::Up => serializer.serialize_str("up"),
            Self::Down => serializer.serialize_str("down"),
            Self::Between { links, .. } => serializer.serialize_str(&self.name(links)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_transition_has_a_name_of_its_own() {
        let transitions = Transition::all(2);
        assert_eq!(transitions.len(), 12);
        assert_eq!(Transition::all(3).len(), 56);
        for transition in &transitions {
            assert_eq!(Transition::named(&transition.name(2), 2), Some(*transition));
        }
        assert_eq!(Transition::named("dd-uu", 2), Some(Transition::Up));
        assert_eq!(Transition::named("uuu-ddd", 3), Some(Transition::Down));
        for name in ["uu", "uu-uu", "uu-u", "uu-uuu", "uu-ux", ""] {
            assert_eq!(Transition::named(name, 2), None, "{name}");
        }
    }

    #[test]
    fn a_transition_ends_at_rest_however_its_links_turn() {
        let transition = Transition::named("udu-ddu", 3).unwrap();
        let [start, end] = transition.ends(8, |_| false);
        assert_eq!(start, [0.0, 0.0, 0.0, 0.0, PI, 0.0, -PI, 0.0]);
        assert_eq!(end, [0.0, 0.0, PI, 0.0, 0.0, 0.0, -PI, 0.0]);
        let [_, end] = transition.ends(8, |_| true);
        assert_eq!(end, [0.0, 0.0, -PI, 0.0, 2.0 * PI, 0.0, -PI, 0.0]);
        assert_eq!(transition.ends_near(&end)[1], end);
        assert_eq!(Transition::Up.ends(4, |_| false), [vec![0.0, 0.0, PI, 0.0], vec![0.0; 4]]);
    }
}
