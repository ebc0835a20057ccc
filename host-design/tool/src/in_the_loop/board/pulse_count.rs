//! The pulses that the image gives to a drive that takes them.

use upright::board::Output;
use upright::control::actuator::Drive;
use upright_board::{Pulse, Time};

/// Takes the pulses of each tick, and when it was due.
pub type PulseWatch = Box<dyn FnMut(Time, &[Pulse])>;

/// The pulses that were counted.
#[derive(Default)]
pub(super) struct PulseCount {
    /// Number of all pulses before the last tick, positive along +x.
    pub(super) before: u32,
    /// The same with those of that tick.
    given: u32,
    /// Who looks at them.
    pub(super) watch: Option<PulseWatch>,
}

impl PulseCount {
    /// The output of the drive in the tick that was due at `due`: the pulses that came while it was enabled. `is_on`
    /// is whether it still is at the end.
    pub(super) fn take(&mut self, due: Time, pulses: &[Pulse], is_on: bool) -> Output {
        let taken = pulses.iter().filter(|pulse| pulse.enabled);
        let net: i32 = taken.map(|pulse| if pulse.along { 1 } else { -1 }).sum();
        self.before = self.given;
        self.given = self.given.wrapping_add_signed(net);
        if let Some(watch) = &mut self.watch {
            watch(due, pulses);
        }
        let drive = if is_on || net != 0 { Drive::Steps(net) } else { Drive::OFF };
        Output { duty: 0.0, drive, enable: is_on }
    }
}
