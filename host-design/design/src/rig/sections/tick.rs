//! `[tick]`: control period and delay.

use super::super::key::{Absent, Section};
use super::super::rule::Rule;
use super::super::value::{Keys, keys};

/// `[tick]`
pub(crate) static TICK: Section = Section {
    name: "tick",
    title: "[tick]",
    meaning: "the control tick",
    absent: Absent::Follows("as below"),
    keys: &[Tick::KEYS],
};

keys! {
    /// The control tick, `[tick]`.
    pub struct Tick {
        period_s: f64, "s", Rule::PERIOD, "control period", Absent::Numbers(&[0.001]);
        delay_ticks: u8, "ticks", Rule::ZERO_OR_ONE,
            "delay from a measurement to the force computed from it", Absent::Numbers(&[0.0]);
    }
}

impl Default for Tick {
    fn default() -> Self {
        Tick::when_absent().expect("no key of [tick] is required")
    }
}
