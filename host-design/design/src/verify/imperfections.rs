//! Which imperfection of the machine topples the loop, and at what size: each one alone, beside what is typical.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;
use upright::table::Law;

use super::trial::{Disturbance, Horizon, Unverifiable, chain, scenario, trial, within};
use crate::rig::{PerJoint, Reality, Rig};
use crate::simulate::{Scenario, SimulationError};
use crate::table::TableValues;

/// One kind of imperfection.
#[derive(Debug, Serialize)]
pub struct Imperfection {
    /// Its key in `[reality]`.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What is typical of a carefully built machine, from a good one to a poor one.
    pub typical: [f64; 2],
    /// Where that comes from.
    pub source: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
    #[serde(skip)]
    set: fn(&mut Reality, f64),
}

/// Every imperfection that a size can be searched for.
pub static IMPERFECTIONS: [Imperfection; 10] = [
    Imperfection {
        key: "joint_friction_n_m",
        unit: "N·m",
        typical: [1e-4, 1e-3],
        source: "estimate: greased ball bearings of 3 to 8 mm bore",
        remedy: "smaller bearings without seals, with oil instead of grease; more weight on the angles",
        set: |reality, size| reality.friction.joint_friction_n_m = PerJoint::all(size),
    },
    Imperfection {
        key: "cart_friction_n",
        unit: "N",
        typical: [0.2, 2.0],
        source: "estimate: miniature ball guides, light to sealed",
        remedy: "a guide without seals; less preload",
        set: |reality, size| reality.friction.cart_friction_n = size,
    },
    Imperfection {
        key: "homing_error_rad",
        unit: "rad",
        typical: [1e-3, 1e-2],
        source: "a hanging link stops within F / (m g c) of the vertical: friction over weight times distance",
        remedy: "tap the hanging links before homing; integral action brings the cart back",
        set: |reality, size| reality.sensors.homing_error_rad = PerJoint::all(size),
    },
    Imperfection {
        key: "eccentricity_rad",
        unit: "rad",
        typical: [1e-3, 5e-3],
        source: "2 e / D: a disk of 20 mm, 0.01 to 0.05 mm off its centre",
        remedy: "centre the disk; an encoder with its own bearing",
        set: |reality, size| {
            reality.sensors.eccentricity_rad = PerJoint::all(size);
            reality.sensors.eccentricity_phase_rad = PerJoint::all(core::f64::consts::FRAC_PI_4);
        },
    },
    Imperfection {
        key: "rail_tilt_rad",
        unit: "rad",
        typical: [5e-4, 5e-3],
        source: "estimate: 0.5 to 5 mm over a metre, with and without a spirit level",
        remedy: "level the rail; integral action brings the cart back",
        set: |reality, size| reality.sensors.rail_tilt_rad = size,
    },
    Imperfection {
        key: "backlash_m",
        unit: "m",
        typical: [2e-5, 2e-4],
        source: "estimate: toothed belt under tension, to rack and pinion",
        remedy: "a tensioned belt instead of a rack; an encoder on the cart",
        set: |reality, size| reality.drive_train.backlash_m = size,
    },
    Imperfection {
        key: "belt_compliance_m_per_n",
        unit: "m/N",
        typical: [2e-6, 2e-5],
        source: "estimate: toothed belts 6 to 15 mm wide, a metre long",
        remedy: "a wider or shorter belt, or one with steel cords",
        set: |reality, size| reality.drive_train.belt_compliance_m_per_n = size,
    },
    Imperfection {
        key: "driver_lag_s",
        unit: "s",
        typical: [5e-5, 1e-3],
        source: "L / R of small motors (0.18 mH / 2.6 Ω: 70 µs) to large ones",
        remedy: "a driver with a current loop; tell the design with delay_ticks",
        set: |reality, size| reality.driver.driver_lag_s = size,
    },
    Imperfection {
        key: "force_percent",
        unit: "%",
        typical: [2.0, 15.0],
        source: "estimate: measured, to the tolerance of a catalogue's torque constant with that of the gear",
        remedy: "measure the force at standstill and correct torque_constant_n_m_per_a",
        set: |reality, size| reality.driver.force_percent = size,
    },
    Imperfection {
        key: "parameter_spread_percent",
        unit: "%",
        typical: [0.5, 5.0],
        source: "estimate: weighed and measured parts, to a drawing",
        remedy: "weigh and measure the links with their screws and encoders",
        set: |reality, size| reality.parameters.parameter_spread_percent = size,
    },
];

/// How the sizes are searched for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImperfectionSettings {
    /// Length of each run (s).
    pub duration_s: f64,
    /// Runs that must all stand, with the seeds from 1.
    pub seeds: u64,
    /// Disturbances of the runs.
    pub disturbance: Disturbance,
    /// Relative precision of a size.
    pub relative: f64,
}

impl ImperfectionSettings {
    /// 4 runs of 10 s with the disturbances the rig file expects, to a tenth.
    pub fn of(rig: &Rig) -> Self {
        Self { duration_s: 10.0, seeds: 4, disturbance: Disturbance::of(rig), relative: 0.1 }
    }
}

/// How runs of one size end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Verdict {
    /// Runs that stand.
    pub stand: u64,
    /// Largest angle of any link from the vertical in any run (rad).
    pub peak_angle_rad: f64,
    /// Largest distance of the cart from its set-point in any run (m).
    pub peak_position_m: f64,
}

/// What a law stands of one imperfection alone.
#[derive(Debug, Clone, Serialize)]
pub struct Standing {
    /// Which one.
    pub imperfection: &'static Imperfection,
    /// Size from which a run falls; none: it stands the largest one tried.
    pub falls_at: Option<f64>,
    /// Size from which a link or the cart leaves the supervisor's limits, so that the motor is turned off; none: the largest
    /// one tried stays within.
    pub leaves_limits_at: Option<f64>,
    /// Largest size tried.
    pub largest_tried: f64,
    /// The poor machine's size over the first of these sizes: above 1 it is dangerous.
    pub danger: f64,
}

/// What a law stands: each imperfection alone, the most dangerous one first, and those of the rig file together.
#[derive(Debug, Clone, Serialize)]
pub struct Imperfections {
    /// The law.
    pub law: Law,
    /// Runs of each size.
    pub seeds: u64,
    /// Each alone.
    pub alone: Vec<Standing>,
    /// All of the rig file's `[reality]` together; none without.
    pub together: Option<Verdict>,
}

/// Sizes are tried from this share of a good machine's to this multiple of a poor one's.
const RANGE: [f64; 2] = [1.0 / 64.0, 64.0];

/// Searches for every imperfection alone the sizes at which `law` falls and at which it leaves the limits. `done` is called
/// after each imperfection, from any thread.
///
/// # Errors
/// [`Unverifiable`] for a model, and if a run cannot be started.
pub fn imperfections(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    settings: &ImperfectionSettings,
    done: &(dyn Fn() + Sync),
) -> Result<Imperfections, Unverifiable> {
    chain(rig, "imperfections")?;
    within("relative", settings.relative, 1e-3..=1.0, "a width from 0.001 to 1")?;
    let search = Search { rig, table, law, settings };
    let one = |imperfection: &'static Imperfection| {
        let standing = search.standing(imperfection);
        done();
        standing
    };
    let mut alone: Vec<Standing> =
        IMPERFECTIONS.par_iter().map(one).collect::<Result<_, SimulationError>>()?;
    alone.sort_by(|a, b| b.danger.total_cmp(&a.danger));
    let together =
        (rig.reality != Reality::default()).then(|| search.verdict(rig.reality.clone())).transpose()?;
    Ok(Imperfections { law, seeds: settings.seeds, alone, together })
}

struct Search<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    law: Law,
    settings: &'a ImperfectionSettings,
}

impl Search<'_> {
    fn standing(&self, imperfection: &'static Imperfection) -> Result<Standing, SimulationError> {
        let [good, poor] = imperfection.typical;
        // Masses and lengths cannot be wrong by more than nine tenths.
        let most = if imperfection.key == "parameter_spread_percent" { 80.0 } else { f64::INFINITY };
        let sizes = [RANGE[0] * good, (RANGE[1] * poor).min(most)];
        // Both searches try many of the same sizes.
        let mut known = BTreeMap::new();
        let mut at = |size: f64| -> Result<Verdict, SimulationError> {
            if let Some(verdict) = known.get(&size.to_bits()) {
                return Ok(*verdict);
            }
            let mut reality = Reality::default();
            (imperfection.set)(&mut reality, size);
            let verdict = self.verdict(reality)?;
            known.insert(size.to_bits(), verdict);
            Ok(verdict)
        };
        let falls_at = first(sizes, self.settings.relative, |size| {
            at(size).map(|verdict| verdict.stand == self.settings.seeds)
        })?;
        let leaves_limits_at = first(sizes, self.settings.relative, |size| {
            at(size).map(|verdict| self.is_within_limits(&verdict))
        })?;
        let least = falls_at.unwrap_or(sizes[1]).min(leaves_limits_at.unwrap_or(sizes[1]));
        Ok(Standing {
            imperfection,
            falls_at,
            leaves_limits_at,
            largest_tried: sizes[1],
            danger: poor / least,
        })
    }

    fn is_within_limits(&self, verdict: &Verdict) -> bool {
        let limits = &self.table.limits;
        let [low, high] = limits.rail_m.map(f64::from);
        verdict.stand == self.settings.seeds
            && verdict.peak_angle_rad <= f64::from(limits.angle_rad)
            && verdict.peak_position_m <= high.min(-low)
    }

    /// All seeds on a machine like this.
    fn verdict(&self, reality: Reality) -> Result<Verdict, SimulationError> {
        let real = Rig { reality, ..self.rig.clone() };
        let one = |seed: u64| {
            let scenario = Scenario {
                force_noise_n: self.settings.disturbance.force_n,
                torque_noise_n_m: self.settings.disturbance.torque_n_m,
                seed,
                ..scenario(&real, self.law, self.settings.duration_s)
            };
            trial(&real, self.table, &scenario, &Horizon::default())
        };
        let all: Vec<_> =
            (1..=self.settings.seeds).into_par_iter().map(one).collect::<Result<_, SimulationError>>()?;
        Ok(Verdict {
            stand: all.iter().filter(|outcome| outcome.stands()).count() as u64,
            peak_angle_rad: all.iter().map(|outcome| outcome.peak_angle_rad).fold(0.0, f64::max),
            peak_position_m: all.iter().map(|outcome| outcome.peak_error_m).fold(0.0, f64::max),
        })
    }
}

/// The first size that is not held: from the smallest by factors of 4, then by bisection of the logarithm to within
/// `relative`. None if even the largest is held.
fn first<E>(
    [smallest, largest]: [f64; 2],
    relative: f64,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<Option<f64>, E> {
    let (mut held, mut size) = (0.0, smallest);
    while holds(size)? {
        if size >= largest {
            return Ok(None);
        }
        held = size;
        size = (4.0 * size).min(largest);
    }
    let mut lost = size;
    while held > 0.0 && lost - held > relative * held {
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
        let find = |edge: f64| first::<()>([0.01, 10.0], 0.01, |size| Ok(size < edge)).unwrap();
        assert!(find(0.5).is_some_and(|found| (0.5..0.505).contains(&found)));
        assert_eq!((find(20.0), find(0.001)), (None, Some(0.01)));
    }
}
