//! `[verify]`: what `upright verify` requires of the loop.

use serde::Serialize;

/// Thresholds of the trust report. They change no gain, so they are not part of the rig's hash.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Requirements {
    /// The gain of the loop may grow by at least this factor.
    pub gain_margin: f64,
    /// Least phase margin (°).
    pub phase_margin_deg: f64,
    /// Least further delay that the loop survives (ticks).
    pub delay_margin_ticks: f64,
    /// Largest peak of the sensitivity.
    pub peak_sensitivity: f64,
    /// Least tilt of any single link from which the loop recovers (rad).
    pub tilt_rad: f64,
    /// Spread of the plant's parameters in the Monte Carlo runs (± %).
    pub spread_percent: f64,
    /// Spread of the masses for which every corner has to stand (± %).
    pub corner_percent: f64,
    /// Least share of Monte Carlo runs that stand, as the lower end of its confidence interval (%).
    pub success_percent: f64,
    /// The encoders may be coarser by at least this factor.
    pub encoder_factor: f64,
    /// Disturbing force, drawn anew each tick, in every simulated run (N rms); none: what `[kalman]` expects. The two
    /// differ when the observer's noise is raised on purpose, to make it robust.
    pub force_rms_n: Option<f64>,
    /// Disturbing torque at each joint likewise (N·m rms).
    pub torque_rms_n_m: Option<f64>,
}

impl Default for Requirements {
    /// Sane values for a rig on a bench: margins below these make a loop that a hand on the table can topple.
    fn default() -> Self {
        Self {
            gain_margin: 1.2,
            phase_margin_deg: 8.0,
            delay_margin_ticks: 0.5,
            peak_sensitivity: 8.0,
            tilt_rad: 0.005,
            spread_percent: 2.0,
            corner_percent: 2.0,
            success_percent: 95.0,
            encoder_factor: 1.5,
            force_rms_n: None,
            torque_rms_n_m: None,
        }
    }
}
