//! The whole firmware brings double and triple from equilibrium to equilibrium, and refuses what it must not do.

use std::sync::OnceLock;

use crate::published::{rig, rig_path, stored_motions, table};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;
use upright::board::Output;
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;
use upright_closed_loop::harness::{
    Flow, Goals, HarnessError, Participant, Pins, World, until, with_firmware,
};
use upright_design::motion::{PlannedMotion, Transition, equilibrium_named};
use upright_design::rig::Rig;
use upright_design::simulate::{Goal, Scenario};
use upright_design::study::Study;
use upright_design::table::TableValues;
use upright_plan::{Route, Script, StoredTransitions, route_runs, with_motions};

const DOUBLE: &str = "double-quanser-dbpen";

/// A rig and its table with all stored motions.
fn with_all_motions(name: &'static str) -> (Rig, TableValues) {
    let rig = rig(name);
    let others = StoredTransitions::beside(&rig_path(name)).unwrap().transitions(&rig).unwrap();
    let table = with_motions(&rig, table(&rig), stored_motions(name), &others).unwrap();
    (rig, table)
}

/// The double and its table with all stored motions.
fn double() -> (Rig, TableValues) {
    static MADE: OnceLock<(Rig, TableValues)> = OnceLock::new();
    MADE.get_or_init(|| with_all_motions(DOUBLE)).clone()
}

fn transition(name: &str) -> Transition {
    Transition::named(name, 2).unwrap()
}

/// `table` with only these of its motions between other equilibria.
fn with_transitions(table: &TableValues, transitions: &[&str]) -> TableValues {
    let mut table = table.clone();
    let wanted: Vec<Transition> = transitions.iter().map(|name| transition(name)).collect();
    table.swing_up.as_mut().unwrap().others.retain(|(transition, _)| wanted.contains(transition));
    table
}

#[test]
fn the_double_goes_every_way_between_its_equilibria_one_after_the_other() {
    let (rig, table) = double();
    let route = Route::of(&rig, &table).unwrap();
    let missing: Vec<Transition> =
        Transition::all(2).into_iter().filter(|transition| !route.transitions.contains(transition)).collect();
    assert_eq!(missing, []);
    let script = Script::route(&rig, &table, 3).unwrap();
    let demonstration = script.run(&table).unwrap();
    assert!(demonstration.arrived, "{:?}", demonstration.fault);
}

#[test]
fn the_triple_goes_every_stored_way_one_after_the_other() {
    let (rig, table) = with_all_motions("triple-glueck-eder-kugi");
    let demonstration = Script::route(&rig, &table, 3).unwrap().run(&table).unwrap();
    assert!(demonstration.arrived, "{:?}", demonstration.fault);
}

#[test]
fn a_motion_that_no_run_has_judged_does_not_get_into_a_table() {
    let mut object: Value = serde_json::from_str(
        &std::fs::read_to_string(StoredTransitions::path_beside(&rig_path(DOUBLE))).unwrap(),
    )
    .unwrap();
    object["tours"].as_object_mut().unwrap().remove("uu-ud").unwrap();
    let stored: StoredTransitions = serde_json::from_value(object).unwrap();
    let rig = rig(DOUBLE);
    let transitions = |transitions: Vec<(Transition, PlannedMotion)>| -> Vec<Transition> {
        transitions.iter().map(|(transition, _)| *transition).collect()
    };
    let (judged, all) =
        (transitions(stored.transitions(&rig).unwrap()), transitions(stored.all(&rig).unwrap()));
    let missing: Vec<Transition> =
        all.into_iter().filter(|transition| !judged.contains(transition)).collect();
    assert_eq!(missing, [transition("uu-ud")]);
}

#[test]
fn machines_with_wrong_masses_make_the_route_and_with_reversed_gains_none_does() {
    let (rig, table) = double();
    let mut table = with_transitions(&table, &["uu-ud", "ud-du", "du-uu"]);
    let route = Route::of(&rig, &table).unwrap();
    let arrived = |table: &TableValues| {
        let transitions = route_runs(&rig, table, &route, 1, 4, &Study::whole()).unwrap().transitions;
        transitions.iter().map(|one| one.arrived).collect::<Vec<_>>()
    };
    assert_eq!(route.transitions, ["dd-uu", "uu-ud", "ud-du", "du-uu", "uu-dd"].map(transition));
    assert_eq!(arrived(&table), [4; 5]);
    let motion = &mut table
        .swing_up
        .as_mut()
        .unwrap()
        .others
        .iter_mut()
        .find(|(w, _)| *w == transition("ud-du"))
        .unwrap()
        .1;
    let knots = motion.reference.len() / motion.reference_units.len();
    motion.reference[5 * knots..].iter_mut().for_each(|gain| *gain = -*gain);
    assert_eq!(arrived(&table), [4, 4, 0, 0, 0]);
}

/// Raises the double, brings it to the equilibrium at which its second link hangs, and holds it there. `then` is
/// called in each tick of holding with the number of ticks held, may change the drive of the motor, and ends the run
/// by returning true. `read` may change what the board reads.
fn hold(
    table: &TableValues,
    rig: &Rig,
    read: impl FnMut(usize, &mut Pins),
    then: impl FnMut(usize, &mut World<'_>, &mut Output) -> bool,
) {
    let scenario = Scenario {
        force_noise_n: 0.0,
        torque_noise_n_m: 0.0,
        goals: vec![Goal { at_s: 5400.0 * rig.tick.period_s, to: transition("uu-ud").to(2) }],
        ..Scenario::swing_up(rig, 0.0, None)
    };
    with_firmware(table, |target| {
        let mut world = World::new(rig, table, &scenario, target).unwrap();
        world.raise(None).unwrap();
        world.goals = Goals::of(rig, &scenario);
        let mut held = Held { held: 0, read, then, is_over: false };
        world.run(20_000, &mut [&mut held]).unwrap();
        let state = world.session.status().state;
        assert!(held.is_over, "it does not end: {state:?}, {:?}", world.session.fault());
    })
    .unwrap();
}

/// Holds, with what [`hold`] is given.
struct Held<R, T> {
    held: usize,
    read: R,
    then: T,
    is_over: bool,
}

impl<R, T> Participant for Held<R, T>
where
    R: FnMut(usize, &mut Pins),
    T: FnMut(usize, &mut World<'_>, &mut Output) -> bool,
{
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        self.is_over = self.held > 0 && (self.then)(self.held, world, output);
        until(false)
    }

    fn pins(&mut self, _: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        (self.read)(self.held, pins);
        Ok(())
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        self.held += usize::from(self.held > 0 || world.session.status().state == State::Holding);
        until(self.is_over)
    }
}

/// Ticks of holding after which a defect begins, and ticks for which somebody then pushes the cart.
const ONSET: usize = 500;
const TAP: usize = 50;

/// The table with only the motions to and from the equilibrium at which the second link hangs.
fn table_to_hold(table: &TableValues) -> TableValues {
    with_transitions(table, &["uu-ud", "ud-uu", "ud-dd"])
}

/// The fault with which a defect ends the run, and the number of ticks since the defect began; none if there is no
/// fault within 3000 ticks.
fn ended(
    rig: &Rig,
    table: &TableValues,
    read: impl FnMut(usize, &mut Pins),
    drive: impl Fn(&mut Drive),
) -> Option<(Fault, usize)> {
    let mut ended = None;
    hold(table, rig, read, |held, world, output| {
        ended = world.session.fault().map(|fault| (fault, held.saturating_sub(ONSET)));
        assert!(ended.is_none() || !output.enable, "a fault turns the motor off");
        if (ONSET..ONSET + TAP).contains(&held) {
            world.bench.pull(2.0, &[0.0; 2]);
        }
        if held >= ONSET {
            drive(&mut output.drive);
        }
        ended.is_some() || held == ONSET + 3000
    });
    ended
}

#[test]
fn where_a_link_hangs_the_cart_follows_its_setpoint() {
    let (rig, table) = double();
    hold(
        &table_to_hold(&table),
        &rig,
        |_, _| (),
        |held, world, _| {
            assert_eq!(world.session.fault(), None);
            match held {
                500 => _ = world.session.send(Request::Setpoint(0.05)),
                501.. if held % 25 == 0 => _ = world.session.send(Request::KeepAlive),
                _ => {}
            }
            if held == 8000 {
                let x = world.bench.state()[0];
                assert!((x - 0.05).abs() < 0.01, "{x}");
                assert_eq!(world.session.status().state, State::Holding);
            }
            held == 8000
        },
    );
}

#[test]
fn where_a_link_hangs_a_defect_turns_the_motor_off() {
    let (rig, table) = double();
    let table = table_to_hold(&table);
    let as_asked = |_: &mut Drive| ();
    assert_eq!(ended(&rig, &table, |_, _| (), as_asked), None, "the negative control");
    // The hanging link hardly moves, so its encoder may freeze unnoticed; but a jump has to be noticed. The upright
    // link may leave its path before its encoder is accused.
    for (sensor, most) in [(0, 3000), (1, 1000)] {
        let mut seen = 0;
        let frozen = |held: usize, pins: &mut Pins| {
            if held <= ONSET {
                seen = pins.raw_counts[sensor];
            }
            pins.raw_counts[sensor] = seen;
        };
        let (fault, ticks) = ended(&rig, &table, frozen, as_asked).expect("a frozen encoder");
        assert!(
            matches!(fault, Fault::Encoder | Fault::Frozen | Fault::TrackingError) && ticks <= most,
            "{sensor}: {fault} {ticks}"
        );
    }
    for sensor in 0..3 {
        let jumps = |held: usize, pins: &mut Pins| {
            let counter = &mut pins.raw_counts[sensor];
            *counter = counter.wrapping_add(if held >= ONSET { 2000 } else { 0 });
        };
        let (fault, ticks) = ended(&rig, &table, jumps, as_asked).expect("an encoder that jumps");
        assert!(fault == Fault::Encoder && ticks <= 100, "{sensor}: {fault} {ticks}");
    }
    let stop = |held: usize, pins: &mut Pins| pins.contacts.emergency_stop = held >= ONSET;
    let (fault, ticks) = ended(&rig, &table, stop, as_asked).expect("the emergency stop");
    assert!(fault == Fault::EmergencyStop && ticks <= 2, "{fault} {ticks}");
    // A dead motor at rest looks like the friction that a typical cart has, until the cart leaves its path.
    let dead: fn(Fault) -> bool = |fault| matches!(fault, Fault::Motor | Fault::TrackingError);
    let reversed: fn(Fault) -> bool = |fault| fault == Fault::Motor;
    for (factor, is_meant, most) in [(0.0, dead, 600), (-1.0, reversed, 100)] {
        let broken = |drive: &mut Drive| match drive {
            Drive::Duty(value) | Drive::Force(value) => *value *= factor,
            Drive::Steps(_) => panic!("pulses for a motor"),
        };
        let (fault, ticks) =
            ended(&rig, &table, |_, _| (), broken).expect("a motor that is dead or reversed");
        assert!(is_meant(fault) && ticks <= most, "{factor}: {fault} {ticks}");
    }
}

#[test]
fn goals_and_set_points_at_any_moment_never_end_in_a_fault() {
    let (rig, table) = double();
    let mut states = Vec::new();
    for seed in 1..=8 {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut next = 1;
        hold(
            &table,
            &rig,
            |_, _| (),
            |held, world, output| {
                assert_eq!(world.session.fault(), None, "seed {seed}, tick {held}");
                let drive = output.drive.value();
                assert!(drive.is_finite());
                states.push(world.session.status().state);
                if held == next {
                    next += random.random_range(1..1500);
                    world.session.send(match random.random_range(0..4) {
                        0 => Request::Setpoint(random.random_range(-0.1..0.1)),
                        _ => Request::Goto(Equilibrium::of_bits(random.random_range(0..256))),
                    });
                } else if held % 25 == 0 {
                    world.session.send(Request::KeepAlive);
                }
                while world.session.next_reply().is_some() || world.session.next_telemetry().is_some() {}
                held == 11_000
            },
        );
        states.dedup();
        println!("{states:?}");
        assert!(states.len() > 3);
    }
}

#[test]
fn a_goal_is_refused_with_its_reasons() {
    let (rig, table) = double();
    let table = with_transitions(&table, &["uu-ud", "ud-dd"]);
    let mut answers = Vec::new();
    hold(
        &table,
        &rig,
        |_, _| (),
        |held, world, _| {
            let mut ask = |to: &str| {
                let id = world.session.send(Request::Goto(equilibrium_named(to, 2).unwrap()));
                for _ in 0..5 {
                    let inputs = world.inputs();
                    world.session.tick(&inputs).unwrap();
                    while let Some((answered, answer)) = world.session.next_reply() {
                        if answered == id {
                            return answer;
                        }
                    }
                }
                panic!("no answer");
            };
            if held == ONSET {
                answers = ["ud", "du", "uu", "dd"].map(&mut ask).to_vec();
            }
            held == ONSET
        },
    );
    let no_transition = Answer::NotNow(Inhibits::NO_TRANSITION);
    assert_eq!(answers, [Answer::NotNow(Inhibits::RUNNING), no_transition, no_transition, Answer::Done]);
}
