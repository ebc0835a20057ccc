//! What the simulated host sends while the firmware balances.

use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::Request;

use super::world::{Participant, World};
use upright_design::simulate::Scenario;

/// A host that commands the set-point of a scenario and, while it stands still, says that it is still there.
pub struct Host<'a> {
    scenario: &'a Scenario,
    period_s: f64,
    /// Ticks from a command to the tick that uses it.
    command_ticks: usize,
    keep_alive_ticks: usize,
    commanded_m: f64,
}

impl<'a> Host<'a> {
    /// A host of a firmware that was armed with the scenario's first set-point.
    pub fn new(scenario: &'a Scenario, period_s: f64, command_ticks: usize) -> Self {
        let keep_alive_ticks = (KEEP_ALIVE.as_secs_f64() / period_s).max(1.0) as usize;
        Self { scenario, period_s, command_ticks, keep_alive_ticks, commanded_m: scenario.target_m(0.0) }
    }
}

impl Participant for Host<'_> {
    fn say(&mut self, world: &World<'_>) -> Option<Request> {
        let tick = world.ticks();
        let ahead_m = self.scenario.target_m((tick + self.command_ticks) as f64 * self.period_s);
        if ahead_m != self.commanded_m {
            self.commanded_m = ahead_m;
            return Some(Request::Setpoint(ahead_m as f32));
        }
        tick.is_multiple_of(self.keep_alive_ticks).then_some(Request::KeepAlive)
    }
}
