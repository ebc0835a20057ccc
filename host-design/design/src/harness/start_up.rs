//! The simulated rig with the firmware on its wires, from power-up to the tick in which the hand lets go.

use upright::board::Output;
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;

use super::error::HarnessError;
use super::hand::{Hand, HandTick, RETRY_S};
use super::session::Session;
use super::target::{Pins, Target, healthy};
use crate::rig::Rig;
use crate::simulate::{Bench, Scenario};
use crate::table::TableValues;

/// Longest time from power-up to balancing (s).
const LONGEST_WAIT_S: f64 = 60.0;

/// Firmware, simulated rig, and the hand that raises it.
pub struct Harness<'t> {
    /// The conversation with the firmware.
    pub session: Session<'t>,
    /// The rig.
    pub bench: Bench,
    hand: Hand,
    /// The firmware's output in the last tick.
    output: Output,
    counters: Vec<u32>,
    supply_v: f32,
    period_s: f64,
    /// The last tick in which lowering was asked for.
    asked_to_lower: Option<usize>,
    lowered_from: Option<usize>,
}

impl<'t> Harness<'t> {
    /// The rig hanging at rest, held by hand, and `target`, which has just started and has the table `table`. It is
    /// told to use the law of `scenario` and to send telemetry as often as its serial line allows.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware is for another rig, or refuses the law.
    pub fn new(
        rig: &Rig,
        table: &TableValues,
        scenario: &Scenario,
        target: &'t mut dyn Target,
    ) -> Result<Self, HarnessError> {
        let hand = Hand::new(rig, scenario)?;
        let mut bench = Bench::new(rig, scenario)?;
        bench.hold(hand.held());
        let mut harness = Self {
            session: Session::new(target),
            bench,
            hand,
            output: Output::OFF,
            counters: vec![0; table.sensors()],
            supply_v: table.motor.map_or(0.0, |motor| motor.supply_v),
            period_s: rig.tick.period_s,
            asked_to_lower: None,
            lowered_from: None,
        };
        let hanging = harness.inputs();
        harness.session.check_info(table.rig_hash, &hanging)?;
        harness.session.ask(Request::Select(scenario.law), &hanging)?;
        let every = harness.session.pace().telemetry_ticks;
        harness.session.ask(Request::Telemetry(every), &hanging)?;
        Ok(harness)
    }

    /// What a healthy board reads now.
    pub fn inputs(&mut self) -> Pins {
        self.bench.read_counters(&mut self.counters);
        healthy(&self.counters, self.supply_v * self.bench.supply_share() as f32)
    }

    /// One tick in which the hand does what comes next; gives the firmware's output.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer.
    pub fn by_hand(&mut self, tick: u32) -> Result<Output, HarnessError> {
        if let Some(HandTick { held, request }) = self.hand.act(tick, &self.session.status(), &self.output) {
            self.bench.hold(&held);
            if let Some(request) = request {
                self.session.send(request);
            }
        }
        let inputs = self.inputs();
        self.output = self.session.tick(&inputs)?;
        Ok(self.output)
    }

    /// Homes, checks the signs, has the motor push the cart, raises the links and arms, or lets them hang and starts
    /// the swing-up. Ends with the first tick in which the controller commands the motor, and gives that tick's output.
    ///
    /// `setpoint_m` is commanded as soon as the firmware is armed; from then on it needs a command every
    /// [`HEARTBEAT_S`](super::HEARTBEAT_S). Without a set-point it holds the position in which it begins.
    ///
    /// # Errors
    /// [`HarnessError::NotBalancing`] if that takes longer than a minute.
    pub fn raise(&mut self, setpoint_m: Option<f32>) -> Result<Output, HarnessError> {
        let mut setpoint_m = setpoint_m;
        for tick in 0..=(LONGEST_WAIT_S / self.period_s) as u32 {
            if self.session.status().state == State::Armed
                && let Some(position_m) = setpoint_m.take()
            {
                self.session.send(Request::Setpoint(position_m));
            }
            let output = self.by_hand(tick)?;
            if output.enable && !self.hand.lets_the_motor_push() {
                return Ok(output);
            }
        }
        Err(HarnessError::NotBalancing(self.session.status().state))
    }

    /// Asks for lowering in tick `at`, and again as long as the rig balances, as a person does: it is refused while a
    /// link leans. To be called in every tick; gives whether it has asked in this one.
    pub fn ask_to_lower(&mut self, tick: usize, at: Option<usize>) -> bool {
        let state = self.session.status().state;
        if state == State::Lowering && self.lowered_from.is_none() {
            self.lowered_from = self.asked_to_lower.map(|asked| asked + self.session.pace().command_ticks);
        }
        let retry_ticks = (RETRY_S / self.period_s).max(1.0) as usize;
        let since = at.and_then(|at| tick.checked_sub(at));
        let asks = state == State::Balancing && since.is_some_and(|since| since.is_multiple_of(retry_ticks));
        if asks {
            self.asked_to_lower = Some(tick);
            self.session.send(Request::Down);
        }
        asks
    }

    /// The tick from which on the rig is lowered.
    pub fn lowered_from(&self) -> Option<usize> {
        self.lowered_from
    }
}
