//! The closed loop: the firmware, the simulated rig on its wires, and whoever takes part in a run.

use std::ops::ControlFlow;

use upright::board::Output;
use upright::protocol::message::{Answer, Request};
use upright::supervision::supervisor::State;

use super::error::HarnessError;
use super::goals::Goals;
use super::hand::Hand;
use super::operator::{Operator, Status};
use super::session::Session;
use super::target::{Pins, Target, healthy};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Scenario, SimulationError};
use upright_design::table::TableValues;

/// Longest time from power-up to balancing (s).
const LONGEST_WAIT_S: f64 = 60.0;

/// Whether a run goes on after a tick.
pub type Flow = Result<ControlFlow<()>, HarnessError>;

/// The run goes on until it `is_over`.
///
/// # Errors
/// Never.
pub fn until(is_over: bool) -> Flow {
    Ok(if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
}

/// Who takes part in a run, tick by tick: a host, a defect, what is observed. The methods are called in the order in
/// which they stand here.
pub trait Participant {
    /// A request for the firmware. Of all participants, the first that has one sends it: one command in a tick.
    fn say(&mut self, _world: &World<'_>) -> Option<Request> {
        None
    }

    /// Acts on the rig before it moves: pulls at it, moves the hand, or changes the output that reaches the motor. May
    /// end the run before the rig moves.
    ///
    /// # Errors
    /// [`HarnessError`] if the run cannot go on.
    fn act(&mut self, _world: &mut World<'_>, _output: &mut Output) -> Flow {
        until(false)
    }

    /// Changes what the firmware reads after the rig has moved.
    ///
    /// # Errors
    /// [`HarnessError::Unsupported`] if this is not possible where the firmware runs.
    fn pins(&mut self, _world: &mut World<'_>, _pins: &mut Pins) -> Result<(), HarnessError> {
        Ok(())
    }

    /// Sees the rig after it has moved, and what the firmware has sent; may end the run.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware has not sent what it should.
    fn saw(&mut self, _world: &mut World<'_>) -> Flow {
        until(false)
    }
}

impl<P: Participant> Participant for Option<P> {
    fn say(&mut self, world: &World<'_>) -> Option<Request> {
        self.as_mut()?.say(world)
    }

    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        self.as_mut().map_or_else(|| until(false), |one| one.act(world, output))
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        self.iter_mut().try_for_each(|one| one.pins(world, pins))
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        self.as_mut().map_or_else(|| until(false), |one| one.saw(world))
    }
}

/// A participant that is only asked before the rig moves: see [`Participant::act`].
pub struct BeforeMotion<F>(pub F);

impl<F: FnMut(&mut World<'_>, &mut Output) -> Flow> Participant for BeforeMotion<F> {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        self.0(world, output)
    }
}

/// Firmware and simulated rig, and the hand that holds the rig or has let it go.
pub struct World<'t> {
    /// The conversation with the firmware.
    pub session: Session<'t>,
    /// The simulated rig.
    pub bench: Bench,
    /// The hand at the rig.
    pub hand: Hand,
    /// The equilibria to which the firmware is told to go.
    pub goals: Goals,
    operator: Operator,
    output: Output,
    force_n: f64,
    counters: Vec<u32>,
    supply_v: f32,
    period_s: f64,
    ticks: usize,
}

impl<'t> World<'t> {
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
        let mut world = Self::powered(rig, table, scenario, target)?;
        world.bench.hold(world.hand.held());
        let hanging = world.inputs();
        world.session.check_info(table.into(), &hanging)?;
        world.session.ask(Request::Select(scenario.law), &hanging)?;
        let every = world.session.pace().telemetry_ticks;
        world.session.ask(Request::Telemetry(every), &hanging)?;
        Ok(world)
    }

    /// The rig in the hand, hanging, and `target`, which has just started and was told nothing yet.
    ///
    /// # Errors
    /// [`SimulationError`] if the rig cannot be simulated.
    pub fn powered(
        rig: &Rig,
        table: &TableValues,
        scenario: &Scenario,
        target: &'t mut dyn Target,
    ) -> Result<Self, SimulationError> {
        Ok(Self {
            session: Session::new(target),
            bench: Bench::new(rig, scenario)?,
            hand: Hand::hanging(rig),
            goals: Goals::default(),
            operator: Operator::new(rig, scenario),
            output: Output::OFF,
            force_n: 0.0,
            counters: vec![0; table.sensors()],
            supply_v: table.drive.supply_v().unwrap_or_default(),
            period_s: rig.tick.period_s,
            ticks: 0,
        })
    }

    /// The input pins of a healthy board in the present state of the rig.
    pub fn inputs(&mut self) -> Pins {
        self.bench.read_counters(&mut self.counters);
        healthy(&self.counters, self.supply_v * self.bench.supply_share() as f32)
    }

    /// The firmware's output in the last tick, with which the rig moves in the next one.
    pub fn last_output(&self) -> Output {
        self.output
    }

    /// The motor's force on the cart at the start of the last tick (N); 0 for a rig in the hand, and for a drive that
    /// imposes the cart's motion.
    pub fn force_n(&self) -> f64 {
        self.force_n
    }

    /// Number of ticks since power-up, or since they are [counted](Self::count_from_here) anew.
    pub fn ticks(&self) -> usize {
        self.ticks
    }

    /// One tick: the rig moves with the firmware's last output or as the hand holds it, then the firmware reads the
    /// pins. Returns whether the run goes on.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer, or a participant has an error.
    pub fn tick(&mut self, participants: &mut [&mut dyn Participant]) -> Flow {
        let goal = self.goals.request(self.ticks, &self.session, &mut self.hand, self.bench.state());
        if let Some(request) = goal.or_else(|| participants.iter_mut().find_map(|one| one.say(self))) {
            self.session.send(request);
        }
        let mut acting = self.output;
        for one in participants.iter_mut() {
            if one.act(self, &mut acting)?.is_break() {
                return until(true);
            }
        }
        self.force_n = if self.hand.has_hold() {
            self.bench.hold(self.hand.held());
            0.0
        } else {
            self.bench.tick(acting.drive)
        };
        let mut pins = self.inputs();
        participants.iter_mut().try_for_each(|one| one.pins(self, &mut pins))?;
        self.output = self.session.tick(&pins)?;
        self.ticks += 1;
        let mut is_over = false;
        for one in participants {
            is_over |= one.saw(self)?.is_break();
        }
        until(is_over)
    }

    /// Runs `ticks` ticks, or until a participant ends the run. What the firmware has sent in a tick and no participant
    /// has taken is forgotten.
    ///
    /// # Errors
    /// As for [`tick`](Self::tick).
    pub fn run(
        &mut self,
        ticks: usize,
        participants: &mut [&mut dyn Participant],
    ) -> Result<(), HarnessError> {
        for _ in 0..ticks {
            let flow = self.tick(participants)?;
            self.session.forget_received();
            if flow.is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Sends a request and runs ticks until it is answered: the rig moves meanwhile.
    ///
    /// # Errors
    /// [`HarnessError::NoAnswer`] if it is not answered.
    pub fn ask(&mut self, request: Request) -> Result<Answer, HarnessError> {
        let id = self.session.send(request);
        for _ in 0..self.session.pace().answer_ticks {
            let _ = self.tick(&mut [])?;
            while let Some((answered, answer)) = self.session.next_reply() {
                if answered == id {
                    return Ok(answer);
                }
            }
        }
        Err(HarnessError::NoAnswer(request))
    }

    /// Runs one tick in which the hand does what comes next on the way to balancing; returns the firmware's output.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer.
    pub fn by_hand(&mut self) -> Result<Output, HarnessError> {
        let status = self.session.status();
        if let Some(request) =
            self.operator.act(self.ticks, &status, &self.output, (&mut self.hand, &mut self.bench))
        {
            self.session.send(request);
        }
        self.tick(&mut []).map(|_| self.output)
    }

    /// Runs ticks [by hand](Self::by_hand) until `is_ready`.
    ///
    /// # Errors
    /// [`HarnessError::NotBalancing`] if that takes longer than a minute.
    pub fn by_hand_until(&mut self, is_ready: impl Fn(&Status) -> bool) -> Result<(), HarnessError> {
        for _ in 0..=(LONGEST_WAIT_S / self.period_s) as u32 {
            self.by_hand()?;
            if is_ready(&self.session.status()) {
                return Ok(());
            }
        }
        Err(HarnessError::NotBalancing(self.session.status().state))
    }

    /// The hand lets go: the rig moves with the firmware's last output next. From now on, ticks are counted from there.
    pub fn let_go(&mut self) {
        self.hand.let_go();
        self.count_from_here();
    }

    /// From now on, ticks are counted from here.
    pub fn count_from_here(&mut self) {
        self.ticks = 0;
    }

    /// Homes, checks the signs, has the motor push the cart, raises the links and arms, or lets them hang and starts
    /// the swing-up. Ends with the first tick in which the controller commands the motor, and returns that tick's
    /// output; the hand has let go then, and ticks are counted from there.
    ///
    /// `setpoint_m` is commanded as soon as the firmware is armed; from then on it needs a command every
    /// [`KEEP_ALIVE`](upright::protocol::KEEP_ALIVE). Without a set-point it holds the position in which it begins.
    ///
    /// # Errors
    /// [`HarnessError::NotBalancing`] if that takes longer than a minute.
    pub fn raise(&mut self, setpoint_m: Option<f32>) -> Result<Output, HarnessError> {
        let mut setpoint_m = setpoint_m;
        for _ in 0..=(LONGEST_WAIT_S / self.period_s) as u32 {
            if self.session.status().state == State::Armed
                && let Some(position_m) = setpoint_m.take()
            {
                self.session.send(Request::Setpoint(position_m));
            }
            let output = self.by_hand()?;
            if self.operator.has_let_go(&self.session.status(), &output) {
                self.let_go();
                return Ok(output);
            }
        }
        Err(HarnessError::NotBalancing(self.session.status().state))
    }
}
