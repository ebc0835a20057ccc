//! The jog in closed loop with the simulated rig: on the host, and as the flashed image on the virtual board.

use std::path::Path;

use upright::board::{Contacts, Output};
use upright::boards::DEFAULT_BOARD;
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_board::Image;
use upright_closed_loop::client::AnyTelemetry;
use upright_closed_loop::harness::{HarnessError, Target, World, with_firmware};
use upright_design::simulate::Scenario;
use upright_tool::image::conditions;
use upright_tool::in_the_loop::{Compared, VirtualBoard};

use crate::equipment::built;
use crate::published::rig_and_table;

const ALONG: Request = Request::Jog { along: true };
const AGAINST: Request = Request::Jog { along: false };
/// Ticks between two commands of a key that is held.
const KEY_TICKS: u32 = 25;
/// Longest time from the last command to motor off (ticks of 1 ms).
const SILENCE_TICKS: u32 = 100;

/// The motor and the cart.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Machine {
    Sound,
    /// The motor's wires are swapped, or the direction signal is inverted.
    Reversed,
    /// The motor is dead, or the cart is blocked.
    Still,
}

/// A person at the rig, who stops it as soon as the motor is off.
struct Person<'h, 't> {
    world: &'h mut World<'t>,
    machine: Machine,
    contacts: Contacts,
    hanging: Vec<f64>,
    telemetry: Vec<AnyTelemetry>,
}

impl Person<'_, '_> {
    fn tick(&mut self, request: Option<Request>) -> Output {
        if let Some(request) = request {
            self.world.session.send(request);
        }
        let mut inputs = self.world.inputs();
        inputs.contacts = self.contacts;
        let output = self.world.session.tick(&inputs).unwrap();
        let drive = match (output.drive, self.machine) {
            (_, Machine::Still) => Drive::OFF,
            (Drive::Force(force), Machine::Reversed) => Drive::Force(-force),
            (Drive::Duty(duty), Machine::Reversed) => Drive::Duty(-duty),
            (Drive::Steps(_), Machine::Reversed) => panic!("pulses for a motor"),
            (drive, Machine::Sound) => drive,
        };
        if output.enable {
            self.world.bench.tick(drive);
        } else {
            self.hold();
        }
        while let Some(mut telemetry) = self.world.session.next_telemetry() {
            (telemetry.cycles, telemetry.worst_cycles) = (0, 0);
            self.telemetry.push(telemetry);
        }
        output
    }

    /// Holds the links hanging and the cart where it is.
    fn hold(&mut self) {
        self.hanging[0] = self.world.bench.state()[0];
        self.world.bench.hold(&self.hanging);
    }

    fn wait(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick(None);
        }
    }

    fn ask(&mut self, request: Request) -> Answer {
        while self.world.session.next_reply().is_some() {}
        let id = self.world.session.send(request);
        for _ in 0..self.world.session.pace().answer_ticks {
            self.tick(None);
            while let Some((answered, answer)) = self.world.session.next_reply() {
                if answered == id {
                    return answer;
                }
            }
        }
        panic!("no answer to {request:?}")
    }

    fn reasons(&mut self, request: Request) -> Inhibits {
        match self.ask(request) {
            Answer::NotNow(reasons) => reasons,
            answer => panic!("{request:?}: {answer:?}"),
        }
    }

    /// Holds the key for `held_ticks`; returns the number of ticks with the motor on, and how far the cart has moved
    /// (m).
    fn push(&mut self, request: Request, held_ticks: u32) -> (u32, f64) {
        let from = self.world.bench.state()[0];
        let (mut on, mut moved) = (0, 0.0);
        for tick in 0..held_ticks + SILENCE_TICKS + 20 {
            let is_held = tick < held_ticks && tick.is_multiple_of(KEY_TICKS);
            if self.tick(is_held.then_some(request)).enable {
                on += 1;
                moved = self.world.bench.state()[0] - from;
            }
        }
        (on, moved)
    }

    /// Waits until the last telemetry is current, and the rig has been still for long enough.
    fn settle(&mut self) -> (State, MotorSign, Option<Fault>) {
        self.wait(150);
        let status = self.world.session.status();
        (status.state, status.motor, self.world.session.fault())
    }
}

/// Runs `test` on a rig that is homed, with signs checked and links hanging. Returns all telemetry.
fn at_the_bench(test: impl FnOnce(&mut Person<'_, '_>)) -> Vec<AnyTelemetry> {
    with_firmware(&rig_and_table("quadruple-paper").1, |host| bench_of(host, test).unwrap()).unwrap()
}

/// The same where the firmware is `target`.
fn bench_of(
    target: &mut dyn Target,
    test: impl FnOnce(&mut Person<'_, '_>),
) -> Result<Vec<AnyTelemetry>, HarnessError> {
    let (rig, table) = rig_and_table("quadruple-paper");
    let scenario = Scenario::at_rest(rig, Law::Lqr);
    let mut world = World::new(rig, table, &scenario, target)?;
    loop {
        world.by_hand()?;
        if world.session.status().signs == Signs::Checked {
            break;
        }
    }
    let hanging = world.bench.state().to_vec();
    let mut person = Person {
        world: &mut world,
        machine: Machine::Still,
        contacts: Contacts::default(),
        hanging,
        telemetry: Vec::new(),
    };
    assert_eq!(person.settle(), (State::Calibrated, MotorSign::Unchecked, None));
    test(&mut person);
    Ok(person.telemetry)
}

/// Every property of the jog, one after the other.
fn whole_check(person: &mut Person<'_, '_>) {
    assert!(person.reasons(Request::Arm).contains(Inhibits::MOTOR.union(Inhibits::TILTED)));

    // The key is pressed once: the motor goes off after the silence.
    let (on, _) = person.push(ALONG, 1);
    assert_eq!(on, SILENCE_TICKS - 1);
    assert_eq!(person.settle(), (State::Calibrated, MotorSign::Unchecked, None));

    // Nothing moves, however long the key is held.
    let (on, _) = person.push(ALONG, 1300);
    assert_eq!(on, 1000);
    assert_eq!(person.settle(), (State::Calibrated, MotorSign::Still, None));

    person.machine = Machine::Reversed;
    let (on, moved_m) = person.push(ALONG, 400);
    assert!((20..300).contains(&on) && (-0.1..-0.02).contains(&moved_m), "{on} {moved_m}");
    assert_eq!(person.settle(), (State::Calibrated, MotorSign::Reversed, None));
    assert!(person.reasons(Request::Arm).contains(Inhibits::MOTOR));

    // The emergency stop in the middle of a drive: off in its tick, and for good.
    person.machine = Machine::Still;
    for tick in 0..50 {
        person.tick((tick % KEY_TICKS == 0).then_some(ALONG));
    }
    assert!(person.tick(None).enable);
    person.contacts.emergency_stop = true;
    assert!(!person.tick(None).enable);
    person.contacts.emergency_stop = false;
    assert_eq!(person.push(ALONG, 100).0, 0);
    assert_eq!(person.settle().2, Some(Fault::EmergencyStop));
    assert_eq!(person.ask(Request::Clear), Answer::Done);
    person.settle();

    person.machine = Machine::Sound;
    let (on, moved_m) = person.push(AGAINST, 400);
    assert!((20..300).contains(&on) && (-0.1..-0.02).contains(&moved_m), "{on} {moved_m}");
    assert_eq!(person.settle(), (State::Calibrated, MotorSign::Checked, None));
    assert_eq!(person.reasons(Request::Arm), Inhibits::TILTED);
}

#[test]
fn on_the_host_the_motor_moves_the_cart_a_little_while_a_key_is_held() {
    let telemetry = at_the_bench(whole_check);
    let driving = telemetry.iter().filter(|telemetry| telemetry.state == State::Jogging);
    // Never with more than a tenth of the force limit of 20 N, and up to it.
    let most = driving.map(|telemetry| telemetry.applied_n.abs()).fold(0.0, f32::max);
    assert_eq!(most, 2.0);
}

#[test]
fn the_flashed_image_does_it_with_the_bits_of_the_host() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(Path::new(&elf)).unwrap()).unwrap();
    let (_, table) = rig_and_table("quadruple-paper");
    let mut board = VirtualBoard::start(&image, &conditions(DEFAULT_BOARD, 1).unwrap(), table).unwrap();
    with_firmware(table, |host| {
        let mut compared = Compared::new(&mut board, host);
        bench_of(&mut compared, whole_check).unwrap();
        assert!(
            compared.ticks > 1_000 && compared.messages > 100,
            "{} {}",
            compared.ticks,
            compared.messages
        );
    })
    .unwrap();
}

#[test]
fn every_contact_ends_it_at_once() {
    type Case = (fn(&mut Contacts), Fault);
    let cases: [Case; 6] = [
        (|contacts| contacts.limit_low = true, Fault::LimitSwitch),
        (|contacts| contacts.limit_high = true, Fault::LimitSwitch),
        (|contacts| contacts.emergency_stop = true, Fault::EmergencyStop),
        (|contacts| contacts.driver_fault = true, Fault::Driver),
        (|contacts| contacts.clock_fault = true, Fault::Clock),
        (|contacts| contacts.board_fault = true, Fault::Board),
    ];
    at_the_bench(|person| {
        for (open, fault) in cases {
            person.tick(Some(ALONG));
            person.wait(30);
            assert!(person.tick(None).enable, "nothing is wrong yet");
            open(&mut person.contacts);
            assert!(!person.tick(None).enable, "{fault:?}");
            assert_eq!(person.settle().2, Some(fault));
            assert!(person.reasons(ALONG).contains(Inhibits::FAULT));
            person.contacts = Contacts::default();
            assert_eq!(person.ask(Request::Clear), Answer::Done);
            person.settle();
        }
        // Disarming ends it, too, and silence of the host is no fault.
        person.tick(Some(ALONG));
        person.wait(30);
        assert_eq!(person.ask(Request::Disarm), Answer::Done);
        assert!(!person.tick(None).enable);
        assert_eq!(person.settle(), (State::Calibrated, MotorSign::Unchecked, None));
    });
}

#[test]
fn it_is_refused_when_links_swing_and_at_an_end_of_the_rail() {
    at_the_bench(|person| {
        let place = |person: &mut Person<'_, '_>, index: usize, position: f64| {
            let mut state = person.hanging.clone();
            state[index] = position;
            person.world.bench.hold(&state);
            let inputs = person.world.inputs();
            person.world.session.tick(&inputs).unwrap();
        };
        // A link swings through its rest position.
        for _ in 0..5 {
            place(person, 4, 0.3);
            person.wait(20);
        }
        assert_eq!(person.reasons(ALONG), Inhibits::MOVING);
        // The key is still held, and does not start the drive later.
        person.wait(80);
        assert_eq!(person.reasons(ALONG), Inhibits::HELD);
        person.settle();
        // A link that rests on something.
        person.hanging[4] = 0.3;
        person.settle();
        assert_eq!(person.reasons(ALONG), Inhibits::NOT_HANGING);
        person.hanging[4] = 0.0;
        let middle = person.world.bench.state()[0];
        place(person, 0, 1.95);
        person.settle();
        assert_eq!(person.reasons(ALONG), Inhibits::OFF_CENTRE);
        place(person, 0, middle);
        person.settle();
        person.contacts.limit_low = true;
        person.settle();
        assert_eq!(person.reasons(ALONG), Inhibits::LIMIT_SWITCH);
        person.contacts.limit_low = false;
        person.settle();
        // Negative control: no reason against it is left.
        assert_eq!(person.ask(ALONG), Answer::Done);
        // The other key neither keeps it going nor reverses it.
        assert_eq!(person.reasons(AGAINST), Inhibits::RUNNING);
    });
}
