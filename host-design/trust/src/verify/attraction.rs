//! Region of attraction on the nonlinear plant: the largest initial tilts and the largest step from which the loop
//! recovers.

use serde::Serialize;
use upright::table::Law;

use super::error::{VerifyError, chain, within};
use super::trial::{Horizon, edge, leaning, scenario, trial, trials};
use upright_design::parallel;
use upright_design::plant::LANES;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, SimulationError};
use upright_design::table::TableValues;

/// Settings of the search for the edges of the region.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AttractionSettings {
    /// Duration of each run and what counts as back near rest, before it is [widened](Horizon::widened) for the law's
    /// limit cycle; the position's band is also at least a tenth of a step.
    pub horizon: Horizon,
    /// Relative precision of an edge.
    pub relative: f64,
    /// Largest initial angle tried (rad).
    pub largest_angle_rad: f64,
    /// Largest step tried (m).
    pub largest_step_m: f64,
}

impl Default for AttractionSettings {
    fn default() -> Self {
        Self { horizon: Horizon::default(), relative: 0.01, largest_angle_rad: 1.0, largest_step_m: 2.0 }
    }
}

/// The largest initial deviation from which a run still recovers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Edge {
    /// Its size (rad or m); 0 if the loop does not even recover from the smallest one tried (1/10000 of the largest).
    pub size: f64,
    /// Largest force in the run from there (N).
    pub peak_force_n: f64,
    /// Whether it is the largest size that was tried.
    pub at_largest_tried: bool,
}

/// Edge for one link leaning alone, all others upright (those above it are displaced, but vertical).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tilt {
    /// The link, from 1.
    pub link: usize,
    /// Its largest angle from the vertical (rad), to the worse side.
    pub edge: Edge,
}

/// Edge for all links leaning by the same angle, in the worst combination of sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstTilt {
    /// Side of each link, +1 or -1.
    pub signs: Vec<i8>,
    /// Largest angle of every link from the vertical (rad).
    pub edge: Edge,
    /// Number of combinations tried.
    pub tried: usize,
}

/// Largest initial deviations from rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Attraction {
    /// The law in the loop.
    pub law: Law,
    /// Duration of the runs, and what counted as back near rest.
    pub horizon: Horizon,
    /// Edges for each link alone.
    pub tilts: Vec<Tilt>,
    /// Edge for all links together; none for a model.
    pub worst: Option<WorstTilt>,
    /// Largest jump of the set-point without the governor (m); none if the law cannot follow a set-point (N = 0).
    pub raw_step: Option<Edge>,
}

/// With more links than this, not every combination of sides is tried: only those with at most one change of side
/// along the chain, and the alternating one.
const LINKS_FOR_ALL_SIDES: usize = 7;

/// Finds the edges for `law` by doubling and bisection (see [`AttractionSettings`]): no fall within the horizon, and
/// near rest at its end. Runs are without noise, from encoders if the table has an observer.
///
/// Of two mirror images only one is tried if the rail is symmetric, because then the loop is, too.
///
/// # Errors
/// [`VerifyError`] if the runs cannot be started or a setting is invalid.
pub fn attraction(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &AttractionSettings,
) -> Result<Attraction, VerifyError> {
    let settings = &settings.widened(rig, table, law)?;
    // All searches run at once, so that none waits for the slowest of another kind.
    let ((tilts, worst), raw_step) = rayon::join(
        || rayon::join(|| single_tilts(rig, table, law, settings), || worst_tilt(rig, table, law, settings)),
        || raw_step(rig, table, law, settings),
    );
    Ok(Attraction { law, horizon: settings.horizon, tilts: tilts?, worst: worst?, raw_step: raw_step? })
}

/// The edges of [`attraction`] for each link alone; empty for a model.
///
/// # Errors
/// As for [`attraction`].
pub fn largest_tilts(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &AttractionSettings,
) -> Result<Vec<Tilt>, VerifyError> {
    Ok(single_tilts(rig, table, law, &settings.widened(rig, table, law)?)?)
}

impl AttractionSettings {
    /// With the horizon [widened](Horizon::widened) for the law's limit cycle.
    fn widened(&self, rig: &Rig, table: &TableValues, law: Law) -> Result<Self, VerifyError> {
        within("relative", self.relative, 1e-6..=1.0, "a width from 1e-6 to 1")?;
        within("largest_angle_rad", self.largest_angle_rad, 1e-6..=1.5, "an angle from 1e-6 to 1.5 rad")?;
        within("largest_step_m", self.largest_step_m, 1e-6..=1e6, "a step from 1e-6 to 1e6 m")?;
        Ok(Self { horizon: self.horizon.widened(rig, table, law)?, ..*self })
    }
}

/// Links of the rig, 0 for a model, and whether its rail is symmetric.
fn links(rig: &Rig) -> (usize, bool) {
    chain(rig, "links").map_or((0, true), |chain| {
        let [low, high] = chain.cart.travel_m;
        (chain.links.len(), low == -high)
    })
}

/// The edge for links that lean to the sides in `direction`; 0: upright.
fn lean(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &AttractionSettings,
    direction: &[i8],
) -> Result<Edge, SimulationError> {
    search(rig, table, settings, settings.largest_angle_rad, |size| {
        let angles: Vec<f64> = direction.iter().map(|&side| size * f64::from(side)).collect();
        Scenario { start: leaning(rig, &angles), ..scenario(rig, law, settings.horizon.duration_s) }
    })
}

fn single_tilts(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &AttractionSettings,
) -> Result<Vec<Tilt>, SimulationError> {
    let (links, mirrored) = links(rig);
    let alone = |(link, side): (usize, i8)| {
        let direction: Vec<i8> = (0..links).map(|other| if other == link { side } else { 0 }).collect();
        Ok(Tilt { link: link + 1, edge: lean(rig, table, law, settings, &direction)? })
    };
    let single: Vec<(usize, i8)> = (0..links)
        .flat_map(|link| [(link, 1), (link, -1)])
        .filter(|&(_, side)| side > 0 || !mirrored)
        .collect();
    let all: Vec<Tilt> = parallel::try_map::<_, _, SimulationError>(single, alone)?;
    let worse = |pair: &[Tilt]| pair.iter().min_by(|a, b| a.edge.size.total_cmp(&b.edge.size)).cloned();
    Ok(all.chunks(if mirrored { 1 } else { 2 }).filter_map(worse).collect())
}

fn worst_tilt(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &AttractionSettings,
) -> Result<Option<WorstTilt>, SimulationError> {
    let (links, mirrored) = links(rig);
    let sides = sides(links, mirrored);
    let edges = parallel::try_map(&sides, |signs| lean(rig, table, law, settings, signs))?;
    let worst = sides.iter().zip(edges).min_by(|(_, a), (_, b)| a.size.total_cmp(&b.size));
    Ok(worst.map(|(signs, edge)| WorstTilt { signs: signs.clone(), edge, tried: sides.len() }))
}

fn raw_step(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &AttractionSettings,
) -> Result<Option<Edge>, SimulationError> {
    if table.law(law).is_none_or(|gains| gains.n == 0.0) {
        return Ok(None);
    }
    let raw = table.clone().without_governor();
    search(rig, &raw, settings, settings.largest_step_m, |size| Scenario {
        step_m: size,
        ..scenario(rig, law, settings.horizon.duration_s)
    })
    .map(Some)
}

fn search(
    rig: &Rig,
    table: &TableValues,
    settings: &AttractionSettings,
    largest: f64,
    start: impl Fn(f64) -> Scenario,
) -> Result<Edge, SimulationError> {
    let found = edge([1e-4 * largest, largest], settings.relative, |size| {
        let scenario = start(size);
        let position_m = settings.horizon.position_m.max(0.1 * scenario.step_m.abs());
        let outcome = trial(rig, table, &scenario, &Horizon { position_m, ..settings.horizon })?;
        Ok::<_, SimulationError>(outcome.comes_to_rest().then_some(outcome.peak_force_n))
    })?;
    Ok(match found {
        Some((size, peak_force_n)) => Edge { size, peak_force_n, at_largest_tried: size >= largest },
        None => Edge { size: 0.0, peak_force_n: 0.0, at_largest_tried: false },
    })
}

/// Combinations of sides for `links` links; without mirror images if `mirrored`.
fn sides(links: usize, mirrored: bool) -> Vec<Vec<i8>> {
    if links == 0 {
        return Vec::new();
    }
    let side = |negative: bool| if negative { -1 } else { 1 };
    let first: Vec<Vec<i8>> = if links <= LINKS_FOR_ALL_SIDES {
        (0..1u32 << (links - 1))
            .map(|mask| (0..links).map(|link| side(link > 0 && mask >> (link - 1) & 1 == 1)).collect())
            .collect()
    } else {
        let changed = (1..=links).map(|change| (0..links).map(|link| side(link >= change)).collect());
        changed.chain([(0..links).map(|link| side(link % 2 == 1)).collect()]).collect()
    };
    if mirrored {
        return first;
    }
    let other = first.clone().into_iter().map(|signs| signs.into_iter().map(|side| -side).collect());
    first.iter().cloned().chain(other).collect()
}

/// One axis of a map: a state, and its values at the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapAxis {
    /// Index of the state (relative angles, as everywhere).
    pub state: usize,
    /// First and last value (SI).
    pub range: [f64; 2],
    /// Number of values, equally spaced.
    pub points: usize,
}

impl MapAxis {
    fn value(&self, index: usize) -> f64 {
        let [low, high] = self.range;
        low + (high - low) * index as f64 / (self.points.max(2) - 1) as f64
    }
}

/// The region of attraction in the plane of two states, all others 0 at the start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Map {
    /// Horizontal axis, from left to right.
    pub across: MapAxis,
    /// Vertical axis, from the first row to the last.
    pub down: MapAxis,
    /// For each row, the time after which each start has come near rest (s); none if it falls or does not settle.
    pub settled_s: Vec<Vec<Option<f64>>>,
}

/// Runs every start of the plane, with `horizon` [widened](Horizon::widened) for the law's limit cycle. `done` is
/// called for each start, from any thread.
///
/// Of two mirror images only one is run if rail and plane are symmetric, because then the loop is, too.
///
/// # Errors
/// [`VerifyError`] if the runs cannot be started or an axis names no state.
pub fn attraction_map(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    [across, down]: [MapAxis; 2],
    horizon: &Horizon,
    done: &(dyn Fn() + Sync),
) -> Result<Map, VerifyError> {
    for axis in [across, down] {
        let last = rig.states() as f64 - 1.0;
        within("the axis' state", axis.state as f64, 0.0..=last, "the index of a state")?;
        within("the axis' points", axis.points as f64, 1.0..=1e4, "1 to 10000 points")?;
    }
    let horizon = &horizon.widened(rig, table, law)?;
    let case = |&index: &usize| {
        let mut scenario = scenario(rig, law, horizon.duration_s);
        scenario.start[down.state] = down.value(index / across.points);
        scenario.start[across.state] = across.value(index % across.points);
        (rig.clone(), scenario)
    };
    let batch = |indices: &[usize]| -> Result<Vec<Option<f64>>, SimulationError> {
        let outcomes = trials(table, &indices.iter().map(case).collect::<Vec<_>>(), horizon)?;
        indices.iter().for_each(|_| done());
        Ok(outcomes.into_iter().map(|outcome| outcome.at_rest_after_s).collect())
    };
    let all = across.points * down.points;
    let (_, is_rail_symmetric) = links(rig);
    let mirrored = is_rail_symmetric && [across, down].iter().all(|axis| axis.range[0] == -axis.range[1]);
    let run = if mirrored { all.div_ceil(2) } else { all };
    let indices: Vec<usize> = (0..run).collect();
    // Many runs fall early and free their lanes, so a batch holds more runs than lanes.
    let mut cells = parallel::try_map_in_batches(&indices, 4 * LANES, batch)?;
    for image in (0..all - run).rev() {
        cells.push(cells[image]);
        done();
    }
    Ok(Map { across, down, settled_s: cells.chunks(across.points).map(<[_]>::to_vec).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_combination_of_sides_comes_once() {
        for links in 1..=4 {
            let mut all = sides(links, false);
            all.sort();
            all.dedup();
            assert_eq!(all.len(), 1 << links);
            assert_eq!(sides(links, true).len(), 1 << (links - 1));
        }
        assert_eq!(sides(9, true).len(), 10);
    }
}
