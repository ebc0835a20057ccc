//! A drive that takes pulses, on the virtual board: every pulse of the flashed image is counted, with its time and its
//! direction, and those of each tick are the host's.

use core::f64::consts::PI;
use std::cell::RefCell;
use std::rc::Rc;

use upright::boards::DEFAULT_BOARD;
use upright::protocol::message::Request;
use upright::supervision::fault::Fault;
use upright::supervision::homing::Homing;
use upright::table::{DriveMap, Law};
use upright_board::{Conditions, Image, Input, Pulse, Time, UNITS_PER_MICROSECOND as US, seconds};
use upright_closed_loop::harness::{RailEnds, Recording, World, record};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::study::Study;
use upright_design::table::TableValues;
use upright_plan::{hangs, up_and_down};
use upright_tool::campaign::{Class, Defect, During, Setup, campaign, kinds, one};
use upright_tool::image::conditions;
use upright_tool::in_the_loop::{Event, RunError, RunPlace, VirtualBoard, run_compared};

use crate::equipment::built_for;
use crate::published::{rig_and_table, rig_and_table_with_motions};

/// What a driver needs: of a pulse, before one, and after a change of direction.
const LEAST: Time = 2 * US + US / 2;

/// All pulses of a run, as they came.
#[derive(Default)]
struct Counted {
    ticks: usize,
    pulses: u64,
    turns: u64,
    least_width: Option<Time>,
    /// From a change of direction to the next pulse, and from a pulse to the next change.
    least_set_up: Option<Time>,
    least_hold: Option<Time>,
    /// Largest difference from pulse j of n at (j + 1/2) / n of its tick, as a share of a tick.
    worst_place: f64,
    /// The first tick whose pulses are not as they have to be.
    wrong: Option<(usize, Vec<Pulse>)>,
    last: Option<Pulse>,
    of_ticks: Vec<i32>,
}

impl Counted {
    fn take(&mut self, due: Time, tick: Time, pulses: &[Pulse]) {
        if !are_even(due, tick, pulses) {
            self.wrong.get_or_insert((self.ticks, pulses.to_vec()));
        }
        let n = pulses.len() as f64;
        for (j, pulse) in (0..).zip(pulses) {
            self.pulses += 1;
            self.least_width = least(self.least_width, pulse.width);
            self.least_set_up = least(self.least_set_up, Some(pulse.at - pulse.turned_at));
            if let Some(last) = self.last.replace(*pulse).filter(|last| last.along != pulse.along) {
                self.turns += 1;
                self.least_hold = least(self.least_hold, pulse.turned_at.checked_sub(last.at));
            }
            let place = (pulse.at - due) as f64 / tick as f64 - (f64::from(j) + 0.5) / n;
            self.worst_place = self.worst_place.max(place.abs());
        }
        self.ticks += 1;
        self.of_ticks.push(pulses.iter().map(|pulse| if pulse.along { 1 } else { -1 }).sum());
    }
}

fn least(a: Option<Time>, b: Option<Time>) -> Option<Time> {
    a.into_iter().chain(b).min()
}

/// Whether the pulses of the tick that was due at `due` are whole, of one direction, and evenly spread over it.
fn are_even(due: Time, tick: Time, pulses: &[Pulse]) -> bool {
    let Some(first) = pulses.first() else { return true };
    let n = pulses.len() as Time;
    let interval = pulses.get(1).map_or(tick / 100 * 98, |second| second.at - first.at);
    let is_one = |pulse: &Pulse| pulse.enabled && pulse.along == first.along && pulse.width.is_some();
    let is_spread = (tick / 1000 * 970..=tick / 1000 * 981).contains(&(n * interval));
    let is_even = pulses.windows(2).all(|pair| pair[1].at - pair[0].at == interval);
    // The first half an interval after a start within 25 µs of the tick, and after a change of direction.
    let begin = first.at - interval / 2;
    pulses.iter().all(is_one) && is_spread && is_even && (due..due + 25 * US).contains(&begin)
}

fn image(rig: &Rig, table: &TableValues) -> Option<Image> {
    let elf = built_for(DEFAULT_BOARD, rig, table)?;
    Some(Image::from_elf(&std::fs::read(elf).unwrap()).unwrap())
}

/// The board, and its pulses; `at` is called with each tick's number, and when the next one is due.
fn counted(
    image: &Image,
    table: &TableValues,
    at: impl Fn(usize, &[Pulse], Time) -> Option<Event> + 'static,
) -> (VirtualBoard, Rc<RefCell<Counted>>) {
    let mut board = VirtualBoard::start(image, &Conditions::f405(1), table).unwrap();
    let counted = Rc::new(RefCell::new(Counted::default()));
    let (log, events, tick) = (Rc::clone(&counted), board.events(), seconds(f64::from(table.tick_s)));
    board.watch_pulses(Box::new(move |due, pulses| {
        let mut counted = log.borrow_mut();
        events.borrow_mut().extend(at(counted.ticks, pulses, due + tick));
        counted.take(due, tick, pulses);
    }));
    (board, counted)
}

/// Compares every pulse and all telemetry with the host.
fn compared(name: &'static str, scenario: &Scenario, image: &Image) -> (Recording, Counted) {
    let (rig, table) = rig_and_table(name);
    let (mut board, log) = counted(image, table, |_, _, _| None);
    let (recording, [ticks, messages]) = run_compared(rig, table, scenario, &mut board).unwrap();
    drop(board);
    let Ok(counted) = Rc::try_unwrap(log) else { panic!("the board is gone") };
    let counted = counted.into_inner();
    assert!(recording.summary.fall.is_none() && recording.fault.is_none(), "{:?}", recording.fault);
    assert!(counted.ticks as u64 == ticks && messages > 100, "{ticks} {messages}");
    assert_eq!(counted.wrong, None, "{name}: first tick with uneven pulses");
    let us = |time: Option<Time>| time.map_or(f64::NAN, |time| time as f64 / US as f64);
    println!(
        "{name}: {} pulses in {ticks} ticks, {} reversals\n  width {:.1} µs, set-up {:.1} µs, hold {:.1} µs at the \
         least; {:.2} % of a tick beside their places at most",
        counted.pulses,
        counted.turns,
        us(counted.least_width),
        us(counted.least_set_up),
        us(counted.least_hold),
        1e2 * counted.worst_place
    );
    for time in [counted.least_width, counted.least_set_up, counted.least_hold] {
        assert!(time.is_some_and(|time| time >= LEAST), "{time:?}");
    }
    assert!(counted.worst_place < 0.03, "{}", counted.worst_place);
    // The cart has gone where the sum of all pulses says: until the last telemetry, a few ticks before the end.
    let samples: Vec<(f64, f64)> =
        recording.trace.samples().map(|sample| (sample.t, sample.state[0])).collect();
    let [(begin_s, from_m), .., (end_s, to_m)] = samples[..] else { panic!("{} samples", samples.len()) };
    let way = (to_m - from_m) / rig.actuator.pulses().unwrap().step_m;
    let (number, all) = (((end_s - begin_s) / rig.tick.period_s).round() as usize, &counted.of_ticks);
    let off = |shift: usize| {
        let end = all.len() - shift;
        (f64::from(all[end - number..end].iter().sum::<i32>()) - way).abs()
    };
    let least = (0..25).map(off).fold(f64::MAX, f64::min);
    assert!(least < 0.01, "{least} steps of {way}");
    (recording, counted)
}

/// With set-points back and forth.
fn moving(rig: &Rig, duration_s: f64) -> Scenario {
    let mut scenario = Scenario { duration_s, step_m: 0.05, ..Scenario::at_rest(rig, Law::Lqr) };
    scenario.start[2] = 0.002;
    scenario
}

#[test]
fn every_pulse_of_a_stepper_is_the_hosts_and_in_its_place() {
    for (name, duration_s) in [("single-stepper", 120.0), ("quadruple-stepper", 4.0)] {
        let (rig, table) = rig_and_table(name);
        let Some(image) = image(rig, table) else { return };
        let (_, counted) = compared(name, &moving(rig, duration_s), &image);
        assert!(counted.pulses > 3_000 && counted.turns > 20, "{} {}", counted.pulses, counted.turns);

        // Negative controls: a host with another limit, and one pulse fewer in a tick.
        let mut other = table.clone();
        let mut steps = *table.drive.pulses().unwrap();
        steps.acceleration_limit_m_per_s2 *= 0.01;
        other.drive = DriveMap::Pulses(steps);
        let mut board = VirtualBoard::start(&image, &Conditions::f405(1), table).unwrap();
        let error = run_compared(rig, &other, &moving(rig, 2.0), &mut board).unwrap_err().to_string();
        assert!(error.contains("differ"), "{error}");
        let tick = seconds(rig.tick.period_s);
        let of = |number: Time| -> Vec<Pulse> {
            let at = |j: Time| tick / 1000 * (98 + 196 * j);
            let pulse = |j| Pulse { at: at(j), width: Some(US), along: true, turned_at: 0, enabled: true };
            (0..number).map(pulse).collect()
        };
        assert!(are_even(0, tick, &of(5)) && !are_even(0, tick, &of(4)));
    }
}

#[test]
#[ignore = "takes some minutes"]
fn every_pulse_of_ten_minutes_is_the_hosts() {
    for name in ["single-stepper", "quadruple-stepper"] {
        let (rig, table) = rig_and_table(name);
        let Some(image) = image(rig, table) else { return };
        let (_, counted) = compared(name, &moving(rig, 600.0), &image);
        assert!(counted.ticks as f64 >= 600.0 / rig.tick.period_s);
    }
}

#[test]
fn a_stepper_raises_and_lowers_its_links_with_the_pulses_of_the_host() {
    let (rig, table) = rig_and_table_with_motions("quadruple-stepper");
    let Some(image) = image(rig, table) else { return };
    let scenario = up_and_down(rig, table, 0.5).unwrap();
    let (mut board, log) = counted(&image, table, |_, _, _| None);
    let (recording, _) = run_compared(rig, table, &scenario, &mut board).unwrap();
    assert!(hangs(&recording), "{:?}", recording.fault);
    let counted = log.borrow();
    assert!(counted.wrong.is_none() && counted.pulses > 1_000, "{:?} {}", counted.wrong, counted.pulses);
}

/// The number of pulses of each tick of a run in which the core stalls from a time in the next tick on, once the cart
/// moves; the tick from which it does, and the result of the run.
fn stalled(
    at: impl Fn(Time, Time) -> [Time; 2] + 'static,
    guard: bool,
) -> Option<(Vec<i32>, usize, Result<Recording, RunError>)> {
    let (rig, table) = rig_and_table("single-stepper");
    let image = image(rig, table)?;
    let onset = Rc::new(RefCell::new(None));
    let seen = Rc::clone(&onset);
    let tick = seconds(rig.tick.period_s);
    let (mut board, log) = counted(&image, table, move |number, pulses, next| {
        if number < 400 || pulses.len() < 5 || seen.borrow().is_some() {
            return None;
        }
        *seen.borrow_mut() = Some(number + 1);
        let [after, until] = at(next, tick);
        Some(Event::Input { after, input: Input::Stall(until) })
    });
    if !guard {
        board.board().apply(Input::IgnoreWatchdog);
    }
    let scenario = Scenario { step_m: 0.1, step_at_s: 1.0, ..moving(rig, 12.0) };
    let recording = record(rig, table, &scenario, &mut board).map_err(RunError::from);
    let onset =
        onset.borrow().unwrap_or_else(|| panic!("the cart does not move: {:?}", recording.as_ref().err()));
    Some((log.borrow().of_ticks.clone(), onset, recording))
}

#[test]
fn pulses_end_when_ticks_stop() {
    // Without the watchdog, too: the timer stops by itself.
    for guard in [true, false] {
        let Some((ticks, onset, _)) = stalled(|_, tick| [tick * 2 / 5, Time::MAX / 2], guard) else { return };
        assert!(ticks[onset] != 0, "the pulses of the last tick are whole");
        assert!(ticks.len() > onset + 5, "{} {onset}", ticks.len());
        assert!(ticks[onset + 1..].iter().all(|&pulses| pulses == 0), "{:?}", &ticks[onset..]);
    }
}

/// The tick before starts its pulses late, so that they still run when they would have to start again.
#[test]
fn a_start_that_would_cut_the_pulses_before_is_refused() {
    let late = |per_mille: Time| stalled(move |due, tick| [US, due + tick * per_mille / 1000], true);
    let Some((ticks, onset, recording)) = late(50) else { return };
    assert_eq!(recording.unwrap().fault, Some(Fault::Clock));
    assert!(
        ticks[onset] > 0 && ticks[onset + 2..].iter().all(|&pulses| pulses == 0),
        "{:?}",
        &ticks[onset..]
    );
    // Negative control: less late than the pause between the pulses of two ticks.
    let Some((_, _, recording)) = late(10) else { return };
    assert_eq!(recording.unwrap().fault, None);
}

#[test]
fn defects_of_a_stepper_are_found_on_the_board_as_on_the_host() {
    let (rig, table) = rig_and_table("single-stepper");
    let Some(image) = image(rig, table) else { return };
    let place = RunPlace::Board { image: &image, conditions: conditions(DEFAULT_BOARD, 1).unwrap() };
    let setup = Setup { rig, table, place, detection: true, guards: true, during: During::Balancing };
    let chosen = [
        Defect::StopBetweenTicks,
        Defect::StalledTick,
        Defect::WriteLost,
        Defect::CartJammed,
        Defect::LimitSwitch,
    ];
    assert!(chosen.iter().all(|kind| kinds(table, place).contains(kind)));
    let result =
        campaign(&setup, &chosen, 1, 2 * chosen.len() as u64, (&Study::whole(), ""), &|| ()).unwrap();
    for row in &result.rows {
        assert!(row.wrong.is_empty() && row.runs == 2, "{row:?}");
    }
    // Negative control: the break input is not connected.
    let unguarded = Setup { guards: false, ..setup };
    let missed = one(&unguarded, &[Defect::StopBetweenTicks], 1, 0).unwrap();
    assert_eq!(missed.class, Class::Missed, "{missed:?}");
}

#[test]
fn a_stepper_finds_both_switches_of_its_rail_on_the_board() {
    let (rig, table) = rig_and_table("single-stepper");
    let Some(image) = image(rig, table) else { return };
    let ends = RailEnds::of(rig);
    // Negative control: without the high one, homing ends where it should have been.
    for (has_high, wanted) in [(true, Homing::Homed), (false, Homing::WrongTravel)] {
        let (mut board, log) = counted(&image, table, |_, _, _| None);
        let mut world = World::new(rig, table, &Scenario::at_rest(rig, Law::Lqr), &mut board).unwrap();
        world.bench.hold(&[0.05, 0.0, PI, 0.0]);
        world.session.send(Request::HomeRail);
        let (mut homing, mut ticks) = (None, 0);
        let is_homing = |homing| matches!(homing, Some(Homing::Touch { .. } | Homing::HoldStill));
        while ticks < 100 || ticks < 6000 && is_homing(homing) {
            let mut inputs = world.inputs();
            ends.press(world.bench.state()[0], &mut inputs.contacts);
            inputs.contacts.limit_high &= has_high;
            let output = world.session.tick(&inputs).unwrap();
            world.bench.tick(output.drive);
            while let Some(telemetry) = world.session.next_telemetry() {
                homing = Some(telemetry.homing);
            }
            ticks += 1;
        }
        let cart_m = world.bench.state()[0];
        println!("{homing:?} after {ticks} ticks, at {cart_m} m");
        assert_eq!(homing, Some(wanted));
        assert!(!has_high || cart_m.abs() < 2e-3, "{cart_m}");
        let counted = log.borrow();
        assert!(counted.pulses > 5_000 && counted.wrong.is_none(), "{} {:?}", counted.pulses, counted.wrong);
    }
}
