//! The simulated rig with the firmware on its wires, from power-up to the tick in which the hand lets go.

use upright::board::Output;
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::error::HarnessError;
use super::held_rig::HeldRig;
use super::operator::{Operator, OperatorTick, RETRY_S};
use super::session::Session;
use super::target::{Pins, Target, healthy};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Scenario};
use upright_design::table::TableValues;

/// Longest time from power-up to balancing (s).
const LONGEST_WAIT_S: f64 = 60.0;

/// Firmware, simulated rig, and the hand that raises it.
pub struct Harness<'t> {
    /// The conversation with the firmware.
    pub session: Session<'t>,
    /// The simulated rig.
    pub bench: Bench,
    operator: Operator,
    /// The firmware's output in the last tick.
    output: Output,
    counters: Vec<u32>,
    supply_v: f32,
    period_s: f64,
    /// The last tick in which the next goal was requested.
    asked: Option<usize>,
    begun: Vec<usize>,
    /// Puts the rig back after it has been lowered.
    held: HeldRig,
    is_held: bool,
}

/// Time before the links are raised again at which a hand takes hold of the rig (s): enough to come from either end of
/// the rail.
const PUT_BACK_S: f64 = 5.0;

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
        let operator = Operator::new(rig, scenario)?;
        let mut bench = Bench::new(rig, scenario)?;
        bench.hold(operator.held());
        let mut harness = Self {
            session: Session::new(target),
            bench,
            operator,
            output: Output::OFF,
            counters: vec![0; table.sensors()],
            supply_v: table.drive.supply_v().unwrap_or_default(),
            period_s: rig.tick.period_s,
            asked: None,
            begun: Vec::new(),
            held: HeldRig::hanging(rig),
            is_held: false,
        };
        let hanging = harness.inputs();
        harness.session.check_info(table.into(), &hanging)?;
        harness.session.ask(Request::Select(scenario.law), &hanging)?;
        let every = harness.session.pace().telemetry_ticks;
        harness.session.ask(Request::Telemetry(every), &hanging)?;
        Ok(harness)
    }

    /// The input pins of a healthy board in the present state of the rig.
    pub fn inputs(&mut self) -> Pins {
        self.bench.read_counters(&mut self.counters);
        healthy(&self.counters, self.supply_v * self.bench.supply_share() as f32)
    }

    /// Runs one tick in which the hand does what comes next; returns the firmware's output.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer.
    pub fn by_hand(&mut self, tick: u32) -> Result<Output, HarnessError> {
        if let Some(OperatorTick { held, request }) =
            self.operator.act(tick, &self.session.status(), &self.output)
        {
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
    /// the swing-up. Ends with the first tick in which the controller commands the motor, and returns that tick's
    /// output.
    ///
    /// `setpoint_m` is commanded as soon as the firmware is armed; from then on it needs a command every
    /// [`KEEP_ALIVE`](upright::protocol::KEEP_ALIVE). Without a set-point it holds the position in which it begins.
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
            if self.operator.has_let_go(&self.session.status(), &output) {
                return Ok(output);
            }
        }
        Err(HarnessError::NotBalancing(self.session.status().state))
    }

    /// Requests each of `goals` in turn, from its tick on, and again until its motion begins, as a person does: the
    /// firmware refuses it while a link leans or the cart moves. Before a lowered rig is raised again, a hand stills
    /// its links and pushes the cart to 0. To be called in every tick; returns whether it has sent a request in this
    /// one.
    pub fn ask_for(&mut self, tick: usize, goals: &[(usize, Equilibrium)]) -> bool {
        let state = self.session.status().state;
        if matches!(state, State::Raising | State::Lowering)
            && let Some(asked) = self.asked.take()
        {
            self.begun.push(asked + self.session.pace().command_ticks);
        }
        let Some(&(at, to)) = goals.get(self.begun.len()) else { return false };
        let ahead = at.saturating_sub(tick) as f64 * self.period_s;
        if state == State::Calibrated && to != Equilibrium::HANGING && ahead > 0.0 && ahead <= PUT_BACK_S {
            self.put_back();
        } else {
            self.is_held = false;
        }
        let rests = match state {
            State::Balancing | State::Holding => true,
            State::Calibrated => to != Equilibrium::HANGING,
            _ => false,
        };
        let retry_ticks = (RETRY_S / self.period_s).max(1.0) as usize;
        let asks = rests && tick.checked_sub(at).is_some_and(|since| since.is_multiple_of(retry_ticks));
        if asks {
            self.asked = Some(tick);
            self.session.send(Request::Goto(to));
        }
        asks
    }

    /// The hand moves the hanging rig by one tick's step towards rest with the cart at 0, and lets go of it there.
    fn put_back(&mut self) {
        if !self.is_held {
            self.held.take(self.bench.state());
            self.held.stop();
            self.is_held = true;
        }
        if !self.held.push_to(0.0) {
            self.bench.hold(self.held.held());
        }
    }

    /// The tick in which the motion to each goal began, for the goals whose motion has begun.
    pub fn begun(&self) -> &[usize] {
        &self.begun
    }
}
