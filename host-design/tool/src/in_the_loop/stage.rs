//! The simulated rig with the firmware at its wires, from power-up to the tick in which the hand lets go.

use upright::board::{Contacts, Inputs, Output};
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;

use super::run::RunError;
use super::session::{Session, SessionError};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Hand, Scenario};
use upright_design::table::TableValues;

/// Longest time from power-up to balancing (s).
const LONGEST_WAIT_S: f64 = 60.0;

/// Bench and firmware.
pub struct Stage<'a, const NX: usize, const NY: usize> {
    /// The conversation with the firmware.
    pub session: Session<'a, NX, NY>,
    /// The rig.
    pub bench: Bench,
    hand: Hand,
    supply_v: f32,
    period_s: f64,
}

impl<'a, const NX: usize, const NY: usize> Stage<'a, NX, NY> {
    /// The rig hanging at rest, held, and a firmware that has just started and uses the law of `scenario`; it tells every
    /// tick.
    ///
    /// # Errors
    /// [`RunError`] if the firmware is for another rig, or does not follow.
    pub fn new(
        rig: &Rig,
        table: &TableValues,
        scenario: &Scenario,
        session: Session<'a, NX, NY>,
    ) -> Result<Self, RunError> {
        let hand = Hand::new(rig, &scenario.start);
        let mut bench = Bench::new(rig, scenario)?;
        bench.hold(hand.held());
        let supply_v = table.motor.map_or(0.0, |motor| motor.supply_v);
        let mut stage = Self { session, bench, hand, supply_v, period_s: rig.tick.period_s };
        let hanging = stage.inputs();
        stage.session.meet(table.rig_hash, &hanging)?;
        stage.session.ask(Request::Select(scenario.law), &hanging)?;
        stage.session.ask(Request::Telemetry(1), &hanging)?;
        Ok(stage)
    }

    /// What a healthy board reads now.
    pub fn inputs(&self) -> Inputs<NY> {
        Inputs { raw_counts: self.bench.counters(), supply_v: self.supply_v, contacts: Contacts::default() }
    }

    /// One tick in which the hand does what comes next; the output of the firmware.
    ///
    /// # Errors
    /// [`RunError`] if the firmware does not answer.
    pub fn by_hand(&mut self, tick: u32) -> Result<Output, RunError> {
        if let Some(act) = self.hand.act(tick, &self.session.seen()) {
            self.bench.hold(&act.held);
            if let Some(request) = act.request {
                self.session.send(request);
            }
        }
        Ok(self.session.tick(&self.inputs())?)
    }

    /// Homes, checks the signs, raises the links and arms; ends with the first tick in which the motor is on, and gives
    /// its output. The set-point (m) is commanded as soon as the firmware is armed.
    ///
    /// # Errors
    /// [`RunError`] if it never comes to that.
    pub fn raise(&mut self, setpoint: f32) -> Result<Output, RunError> {
        let mut commanded = false;
        for tick in 0.. {
            if self.session.seen().state == State::Armed && !commanded {
                self.session.send(Request::Setpoint(setpoint));
                commanded = true;
            }
            let output = self.by_hand(tick)?;
            if output.enable {
                return Ok(output);
            }
            if f64::from(tick) * self.period_s > LONGEST_WAIT_S {
                break;
            }
        }
        Err(SessionError::NotBalancing(self.session.seen().state).into())
    }
}
