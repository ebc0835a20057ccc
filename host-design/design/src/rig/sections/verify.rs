//! `[verify]`: what `upright verify` requires of the loop.

use super::super::error::RigError;
use super::super::key::{Absent, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::actuator::Actuator;
use super::imperfections::{IMPERFECTIONS, Imperfection, REQUIRED_SIZES};
use super::reality::Reality;

/// `[verify]`
pub(crate) static VERIFY: Section = Section {
    name: "verify",
    title: "[verify]",
    meaning: "what `upright verify` requires of each law; changes no gain",
    absent: Absent::Follows("as below"),
    keys: &[Requirements::KEYS, REQUIRED_SIZES],
};

keys! {
    /// Thresholds of the trust report. They change no gain, so they are not part of the rig's hash.
    ///
    /// The disturbances of the simulated runs can be set separately from the noise of `[kalman]`, because the
    /// observer's noise may have been raised deliberately to make it robust.
    pub struct Requirements {
        gain_margin: f64, "", Rule::POSITIVE,
            "least factor by which the loop's gain may be too large, and too small", Absent::Numbers(&[1.2]);
        phase_margin_deg: f64, "°", Rule::NOT_NEGATIVE, "least phase margin", Absent::Numbers(&[8.0]);
        delay_margin_ticks: f64, "ticks", Rule::NOT_NEGATIVE,
            "least additional delay that the loop survives", Absent::Numbers(&[0.5]);
        peak_sensitivity: f64, "", Rule::POSITIVE, "largest peak of the sensitivity", Absent::Numbers(&[8.0]);
        tilt_rad: f64, "rad", Rule::ANGLE,
            "least tilt of any single link from which the loop recovers", Absent::Numbers(&[0.005]);
        spread_percent: f64, "%", Rule::PERCENT,
            "spread (±) of masses, lengths and inertias of the random plants", Absent::Numbers(&[2.0]);
        corner_percent: f64, "%", Rule::PERCENT,
            "error (±) of the masses; the loop has to balance in every combination of errors",
            Absent::Numbers(&[2.0]);
        success_percent: f64, "%", Rule::PERCENT,
            "least share of random plants that survive, as the lower end of its 95 % interval",
            Absent::Numbers(&[95.0]);
        limit_percent: f64, "%", Rule::PERCENT,
            "largest share of the rail, the angle limit and the speed limit that the loop uses at rest",
            Absent::Numbers(&[40.0]);
        encoder_factor: f64, "", Rule::POSITIVE,
            "least factor by which all encoders may be coarser", Absent::Numbers(&[1.5]);
        force_rms_n: Option<f64>, "N", Rule::NOT_NEGATIVE,
            "rms of the disturbing force in the runs, drawn again each tick",
            Absent::Follows("what [kalman] expects");
        torque_rms_n_m: Option<f64>, "N·m", Rule::NOT_NEGATIVE,
            "rms of the disturbing torque at each joint in the runs, drawn again each tick",
            Absent::Follows("what [kalman] expects");
    }
}

/// A size of an imperfection that the loop has to survive.
pub type RequiredSize = (&'static Imperfection, f64);

/// Reads `[verify]`: the thresholds, and the sizes of imperfections. What is not simulated with this drive cannot be
/// required.
pub(crate) fn verify(
    node: &Node<'_>,
    actuator: &Actuator,
    reality: &Reality,
) -> Result<(Requirements, Vec<RequiredSize>), RigError> {
    let table = node.table(&VERIFY)?;
    let requirements = Requirements::read(&table)?;
    let mut sizes = Vec::new();
    for imperfection in IMPERFECTIONS {
        if imperfection.not_with(actuator, reality).is_some() {
            table.refuse_for_acceleration(&[imperfection.key])?;
        }
        sizes.extend(table.value::<Option<f64>>(imperfection.key)?.map(|size| (imperfection, size)));
    }
    Ok((requirements, sizes))
}

impl Default for Requirements {
    /// Values for a rig on a bench: a hand on the table makes a loop with smaller margins fall.
    fn default() -> Self {
        Requirements::when_absent().expect("no key of [verify] is required")
    }
}
