//! `[verify]`: what `upright verify` requires of the loop.

use super::super::error::RigError;
use super::super::key::{Absent, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::chain::CartInput;
use super::reality::{Reality, of_force};

/// `[verify]`
pub(crate) static VERIFY: Section = Section {
    name: "verify",
    title: "[verify]",
    meaning: "what `upright verify` requires of each law; changes no gain",
    absent: Absent::Follows("as below"),
    keys: &[Requirements::KEYS],
};

const NOT_REQUIRED: Absent = Absent::Follows("not required");

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
        joint_friction_n_m: Option<f64>, "N·m", Rule::POSITIVE,
            "Coulomb friction in each joint that the loop has to survive as the only imperfection", NOT_REQUIRED;
        cart_friction_n: Option<f64>, "N", Rule::POSITIVE,
            "Coulomb friction of the cart that the loop has to survive as the only imperfection", NOT_REQUIRED;
        homing_error_rad: Option<f64>, "rad", Rule::ANGLE,
            "error of each joint's zero that the loop has to survive as the only imperfection", NOT_REQUIRED;
        eccentricity_rad: Option<f64>, "rad", Rule::ANGLE,
            "amplitude of each joint encoder's once-per-turn error that the loop has to survive as the only \
             imperfection",
            NOT_REQUIRED;
        twice_per_turn_rad: Option<f64>, "rad", Rule::ANGLE,
            "amplitude of each joint sensor's twice-per-turn error that the loop has to survive as the only \
             imperfection",
            NOT_REQUIRED;
        sensor_delay_s: Option<f64>, "s", Rule::POSITIVE,
            "age of the joints' readings that the loop has to survive as the only imperfection", NOT_REQUIRED;
        rail_tilt_rad: Option<f64>, "rad", Rule::ANGLE,
            "slope of the rail that the loop has to survive as the only imperfection", NOT_REQUIRED;
        backlash_m: Option<f64>, "m", Rule::POSITIVE,
            "play between motor and cart that the loop has to survive as the only imperfection", NOT_REQUIRED;
        belt_compliance_m_per_n: Option<f64>, "m/N", Rule::POSITIVE,
            "stretch of belt or gear per force that the loop has to survive as the only imperfection", NOT_REQUIRED;
        driver_lag_s: Option<f64>, "s", Rule::POSITIVE,
            "time constant of the motor driver, beyond the stated one, that the loop has to survive as the only \
             imperfection",
            NOT_REQUIRED;
        latency_s: Option<f64>, "s", Rule::POSITIVE.worded("a number > 0 and < period_s"),
            "additional delay of the force that the loop has to survive as the only imperfection", NOT_REQUIRED;
        force_percent: Option<f64>, "%", Rule::POSITIVE,
            "excess of the real force that the loop has to survive as the only imperfection", NOT_REQUIRED;
        parameter_spread_percent: Option<f64>, "%", Rule::SPREAD,
            "spread (±) of all masses, lengths and inertias that the loop has to survive as the only imperfection",
            NOT_REQUIRED;
    }
}

/// Reads `[verify]`; imperfections that are not simulated with a drive with pulses cannot be required.
pub(crate) fn verify(node: &Node<'_>, input: CartInput, reality: &Reality) -> Result<Requirements, RigError> {
    let table = node.table(&VERIFY)?;
    if input == CartInput::Acceleration {
        table.refuse_for_acceleration(&of_force())?;
        if reality.step_motor.holding_force_n.is_none() {
            table.refuse_for_acceleration(&["cart_friction_n"])?;
        }
    }
    Requirements::read(&table)
}

impl Default for Requirements {
    /// Values for a rig on a bench: a hand on the table makes a loop with smaller margins fall.
    fn default() -> Self {
        Requirements::when_absent().expect("no key of [verify] is required")
    }
}
