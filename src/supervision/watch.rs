//! Conditions that may last a while before they are faults: counted, tick by tick.

use crate::board::Inputs;
use crate::supervision::fault::Fault;
use crate::table::limits::Limits;

/// So many overruns in a row are a fault.
const OVERRUNS: u32 = 3;

/// For how many ticks in a row each condition has held.
#[derive(Debug, Clone, Copy, Default)]
pub struct Watch {
    supply: u32,
    overruns: u32,
    saturated: u32,
    silent: u32,
}

impl Watch {
    /// Balancing begins: nothing counts from before.
    pub fn start(&mut self) {
        *self = Self::default();
    }

    /// Looks at the inputs of a tick while balancing.
    #[inline]
    pub fn inputs<const NY: usize>(&mut self, limits: &Limits<NY>, inputs: &Inputs<NY>) -> Option<Fault> {
        let contacts = &inputs.contacts;
        count(&mut self.overruns, contacts.overrun);
        count(&mut self.supply, inputs.supply_v < limits.supply_min_v);
        if contacts.limit_low || contacts.limit_high {
            Some(Fault::LimitSwitch)
        } else if !inputs.supply_v.is_finite() {
            Some(Fault::NotFinite)
        } else if self.supply > limits.supply_ticks {
            Some(Fault::Supply)
        } else if self.overruns >= OVERRUNS {
            Some(Fault::Overrun)
        } else {
            None
        }
    }

    /// Looks at the force of a tick: whether the law asked for more than there is.
    #[inline]
    pub fn force<const NY: usize>(&mut self, limits: &Limits<NY>, limited: bool) -> Option<Fault> {
        count(&mut self.saturated, limited);
        (self.saturated > limits.saturated_ticks).then_some(Fault::Saturated)
    }

    /// Ends a tick: whether a command has come, and whether the host commands the set-point.
    #[inline]
    pub fn link<const NY: usize>(
        &mut self,
        limits: &Limits<NY>,
        heard: bool,
        commanded: bool,
    ) -> Option<Fault> {
        count(&mut self.silent, !heard);
        (commanded && self.silent >= limits.link_ticks).then_some(Fault::LinkLost)
    }
}

fn count(ticks: &mut u32, holds: bool) {
    *ticks = if holds { ticks.saturating_add(1) } else { 0 };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Contacts;

    const LIMITS: Limits<1> =
        Limits { supply_min_v: 9.0, supply_ticks: 4, saturated_ticks: 5, link_ticks: 6, ..Limits::none() };
    const GOOD: Inputs<1> = Inputs {
        counts: [0],
        supply_v: 12.0,
        contacts: Contacts {
            limit_low: false,
            limit_high: false,
            emergency_stop: false,
            driver_fault: false,
            overrun: false,
            clock_fault: false,
        },
    };

    /// The tick in which it becomes a fault.
    fn tick_of(inputs: Inputs<1>) -> Option<(usize, Fault)> {
        let mut watch = Watch::default();
        (1..100).find_map(|tick| watch.inputs(&LIMITS, &inputs).map(|fault| (tick, fault)))
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
    }

    #[test]
    fn what_is_interrupted_starts_anew() {
        let mut watch = Watch::default();
        for tick in 0..100 {
            let mut inputs = GOOD;
            inputs.contacts.overrun = tick % 3 != 0;
            inputs.supply_v = if tick % 5 == 0 { 12.0 } else { 5.0 };
            assert_eq!(watch.inputs(&LIMITS, &inputs), None);
            assert_eq!(watch.force(&LIMITS, tick % 6 != 0), None);
            assert_eq!(watch.link(&LIMITS, tick % 6 == 0, true), None);
        }
    }

    #[test]
    fn saturation_and_silence_have_their_times() {
        let mut watch = Watch::default();
        let first = |found: &mut dyn FnMut() -> Option<Fault>| {
            (1..100).find_map(|tick| found().map(|fault| (tick, fault)))
        };
        assert_eq!(first(&mut || watch.force(&LIMITS, true)), Some((6, Fault::Saturated)));
        assert_eq!(first(&mut || watch.link(&LIMITS, false, true)), Some((6, Fault::LinkLost)));
        let mut watch = Watch::default();
        assert_eq!(first(&mut || watch.link(&LIMITS, false, false)), None);
    }
}
