//! Conditions that become a fault only after they have held for a number of ticks in a row.
//!
//! A new fault with a time limit gets a counter here; its time belongs to [`Limits`].

use crate::board::{Contacts, Inputs};
use crate::supervision::fault::Fault;
use crate::table::Limits;

/// This many overruns in a row are a fault, and the watchdog is no longer fed.
pub(crate) const OVERRUNS: u32 = 3;
/// This many measurements of too high a supply in a row are a fault: one may be a spike beside a switching bridge.
const OVER_VOLTAGES: u32 = 3;

/// Number of ticks in a row for which each condition has held.
#[derive(Debug, Clone, Copy, Default)]
pub struct Debounce {
    supply: u32,
    over_voltages: u32,
    overruns: u32,
    saturated: u32,
    link_silent: u32,
}

impl Debounce {
    /// Clears all counters, at the start of each state with the motor on.
    pub fn start(&mut self) {
        *self = Self::default();
    }

    /// Checks the inputs of a tick with the motor on: limit switches, then the supply, then overruns. `supply_max_v`
    /// is the highest supply voltage (V), see [`DriveMap::supply_max_v`](crate::table::DriveMap::supply_max_v).
    #[inline]
    pub fn check_inputs<const NY: usize>(
        &mut self,
        limits: &Limits,
        supply_max_v: f32,
        inputs: &Inputs<NY>,
    ) -> Option<Fault> {
        let Contacts { limit_low, limit_high, overrun, .. } = inputs.contacts;
        let supply_is_good = inputs.supply_v >= limits.supply_min_v
            && inputs.supply_v <= supply_max_v
            && inputs.supply_v.is_finite();
        if supply_is_good && !(limit_low | limit_high | overrun) {
            (self.supply, self.over_voltages, self.overruns) = (0, 0, 0);
            return None;
        }
        self.check_bad_inputs(limits, supply_max_v, inputs)
    }

    /// [`check_inputs`](Self::check_inputs), if anything is wrong.
    #[cold]
    fn check_bad_inputs<const NY: usize>(
        &mut self,
        limits: &Limits,
        supply_max_v: f32,
        inputs: &Inputs<NY>,
    ) -> Option<Fault> {
        let contacts = &inputs.contacts;
        count(&mut self.overruns, contacts.overrun);
        count(&mut self.supply, inputs.supply_v < limits.supply_min_v);
        count(&mut self.over_voltages, inputs.supply_v > supply_max_v);
        if contacts.limit_low || contacts.limit_high {
            Some(Fault::LimitSwitch)
        } else if !inputs.supply_v.is_finite() {
            Some(Fault::NotFinite)
        } else if self.supply > limits.supply_ticks || self.over_voltages >= OVER_VOLTAGES {
            Some(Fault::Supply)
        } else if self.overruns >= OVERRUNS {
            Some(Fault::Overrun)
        } else {
            None
        }
    }

    /// Checks the force of a tick; `limited` says that the force applied is not the one requested.
    #[inline]
    pub fn check_force(&mut self, limits: &Limits, limited: bool) -> Option<Fault> {
        count(&mut self.saturated, limited);
        (self.saturated > limits.saturated_ticks).then_some(Fault::Saturated)
    }

    /// Checks the link at the end of a tick: whether a command was received, and whether the host commands the
    /// set-point.
    #[inline]
    pub fn check_link(&mut self, limits: &Limits, received: bool, setpoint_commanded: bool) -> Option<Fault> {
        count(&mut self.link_silent, !received);
        (setpoint_commanded && self.link_silent >= limits.link_ticks).then_some(Fault::LinkLost)
    }
}

fn count(ticks: &mut u32, holds: bool) {
    *ticks = if holds { ticks.saturating_add(1) } else { 0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits =
        Limits { supply_min_v: 9.0, supply_ticks: 4, saturated_ticks: 5, link_ticks: 6, ..Limits::none() };
    const GOOD: Inputs<1> = Inputs {
        raw_counts: [0],
        supply_v: 12.0,
        contacts: Contacts {
            limit_low: false,
            limit_high: false,
            emergency_stop: false,
            driver_fault: false,
            overrun: false,
            clock_fault: false,
            board_fault: false,
        },
    };

    /// The tick in which these inputs, if they persist, become a fault, and the fault.
    fn tick_of(inputs: Inputs<1>) -> Option<(usize, Fault)> {
        let mut debounce = Debounce::default();
        (1..100).find_map(|tick| debounce.check_inputs(&LIMITS, 15.0, &inputs).map(|fault| (tick, fault)))
    }

    #[test]
    fn each_input_is_a_fault_in_its_tick() {
        let contacts = |change: &dyn Fn(&mut Contacts)| {
            let mut inputs = GOOD;
            change(&mut inputs.contacts);
            tick_of(inputs)
        };
        assert_eq!(tick_of(GOOD), None);
        assert_eq!(contacts(&|c| c.limit_low = true), Some((1, Fault::LimitSwitch)));
        assert_eq!(contacts(&|c| c.limit_high = true), Some((1, Fault::LimitSwitch)));
        assert_eq!(contacts(&|c| c.overrun = true), Some((3, Fault::Overrun)));
        assert_eq!(tick_of(Inputs { supply_v: f32::NAN, ..GOOD }), Some((1, Fault::NotFinite)));
        assert_eq!(tick_of(Inputs { supply_v: 8.9, ..GOOD }), Some((5, Fault::Supply)));
        assert_eq!(tick_of(Inputs { supply_v: 15.1, ..GOOD }), Some((3, Fault::Supply)));
        assert_eq!(tick_of(Inputs { supply_v: 15.0, ..GOOD }), None);
    }

    #[test]
    fn an_interrupted_condition_counts_from_0_again() {
        let mut debounce = Debounce::default();
        for tick in 0..100 {
            let mut inputs = GOOD;
            inputs.contacts.overrun = tick % 3 != 0;
            // Four ticks too low, or two too high.
            inputs.supply_v = [12.0, 5.0, 5.0, 5.0, 5.0, 12.0, 20.0, 20.0][tick % 8];
            assert_eq!(debounce.check_inputs(&LIMITS, 15.0, &inputs), None);
            assert_eq!(debounce.check_force(&LIMITS, tick % 6 != 0), None);
            assert_eq!(debounce.check_link(&LIMITS, tick % 6 == 0, true), None);
        }
    }

    #[test]
    fn saturation_and_silence_have_their_times() {
        let mut debounce = Debounce::default();
        let first = |found: &mut dyn FnMut() -> Option<Fault>| {
            (1..100).find_map(|tick| found().map(|fault| (tick, fault)))
        };
        assert_eq!(first(&mut || debounce.check_force(&LIMITS, true)), Some((6, Fault::Saturated)));
        assert_eq!(first(&mut || debounce.check_link(&LIMITS, false, true)), Some((6, Fault::LinkLost)));
        let mut debounce = Debounce::default();
        assert_eq!(first(&mut || debounce.check_link(&LIMITS, false, false)), None);
    }
}
