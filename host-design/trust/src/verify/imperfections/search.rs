//! The search for the sizes at which one imperfection makes the loop fall or turns the motor off.

use std::collections::BTreeMap;

use upright::table::Law;

use super::survival::{BristleSurvival, Cure, ImperfectionSettings, SizeRuns, Survival};
use crate::verify::error::VerifyError;
use crate::verify::trial::{
    Horizon, Outcome, disturbed, leaning, moving, trial, trial_from_power_up, waking_lean,
};
use upright_design::parallel;
use upright_design::rig::{Imperfection, LargestSize, Rig};
use upright_design::simulate::{FallKind, Scenario, Sensing};
use upright_design::table::TableValues;

/// Sizes are tried from this share of a good machine's to this multiple of a poor one's.
const RANGE: [f64; 2] = [1.0 / 64.0, 64.0];
/// A change of the rig file is a cure if the motor stays on up to this many times the size.
const CURES: f64 = 1.2;
/// Largest share of a tick that a delay within it may have.
pub(super) const LARGEST_OF_TICK: f64 = 0.999;

/// What has to survive a run.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Judge {
    /// The whole firmware, or the controller alone.
    is_firmware: bool,
    /// With a set-point that moves, or at rest.
    moves: bool,
}

impl Judge {
    const CONTROLLER: Self = Self { is_firmware: false, moves: false };
    const FIRMWARE: Self = Self { is_firmware: true, moves: false };
    const FIRMWARE_MOVING: Self = Self { is_firmware: true, moves: true };
}

/// What the set-point does in the runs of a verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Setpoint {
    /// It stays where it is.
    Rests,
    /// It rests in the first runs, and moves in as many others.
    RestsAndMoves,
}

pub(super) struct SizeSearch<'a> {
    pub(super) rig: &'a Rig,
    pub(super) table: &'a TableValues,
    pub(super) law: Law,
    pub(super) settings: &'a ImperfectionSettings,
}

impl SizeSearch<'_> {
    /// Searches for the sizes of one imperfection, and for the best of these cures.
    pub(super) fn survival(
        &self,
        imperfection: &'static Imperfection,
        changed: &[(String, TableValues)],
    ) -> Result<Survival, VerifyError> {
        let [_, largest_tried] = self.range(imperfection);
        let of_bristles = imperfection.bristles().into_iter().map(|bristle_rad| {
            let first = |judge| {
                self.first(imperfection, &|size| {
                    self.end(&[imperfection.on_with_bristle(self.rig, size, bristle_rad)], judge)
                })
            };
            Ok((
                bristle_rad,
                first(Judge::CONTROLLER)?,
                first(Judge::FIRMWARE)?,
                first(Judge::FIRMWARE_MOVING)?,
            ))
        });
        let of_bristles = of_bristles.collect::<Result<Vec<_>, VerifyError>>()?;
        let least = |sizes: &mut dyn Iterator<Item = Option<(f64, FallKind)>>| {
            sizes.flatten().min_by(|(a, _), (b, _)| a.total_cmp(b))
        };
        let falls_at = least(&mut of_bristles.iter().map(|one| one.1));
        let turned_off_at = least(&mut of_bristles.iter().map(|one| one.2));
        let off_moving_at = least(&mut of_bristles.iter().map(|one| one.3));
        let first_at = [falls_at, turned_off_at, off_moving_at].into_iter().flatten();
        let danger_at = first_at.map(|(size, _)| size).fold(largest_tried, f64::min);
        Ok(Survival {
            imperfection,
            falls_at: falls_at.map(|(size, _)| size),
            turned_off_at: turned_off_at.map(|(size, _)| size),
            ended_by: turned_off_at.map(|(_, kind)| kind),
            off_moving_at: off_moving_at.map(|(size, _)| size),
            cure: turned_off_at.map_or(Ok(None), |(size, _)| self.cure(imperfection, size, changed))?,
            tried: changed.iter().map(|(change, _)| change.clone()).collect(),
            bristles: of_bristles
                .into_iter()
                .filter_map(|(bristle_rad, falls, off, moving)| {
                    let [falls_at, turned_off_at, off_moving_at] =
                        [falls, off, moving].map(|at| at.map(|(size, _)| size));
                    Some(BristleSurvival {
                        bristle_rad: bristle_rad?,
                        falls_at,
                        turned_off_at,
                        off_moving_at,
                    })
                })
                .collect(),
            largest_tried,
            danger: imperfection.typical[1] / danger_at,
        })
    }

    /// The change with which the motor stays on up to the largest size, if that is clearly more than `size`.
    fn cure(
        &self,
        imperfection: &'static Imperfection,
        size: f64,
        changed: &[(String, TableValues)],
    ) -> Result<Option<Cure>, VerifyError> {
        let mut best: Option<Cure> = None;
        for (change, table) in changed {
            let search = SizeSearch { table, ..*self };
            // Most changes help little: those are found with one size.
            let needed = best.as_ref().map_or(CURES * size, |best| best.turned_off_at);
            if search.end(&imperfection.on_each(self.rig, needed), Judge::FIRMWARE)?.is_some() {
                continue;
            }
            let found = self.first(imperfection, &|size| {
                search.end(&imperfection.on_each(self.rig, size), Judge::FIRMWARE)
            })?;
            let [_, largest] = self.range(imperfection);
            let turned_off_at = found.map_or(largest, |(size, _)| size);
            best = Some(Cure { change: change.clone(), turned_off_at });
        }
        Ok(best)
    }

    /// The smallest and the largest size that are tried.
    fn range(&self, imperfection: &Imperfection) -> [f64; 2] {
        let [good, poor] = imperfection.typical;
        let most = match imperfection.largest {
            LargestSize::Any => f64::INFINITY,
            LargestSize::Of(size) => size,
            LargestSize::Tick => LARGEST_OF_TICK * self.rig.tick.period_s,
        };
        [RANGE[0] * good, (RANGE[1] * poor).min(most)]
    }

    /// The first size at which a run ends, and how.
    fn first(
        &self,
        imperfection: &Imperfection,
        end: &dyn Fn(f64) -> Result<Option<FallKind>, VerifyError>,
    ) -> Result<Option<(f64, FallKind)>, VerifyError> {
        let (start, relative) = (imperfection.typical[1], self.settings.relative);
        let mut ends = BTreeMap::new();
        let found = first(self.range(imperfection), start, relative, |size| {
            let end = end(size)?;
            ends.insert(size.to_bits(), end);
            Ok::<_, VerifyError>(end.is_none())
        })?;
        Ok(found.and_then(|size| Some((size, (*ends.get(&size.to_bits())?)?))))
    }

    /// How the first of the runs on these machines ends that does not survive.
    fn end(&self, machines: &[Rig], judge: Judge) -> Result<Option<FallKind>, VerifyError> {
        for real in machines {
            for seed in 1..=self.settings.seeds {
                if let Some(fall) = self.run(real, seed, judge)?.fall {
                    return Ok(Some(fall.kind));
                }
            }
        }
        Ok(None)
    }

    fn run(&self, real: &Rig, seed: u64, judge: Judge) -> Result<Outcome, VerifyError> {
        let ImperfectionSettings { duration_s, disturbance, .. } = self.settings;
        let scenario = Scenario {
            is_supervised: judge.is_firmware,
            start: leaning(real, &vec![waking_lean(real); real.links()]),
            ..disturbed(real, self.law, *duration_s, disturbance, seed)
        };
        let scenario = if judge.moves { moving(scenario, self.table) } else { scenario };
        let horizon = Horizon::default();
        // A firmware without encoders cannot be started.
        if !judge.is_firmware || scenario.sensing != Sensing::Encoders {
            return Ok(trial(real, self.table, &scenario, &horizon)?);
        }
        Ok(trial_from_power_up(real, self.table, &scenario, &horizon)?)
    }

    /// Runs of all seeds on a machine with this imperfection alone; of the machines of
    /// [`on_each`](Imperfection::on_each), the one on which the fewest survive.
    pub(super) fn alone(
        &self,
        imperfection: &Imperfection,
        size: f64,
        setpoint: Setpoint,
    ) -> Result<SizeRuns, VerifyError> {
        let machines = imperfection.on_each(self.rig, size);
        let all = machines.iter().map(|real| self.verdict(real, setpoint)).collect::<Result<Vec<_>, _>>()?;
        let worst = all.into_iter().min_by_key(|runs| (runs.stayed_on, runs.survived));
        worst.map_or_else(|| self.verdict(self.rig, setpoint), Ok)
    }

    /// Runs of all seeds on this machine, by the whole firmware and, where it turns the motor off, by the controller
    /// alone.
    pub(super) fn verdict(&self, real: &Rig, setpoint: Setpoint) -> Result<SizeRuns, VerifyError> {
        let one = |(seed, moves): (u64, bool)| {
            let by_firmware = self.run(real, seed, Judge { is_firmware: true, moves })?;
            let alone = match by_firmware.fall {
                Some(_) => self.run(real, seed, Judge { is_firmware: false, moves })?,
                None => by_firmware.clone(),
            };
            Ok::<_, VerifyError>((by_firmware, alone))
        };
        let of_all = |moves: bool| (1..=self.settings.seeds).map(move |seed| (seed, moves));
        let moved = of_all(true).filter(|_| setpoint == Setpoint::RestsAndMoves);
        let runs: Vec<(u64, bool)> = of_all(false).chain(moved).collect();
        let all: Vec<_> = parallel::try_map(&runs, |&run| one(run))?;
        let ended: Vec<FallKind> =
            all.iter().filter_map(|(by_firmware, _)| Some(by_firmware.fall.as_ref()?.kind)).collect();
        let largest = |of: fn(&Outcome) -> f64| all.iter().map(|(_, alone)| of(alone)).fold(0.0, f64::max);
        Ok(SizeRuns {
            runs: runs.len() as u64,
            survived: all.iter().filter(|(_, alone)| alone.survives()).count() as u64,
            stayed_on: (runs.len() - ended.len()) as u64,
            ended_by: ended.first().copied(),
            peak_angle_rad: largest(|outcome| outcome.peak_angle_rad),
            peak_position_m: largest(|outcome| outcome.peak_error_m),
        })
    }
}

/// The first size that does not hold: searched from `start` by factors of 4, up if it holds and down if not, then by
/// bisection of the logarithm to within `relative`. None if even the largest holds; the smallest if that does not.
///
/// Small backlash and stiff belts take long to simulate, so the search does not begin with them.
pub(in crate::verify) fn first<E>(
    [smallest, largest]: [f64; 2],
    start: f64,
    relative: f64,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<Option<f64>, E> {
    let (mut held, mut lost) = (None, None);
    let mut size = start.clamp(smallest, largest);
    while held.is_none() || lost.is_none() {
        if holds(size)? {
            held = Some(size);
            if size >= largest {
                return Ok(None);
            }
            size = (4.0 * size).min(largest);
        } else {
            lost = Some(size);
            if size <= smallest {
                return Ok(lost);
            }
            size = (0.25 * size).max(smallest);
        }
    }
    let (mut held, mut lost) = (held.unwrap_or(smallest), lost.unwrap_or(largest));
    while lost - held > relative * held {
        let middle = (held * lost).sqrt();
        if holds(middle)? { held = middle } else { lost = middle }
    }
    Ok(Some(lost))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_size_that_is_not_held_is_found() {
        for start in [0.01, 0.3, 2.0, 10.0] {
            let find = |edge: f64| first::<()>([0.01, 10.0], start, 0.01, |size| Ok(size < edge)).unwrap();
            assert!(find(0.5).is_some_and(|found| (0.5..0.505).contains(&found)));
            assert_eq!((find(20.0), find(0.001)), (None, Some(0.01)));
        }
    }
}
