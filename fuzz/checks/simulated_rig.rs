//! A board with a rig behind it that is cheap to simulate: the observer's own model while the motor is on, a hand that
//! holds the rig while it is off.

use crate::gains::{SENSORS, STATES, TABLE, TICK_S};
use upright::board::{Board, Contacts, Inputs, Output};
use upright::control::actuator::Drive;
use upright::control::encoder::CounterWidth;
use upright::firmware::Firmware;
use upright::protocol::message::{Answer, Command, Request, Reset};
use upright::supervision::jog::MotorSign;
use upright::supervision::shaking::{FORCES, Shaking};
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::NoSwingUp;

/// How the rig is shaken in the starting state `shaken`.
pub(crate) const SHAKING: Shaking = Shaking { largest_input: 2.0, stiffness: 5.0, damping: 2.0 };

/// A hand moves cart and links by this many counts in a tick: further would be a counter that jumps.
const COUNTS_PER_TICK: i32 = 100;

/// The whole firmware with the committed gains.
pub(crate) type Tested = Firmware<'static, STATES, SENSORS>;

/// Rig, contacts and supply, and the last output to the motor.
#[derive(Clone)]
pub(crate) struct SimulatedRig {
    state: [f32; STATES],
    /// Counts that are added to those of the simulated state, as if a hand had moved cart or links.
    pub(crate) offset: [i32; SENSORS],
    pub(crate) contacts: Contacts,
    pub(crate) supply_v: f32,
    pub(crate) output: Output,
}

impl SimulatedRig {
    fn new() -> Self {
        let offset = counts_at_rest();
        let contacts = Contacts::default();
        Self { state: [0.0; STATES], offset, contacts, supply_v: 24.0, output: Output::OFF }
    }

    /// One tick with the force of the output; while the motor is off, the hand stops the rig.
    fn advance(&mut self) {
        let observer = TABLE.observer.as_ref().expect("the committed table has an observer");
        if !self.output.enable {
            self.state.iter_mut().skip(1).step_by(2).for_each(|rate| *rate = 0.0);
            return;
        }
        let force = match self.output.drive {
            Drive::Force(force) => force,
            Drive::Duty(duty) => duty * TABLE.drive.largest_force_n(),
            Drive::Steps(_) => panic!("pulses for a motor"),
        };
        let mut next = [0.0; STATES];
        for (row, next) in next.iter_mut().enumerate() {
            let products = self.state.iter().enumerate().map(|(column, x)| observer.ad[(row, column)] * x);
            *next = products.sum::<f32>() + observer.bd[row] * force;
        }
        self.state = next;
    }
}

impl Board<SENSORS> for SimulatedRig {
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32; SENSORS];

    fn inputs(&mut self) -> Inputs<SENSORS> {
        let mut raw_counts = [0; SENSORS];
        for (sensor, raw) in raw_counts.iter_mut().enumerate() {
            let counts = self.state[2 * sensor] / TABLE.sensors[sensor].step;
            *raw = (counts.round() as i32).wrapping_add(self.offset[sensor]) as u32;
        }
        Inputs { raw_counts, supply_v: self.supply_v, contacts: self.contacts }
    }

    fn tick_s(&self) -> f32 {
        TICK_S
    }

    fn drive(&mut self, output: &Output) {
        self.output = *output;
        self.advance();
    }

    fn feed_watchdog(&mut self) {}

    fn cycles(&self) -> u32 {
        0
    }
}

/// Firmware and rig in a state to start from.
#[derive(Clone)]
pub(crate) struct Start {
    pub(crate) firmware: Tested,
    pub(crate) rig: SimulatedRig,
    /// Id of the last command.
    pub(crate) id: u64,
}

impl Start {
    fn tick(&mut self, request: Option<Request>) -> Option<Answer> {
        let inputs = self.rig.inputs();
        let output = self.firmware.control(&inputs);
        self.rig.drive(&output);
        let command = request.map(|request| {
            self.id += 1;
            Command { id: self.id, request }
        });
        self.firmware.finish(command.as_ref(), 0).1.map(|reply| reply.answer)
    }

    fn wait(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick(None);
        }
    }

    /// Moves cart and links by hand until these counts are added to those of the simulated state.
    fn move_to(&mut self, offset: [i32; SENSORS]) {
        while self.rig.offset != offset {
            for (now, to) in self.rig.offset.iter_mut().zip(offset) {
                *now += (to - *now).clamp(-COUNTS_PER_TICK, COUNTS_PER_TICK);
            }
            self.tick(None);
        }
    }

    fn ask(&mut self, request: Request) {
        assert_eq!(self.tick(Some(request)), Some(Answer::Done), "{request:?}");
    }
}

/// Goes from power-up to balancing as a person would, and returns the states on the way:
/// `[hanging, shaken, raised, armed, balancing, stopped]`.
///
/// Hanging is just after power-up; shaken is homed, checked, and shaken for some ticks; raised is homed, checked,
/// upright and still; armed is two ticks before balancing. Stopped is armed and then stopped by the emergency stop,
/// which is released again: the fault is latched.
/// Counts of the sensors while the links hang at rest.
fn counts_at_rest() -> [i32; SENSORS] {
    TABLE.sensors.map(|sensor| sensor.rest_counts)
}

pub(crate) fn starts() -> [Start; 6] {
    let limits = &TABLE.limits;
    let firmware = Firmware::new(&TABLE, &NoSwingUp, SimulatedRig::WIDTHS, Reset::Power);
    let mut start = Start { firmware, rig: SimulatedRig::new(), id: 0 };
    start.wait(limits.still_ticks + 1);
    let hanging = start.clone();
    start.ask(Request::Home);
    start.ask(Request::CheckSigns);
    while start.firmware.calibration().signs() != Signs::Checked {
        match start.firmware.calibration().signs() {
            Signs::Rest(_) => {
                start.move_to(counts_at_rest());
                start.wait(limits.still_ticks + 1);
            }
            Signs::Move(sensor) => {
                let mut moved = counts_at_rest();
                moved[usize::from(sensor)] += TABLE.sensors[usize::from(sensor)].sign_counts;
                start.move_to(moved);
            }
            signs => panic!("{signs:?}"),
        }
    }
    // The motor pushes the cart; the links hang all the time.
    start.move_to(counts_at_rest());
    start.wait(limits.arm_ticks);
    start.ask(Request::Jog { along: true });
    while start.firmware.state() == State::Jogging {
        start.tick(Some(Request::Jog { along: true }));
        start.rig.state = [0.0; STATES];
        start.rig.offset[0] += COUNTS_PER_TICK;
    }
    assert_eq!(start.firmware.motor_sign(), MotorSign::Checked);
    let shaken = shaken(start.clone());
    start.move_to([0; SENSORS]);
    start.wait(limits.arm_ticks + 1);
    let raised = start.clone();
    start.ask(Request::Arm);
    start.wait(limits.arm_ticks - 2);
    let armed = start.clone();
    assert_eq!(armed.firmware.state(), State::Armed);
    let mut stopped = armed.clone();
    stopped.rig.contacts.emergency_stop = true;
    stopped.wait(limits.arm_ticks);
    stopped.rig.contacts.emergency_stop = false;
    stopped.wait(limits.arm_ticks);
    assert_eq!(stopped.firmware.state(), State::Fault);
    start.wait(3);
    assert_eq!(start.firmware.state(), State::Balancing);
    start.wait(50);
    [hanging, shaken, raised, armed, start, stopped]
}

/// From hanging, with the motor checked, to being shaken.
fn shaken(mut start: Start) -> Start {
    start.move_to(counts_at_rest());
    start.wait(TABLE.limits.still_ticks + 1);
    start.ask(Request::Shake(SHAKING));
    for force in [10, -10] {
        let first = start.firmware.statistics().ticks as u16 + 2;
        start.ask(Request::Forces { first, forces: [force; FORCES] });
        start.wait(FORCES as u32);
    }
    assert_eq!(start.firmware.state(), State::Identifying);
    start
}
