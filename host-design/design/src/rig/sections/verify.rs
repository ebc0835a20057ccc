//! `[verify]`: what `upright verify` requires of the loop.

use super::super::key::{Absent, Keys, Section, keys};
use super::super::rule::Rule;

/// `[verify]`
pub(in crate::rig) static VERIFY: Section = Section {
    name: "verify",
    title: "[verify]",
    meaning: "what `upright verify` requires of each law; changes no gain",
    absent: Absent::Follows("as below"),
    keys: &[Requirements::KEYS],
};

keys! {
    /// Thresholds of the trust report. They change no gain, so they are not part of the rig's hash.
    ///
    /// The disturbances of the simulated runs and the noise that `[kalman]` expects differ when the observer's noise
    /// is raised on purpose, to make it robust.
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
            "error (±) of the masses for which every combination has to stand", Absent::Numbers(&[2.0]);
        success_percent: f64, "%", Rule::PERCENT,
            "least share of random plants that stand, as the lower end of its 95 % interval",
            Absent::Numbers(&[95.0]);
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

impl Default for Requirements {
    /// Values for a rig on a bench: a hand on the table topples a loop with smaller margins.
    fn default() -> Self {
        Requirements::when_absent().expect("no key of [verify] is required")
    }
}
