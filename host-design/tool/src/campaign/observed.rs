//! What is observed in a trial.

use upright::board::Output;
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;

/// What was observed in a trial. Ticks count from the release of the rig.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Observed {
    /// Outputs from the release on.
    pub(super) outputs: Vec<Output>,
    /// First tick in which the motor was off.
    pub(super) off: Option<usize>,
    /// Whether it came on again afterwards …
    pub(super) on_again: bool,
    /// … to still the links after a fall, as the table allows.
    pub(super) stills: bool,
    /// Whether the cart left its rail meanwhile, the motor added energy, or it stilled the links for too long.
    pub(super) astray: bool,
    /// First tick in which the defect was visible: the rig differed from a healthy one by more than a threshold.
    pub(super) visible: Option<usize>,
    /// Whether a link or the cart was far beyond its limit while the motor was on.
    pub(super) outside: bool,
    /// The latched fault.
    pub(super) fault: Option<Fault>,
    /// Number of measurements that were rejected.
    pub(super) rejected: u32,
    /// What the jog has found out about the motor.
    pub(super) motor: Option<MotorSign>,
    /// Reasons for which arming was refused.
    pub(super) refused: Option<Inhibits>,
    /// Whether the firmware has stopped running.
    pub(super) dead: bool,
    /// Time from the edge of the emergency stop to an output that is off (µs).
    pub(super) stop_to_off_us: Option<f64>,
}

impl Observed {
    /// Records the firmware's output in `tick`, and whether the motor is on; if it is not, it went off `before` ticks
    /// before, as telemetry says.
    pub(super) fn output(&mut self, tick: usize, output: Output, is_on: bool, before: usize) {
        self.outputs.push(output);
        self.on_again |= is_on && self.off.is_some();
        if !is_on {
            let since = tick.saturating_sub(before);
            self.off = Some(self.off.map_or(since, |off| off.min(since)));
        }
    }

    /// Whether the defect is visible, but the motor is not yet off and no link too far: a slow rig takes time to fall.
    pub(super) fn is_undecided(&self) -> bool {
        self.visible.is_some() && self.off.is_none() && !self.outside
    }
}
