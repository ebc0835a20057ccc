//! The equilibria to which a person tells the firmware to go.

use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::hand::Hand;
use super::operator::RETRY_S;
use super::session::Session;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;

/// Time before the links are raised again at which a hand takes hold of the rig (s): enough to come from either end of
/// the rail.
const PUT_BACK_S: f64 = 5.0;

/// Goals, each of which is requested from its tick on, and again until its motion begins: the firmware refuses it while
/// a link leans or the cart moves. Before a lowered rig is raised again, a hand stills its links and pushes the cart to
/// 0.
#[derive(Default)]
pub struct Goals {
    /// Each with the tick from which it is requested.
    goals: Vec<(usize, Equilibrium)>,
    /// Ticks between two requests, and those before a goal in which a hand puts the rig back.
    retry_ticks: usize,
    put_back_ticks: usize,
    /// The last tick in which the next goal was requested.
    asked: Option<usize>,
    begun: Vec<usize>,
}

impl Goals {
    /// The goals of `scenario`, whose time 0 is the tick in which the rig is let go.
    pub fn of(rig: &Rig, scenario: &Scenario) -> Self {
        let ticks = |seconds: f64| seconds / rig.tick.period_s;
        let goals = scenario.goals.iter().map(|goal| (ticks(goal.at_s).round() as usize, goal.to));
        Self {
            goals: goals.collect(),
            retry_ticks: ticks(RETRY_S).max(1.0) as usize,
            put_back_ticks: ticks(PUT_BACK_S) as usize,
            ..Self::default()
        }
    }

    /// The tick from which this goal is requested, if there are so many.
    pub fn tick_of(&self, index: usize) -> Option<usize> {
        self.goals.get(index).map(|(tick, _)| *tick)
    }

    /// The tick in which the motion to each goal began, for the goals whose motion has begun.
    pub fn begun(&self) -> &[usize] {
        &self.begun
    }

    /// The request of this tick, if there is one; `hand` puts the rig back, which is in state `x`.
    pub(super) fn request(
        &mut self,
        tick: usize,
        session: &Session<'_>,
        hand: &mut Hand,
        x: &[f64],
    ) -> Option<Request> {
        let state = session.status().state;
        if matches!(state, State::Raising | State::Lowering)
            && let Some(asked) = self.asked.take()
        {
            self.begun.push(asked + session.pace().command_ticks);
        }
        let &(at, to) = self.goals.get(self.begun.len())?;
        let is_near = (1..=self.put_back_ticks).contains(&at.saturating_sub(tick));
        let puts_back = is_near && state == State::Calibrated && to != Equilibrium::HANGING;
        if puts_back {
            hand.take_hold(x);
        }
        if !puts_back || hand.push_to(0.0) {
            hand.let_go();
        }
        let rests = match state {
            State::Balancing | State::Holding => true,
            State::Calibrated => to != Equilibrium::HANGING,
            _ => false,
        };
        let asks = rests && tick.checked_sub(at).is_some_and(|since| since.is_multiple_of(self.retry_ticks));
        asks.then(|| {
            self.asked = Some(tick);
            Request::Goto(to)
        })
    }
}
