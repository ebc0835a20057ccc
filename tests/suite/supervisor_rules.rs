//! The rules of arming, clearing faults and commanding, tested on the whole firmware.

use crate::published::table;
use crate::supervised::{balancing as balance, rig};
use proptest::prelude::*;
use upright::board::{Contacts, Output};
use upright::control::controller::Rejected;
use upright::protocol::message::{Answer, InvalidRequest, Request};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::World;
use upright_design::simulate::Scenario;

fn rejected(reason: Rejected) -> Answer {
    Answer::Rejected(InvalidRequest::Controller(reason))
}

/// Runs a test with the single pendulum, balancing and undisturbed.
fn balancing<T>(test: impl FnOnce(&mut Rigged<'_, '_>) -> T) -> T {
    let rig = rig("single-quanser-ip02");
    balance(&rig, &table(&rig), &Scenario::at_rest(&rig, Law::Lqr), |world| {
        while world.session.next_reply().is_some() || world.session.next_telemetry().is_some() {}
        test(&mut Rigged { world, inputs: Given::default(), output: Output::OFF })
    })
    .unwrap()
}

/// Inputs that a test sets.
#[derive(Clone, Copy, Default)]
struct Given {
    contacts: Contacts,
    supply_v: Option<f32>,
    /// Added to the counts of the link.
    counts: i32,
}

/// The rig and its firmware, with inputs set by the test.
struct Rigged<'h, 't> {
    world: &'h mut World<'t>,
    inputs: Given,
    /// Output of the last tick.
    output: Output,
}

impl Rigged<'_, '_> {
    fn tick(&mut self) -> Output {
        let mut inputs = self.world.inputs();
        inputs.contacts = self.inputs.contacts;
        inputs.supply_v = self.inputs.supply_v.unwrap_or(inputs.supply_v);
        inputs.raw_counts[1] = inputs.raw_counts[1].wrapping_add(self.inputs.counts as u32) & 0xffff;
        self.output = self.world.session.tick(&inputs).unwrap();
        self.world.bench.tick(self.output.drive);
        self.output
    }

    fn inputs(&mut self) -> &mut Given {
        &mut self.inputs
    }

    /// State according to the last telemetry, which describes the tick before the last one.
    fn state(&self) -> State {
        self.world.session.status().state
    }

    fn fault(&self) -> Option<Fault> {
        self.world.session.fault()
    }

    /// Takes three ticks: the command arrives in the first, is executed in the second and answered in the third.
    fn ask(&mut self, request: Request) -> Answer {
        let id = self.world.session.send(request);
        self.wait(3);
        let (answered, answer) = self.world.session.next_reply().unwrap();
        assert_eq!((answered, self.world.session.next_reply()), (id, None));
        answer
    }

    fn wait(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    /// Number of ticks until the motor is off; `None` if it stays on.
    fn ticks_to_off(&mut self, most: u32) -> Option<u32> {
        (1..=most).find(|_| !self.tick().enable)
    }
}

fn reasons(answer: Answer) -> Inhibits {
    match answer {
        Answer::NotNow(reasons) => reasons,
        other => panic!("{other:?}"),
    }
}

#[test]
fn each_input_turns_the_motor_off_in_its_tick() {
    type Case = (fn(&mut Given), u32, Fault);
    let cases: [Case; 7] = [
        (|given| given.contacts.limit_low = true, 1, Fault::LimitSwitch),
        (|given| given.contacts.limit_high = true, 1, Fault::LimitSwitch),
        (|given| given.contacts.emergency_stop = true, 1, Fault::EmergencyStop),
        (|given| given.contacts.driver_fault = true, 1, Fault::Driver),
        (|given| given.contacts.overrun = true, 3, Fault::Overrun),
        (|given| given.supply_v = Some(f32::NAN), 1, Fault::NotFinite),
        // 5 ms at ticks of 2 ms, rounded up to 3 ticks, plus one.
        (|given| given.supply_v = Some(7.9), 4, Fault::Supply),
    ];
    for (change, ticks, fault) in cases {
        balancing(|rig| {
            assert_eq!(rig.ticks_to_off(100), None, "nothing is wrong yet");
            change(rig.inputs());
            assert_eq!(rig.ticks_to_off(100), Some(ticks), "{fault:?}");
            rig.wait(1);
            assert_eq!((rig.state(), rig.fault()), (State::Fault, Some(fault)));
        });
    }
}

#[test]
fn a_brief_overrun_and_a_brief_sag_are_no_fault() {
    balancing(|rig| {
        for _ in 0..20 {
            (rig.inputs().contacts.overrun, rig.inputs().supply_v) = (true, Some(5.0));
            rig.wait(2);
            (rig.inputs().contacts.overrun, rig.inputs().supply_v) = (false, None);
            rig.wait(1);
        }
        assert_eq!(rig.state(), State::Balancing);
        let Answer::Statistics(statistics) = rig.ask(Request::Statistics) else { panic!() };
        assert_eq!(statistics.overruns, 40);
    });
}

#[test]
fn a_set_point_without_sense_is_rejected_and_the_old_one_stays() {
    balancing(|rig| {
        assert_eq!(rig.ask(Request::Setpoint(0.1)), Answer::Done);
        // The motor goes off at 0.38 m; a tenth of the way from one end to the other stays free.
        for position in [f32::NAN, f32::INFINITY, 0.305, -0.305, 0.39, -0.39, -1e9] {
            assert_eq!(rig.ask(Request::Setpoint(position)), rejected(Rejected::Setpoint));
        }
        assert_eq!(rig.ask(Request::Setpoint(-0.303)), Answer::Done);
    });
}

#[test]
fn a_host_that_commands_the_set_point_must_not_fall_silent_and_one_that_does_not_may() {
    balancing(|rig| {
        assert_eq!(rig.ticks_to_off(2000), None);
        rig.ask(Request::Setpoint(0.0));
        for _ in 0..10 {
            rig.wait(47);
            rig.ask(Request::KeepAlive);
        }
        assert_eq!(rig.state(), State::Balancing);
        // 100 ms at ticks of 2 ms, plus one tick; the answer has taken one of them.
        assert_eq!(rig.ticks_to_off(100), Some(51 - 1));
        rig.wait(1);
        assert_eq!(rig.fault(), Some(Fault::LinkLost));
    });
}

#[test]
fn clear_and_arm_are_two_acts_and_a_held_arm_is_none() {
    balancing(|rig| {
        rig.inputs().contacts.driver_fault = true;
        rig.wait(1);
        assert!(reasons(rig.ask(Request::Arm)).contains(Inhibits::FAULT));
        assert_eq!(reasons(rig.ask(Request::Clear)), Inhibits::DRIVER);
        rig.inputs().contacts.driver_fault = false;
        rig.wait(1);
        assert_eq!(rig.ask(Request::Clear), Answer::Done);
        rig.wait(1);
        assert_eq!((rig.state(), rig.fault()), (State::Calibrated, None));
        // The key is still pressed: nothing happens for as long as it is.
        for _ in 0..50 {
            assert!(reasons(rig.ask(Request::Arm)).contains(Inhibits::HELD));
            rig.wait(100);
        }
        assert_eq!(rig.state(), State::Calibrated);
        // Released for half a second. (Undisturbed, the link has stayed upright.)
        rig.wait(260);
        assert_eq!(rig.ask(Request::Arm), Answer::Done);
        rig.wait(200);
        assert_eq!(rig.state(), State::Balancing);
    });
}

#[test]
fn a_tilted_a_moving_and_a_displaced_rig_are_not_armed_and_all_reasons_are_reported() {
    balancing(|rig| {
        rig.ask(Request::Disarm);
        rig.inputs().counts = 40; // 0.06 rad
        rig.inputs().contacts.limit_low = true;
        rig.wait(1);
        let found = reasons(rig.ask(Request::Arm));
        assert_eq!(found, Inhibits::TILTED.union(Inhibits::MOVING).union(Inhibits::LIMIT_SWITCH), "{found}");
        rig.wait(200);
        let found = reasons(rig.ask(Request::Arm));
        assert_eq!(found, Inhibits::TILTED.union(Inhibits::LIMIT_SWITCH), "{found}");
        rig.inputs().contacts.limit_low = false;
        rig.inputs().counts = 0;
        rig.wait(200);
        assert_eq!(rig.ask(Request::Arm), Answer::Done);
        // Tilted while armed: the wait starts again. Fallen: no longer armed.
        rig.wait(100);
        rig.inputs().counts = 40;
        rig.wait(1000);
        assert_eq!(rig.state(), State::Armed);
        // No faster than a link falls.
        for counts in [140, 220, 300] {
            rig.inputs().counts = counts;
            rig.wait(1);
        }
        rig.wait(1);
        assert_eq!(rig.state(), State::Calibrated);
    });
}

#[test]
fn after_an_encoder_fault_home_and_check_again() {
    balancing(|rig| {
        rig.inputs().counts = 100;
        assert_eq!(rig.ticks_to_off(100), Some(3));
        assert_eq!(rig.ask(Request::Clear), Answer::Done);
        rig.wait(1);
        assert_eq!(rig.state(), State::Disarmed);
        let reasons = reasons(rig.ask(Request::Arm));
        assert!(reasons.contains(Inhibits::NOT_HOMED.union(Inhibits::SIGNS)), "{reasons}");
    });
}

#[test]
fn disarming_turns_the_motor_off_and_keeps_the_positions() {
    balancing(|rig| {
        assert_eq!(rig.ask(Request::Disarm), Answer::Done);
        // Off in the tick after the one that executed the command.
        assert_eq!(rig.output, Output::OFF);
        rig.wait(1);
        assert_eq!((rig.state(), rig.fault()), (State::Calibrated, None));
        assert!(reasons(rig.ask(Request::Home)).contains(Inhibits::MOVING), "still for a few ticks only");
    });
}

#[test]
fn what_runs_is_neither_homed_nor_checked_nor_given_another_law() {
    balancing(|rig| {
        for request in [Request::Home, Request::HomeRail, Request::CheckSigns, Request::Arm] {
            assert!(!reasons(rig.ask(request)).is_empty(), "{request:?}");
        }
        assert_eq!(rig.ask(Request::Select(Law::PolePlacement)), rejected(Rejected::Running));
        assert_eq!(rig.state(), State::Balancing);
    });
}

/// Events of a random test: requests, inputs and time.
#[derive(Debug, Clone)]
enum Event {
    Ask(Request),
    Contacts(Contacts),
    Supply(Option<f32>),
    Counts(i32),
    Wait(u32),
}

fn event() -> impl Strategy<Value = Event> {
    let request = prop_oneof![
        Just(Request::Arm),
        Just(Request::Arm),
        Just(Request::Clear),
        Just(Request::Disarm),
        Just(Request::Home),
        Just(Request::HomeRail),
        Just(Request::CheckSigns),
        Just(Request::KeepAlive),
        any::<f32>().prop_map(Request::Setpoint),
    ];
    let contacts = any::<[bool; 5]>().prop_map(|[a, b, c, d, e]| Contacts {
        limit_low: a & b & c,
        limit_high: b & c & d,
        emergency_stop: a & c & e,
        driver_fault: b & d & e,
        overrun: a,
        clock_fault: a & b & c & d & e,
        board_fault: a & b & !c & d & e,
    });
    prop_oneof![
        4 => request.prop_map(Event::Ask),
        1 => contacts.prop_map(Event::Contacts),
        1 => prop_oneof![Just(None), Just(Some(5.0)), Just(Some(f32::NAN))].prop_map(Event::Supply),
        1 => prop_oneof![Just(0), -3000..3000].prop_map(Event::Counts),
        3 => (1u32..400).prop_map(Event::Wait),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_motor_is_on_in_balancing_alone_and_balancing_comes_from_a_deliberate_arm_alone(
        events in prop::collection::vec(event(), 1..60),
        balancing_first: bool,
    ) {
        balancing(|rig| {
            if !balancing_first {
                rig.ask(Request::Disarm);
            }
            let mut rules = Rules::new(rig);
            for event in &events {
                let ticks = match event {
                    Event::Ask(request) => { rules.request(rig, *request); 1 }
                    Event::Contacts(contacts) => { rig.inputs().contacts = *contacts; 1 }
                    Event::Supply(supply) => { rig.inputs().supply_v = *supply; 1 }
                    Event::Counts(counts) => { rig.inputs().counts = *counts; 1 }
                    Event::Wait(ticks) => *ticks,
                };
                for _ in 0..ticks {
                    rules.tick(rig);
                }
            }
        });
    }
}

/// The rules, checked in every tick.
struct Rules {
    /// Contacts and output of the last tick, whose telemetry comes with the next tick.
    last: (Contacts, Output),
    /// State in the tick before it.
    before: State,
    /// Whether an arm command was accepted, and the firmware has been armed or balancing since.
    armed: bool,
    /// Ids of the commands that arm.
    arms: Vec<u64>,
}

impl Rules {
    fn new(rig: &mut Rigged<'_, '_>) -> Self {
        rig.tick();
        let before = rig.state();
        while rig.world.session.next_telemetry().is_some() {}
        // A firmware that is already balancing was armed by hand.
        Self {
            last: (rig.inputs.contacts, rig.output),
            before,
            armed: before == State::Balancing,
            arms: Vec::new(),
        }
    }

    fn request(&mut self, rig: &mut Rigged<'_, '_>, request: Request) {
        let id = rig.world.session.send(request);
        if request == Request::Arm {
            self.arms.push(id);
        }
    }

    fn tick(&mut self, rig: &mut Rigged<'_, '_>) {
        let output = rig.tick();
        let (contacts, last_output) = std::mem::replace(&mut self.last, (rig.inputs.contacts, output));
        let telemetry = rig.world.session.next_telemetry().expect("telemetry of every tick");
        assert_eq!(rig.world.session.next_telemetry(), None);
        let (before, state) = (self.before, telemetry.state);
        assert!(last_output == Output::OFF || state == State::Balancing, "on in {state:?}");
        if state == State::Armed || (state == State::Balancing && before != State::Balancing) {
            assert!(self.armed, "{state:?} without an arm command");
            assert!(
                state == State::Armed
                    || !(contacts.emergency_stop
                        || contacts.driver_fault
                        || contacts.limit_low
                        || contacts.limit_high)
            );
        }
        if !matches!(state, State::Armed | State::Balancing) {
            self.armed = false;
        }
        // A command is executed at the end of the tick, after its telemetry.
        while let Some((id, answer)) = rig.world.session.next_reply() {
            if self.arms.contains(&id) && answer == Answer::Done {
                assert!(state == State::Calibrated, "armed in {state:?}");
                self.armed = true;
            }
        }
        self.before = state;
    }
}
