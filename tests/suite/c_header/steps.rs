//! The header for a drive with pulses: against the firmware's controller and its supervision, in closed loop.

use super::program::{Program, is_there};
use super::recorded::{BALANCING, ControllerTick, Defect, FAULT, FirmwareRun, command, recorded, scenario};
use super::{STRICT, differing, first_difference, replayed};
use crate::published::{rig_and_table, table};
use upright::control::actuator::Drive;
use upright::control::controller::Controller;
use upright::supervision::debounce::Debounce;
use upright::supervision::detection::Detection;
use upright::supervision::envelope;
use upright::supervision::fault::Fault;
use upright::supervision::slow_drive::SlowDrive;
use upright::table::{DriveMap, Equilibrium, GainTable, Law, StepMap};
use upright_design::export::c_header;
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Scenario, StepDefect};
use upright_design::table::{TableValues, WithSize, with_size};

/// What acts on the rig or its wires while it balances, by the tick of balancing.
pub(super) type Disturbance = fn(usize, &mut Bench, &mut [u32]);

pub(super) fn nothing(_: usize, _: &mut Bench, _: &mut [u32]) {}

/// Runs the controller of `table` on the simulated `rig`, supervised as while the firmware balances.
pub(super) fn recorded_steps(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    disturb: Disturbance,
) -> FirmwareRun {
    let run = StepRun { rig, table, scenario, disturb };
    with_size(table.states(), table.sensors(), run).unwrap()
}

struct StepRun<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    scenario: &'a Scenario,
    disturb: Disturbance,
}

impl WithSize for StepRun<'_> {
    type Output = FirmwareRun;

    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> FirmwareRun {
        let table = self.table.table::<NX, NY>();
        let law_index = table.laws.present().position(|(law, _)| law == self.scenario.law).unwrap() as u32;
        let mut bench = Bench::new(self.rig, self.scenario).unwrap();
        let mut raw = [0; NY];
        bench.read_counters(&mut raw);
        // Homed where the links hang at rest, then put upright.
        let mut at_zero = [0; NY];
        bench.read_counters_at_zero(&mut at_zero);
        let mut hanging = at_zero;
        for (sensor, (reading, counts)) in
            hanging.iter_mut().zip(table.sensors.map(|row| row.rest_counts)).enumerate()
        {
            *reading = Bench::reading(sensor, reading.wrapping_add(counts as u32));
        }
        let words = |action: u32, setpoint: f32, raw: &[u32]| {
            [action, setpoint.to_bits()].into_iter().chain(raw.iter().copied()).collect::<Vec<u32>>()
        };
        let mut input = vec![words(1 | 2 | law_index << 8, 0.0, &hanging)];
        // No faster than a link turns.
        let mut lifted = hanging;
        while lifted != raw {
            for ((sensor, lifted), &to) in lifted.iter_mut().enumerate().zip(&raw) {
                let left = (to.wrapping_sub(*lifted) as i16).clamp(-20, 20);
                *lifted = Bench::reading(sensor, lifted.wrapping_add(i32::from(left) as u32));
            }
            input.push(words(0, 0.0, &lifted));
        }
        let arm_ticks = table.limits.arm_ticks as usize;
        // Balancing begins in the last tick of those that it has to be still.
        input.extend((1..arm_ticks).map(|tick| words(if tick == 1 { 4 | 8 } else { 8 }, 0.0, &raw)));
        let first = input.len();

        let mut balanced = Balanced::start(&table, self.scenario.law, &at_zero, &raw);
        let mut wanted = Vec::new();
        let ticks = (self.scenario.duration_s / self.rig.tick.period_s).round() as usize;
        for tick in 0..ticks {
            bench.read_counters(&mut raw);
            (self.disturb)(tick, &mut bench, &mut raw);
            let setpoint = self.scenario.target_m(tick as f64 * self.rig.tick.period_s) as f32;
            let arm = if arm_ticks == 1 && tick == 0 { 4 } else { 0 };
            input.push(words(arm | 8, setpoint, &raw));
            let (answer, pulses) = balanced.tick(setpoint, &raw);
            let is_over = answer.state == FAULT;
            wanted.push(answer);
            if is_over {
                break;
            }
            bench.tick(Drive::Steps(pulses));
        }
        FirmwareRun { input, wanted, outputs: Vec::new(), first, fault: balanced.fault }
    }
}

/// The controller and the supervision of a run.
struct Balanced<'t, const NX: usize, const NY: usize> {
    table: &'t GainTable<NX, NY>,
    controller: Controller<'t, NX, NY>,
    detection: Detection<NY>,
    debounce: Debounce,
    fault: Option<Fault>,
}

impl<'t, const NX: usize, const NY: usize> Balanced<'t, NX, NY> {
    fn start(table: &'t GainTable<NX, NY>, law: Law, at_zero: &[u32; NY], raw: &[u32; NY]) -> Self {
        let mut controller = Controller::new(table, Bench::widths()).unwrap();
        controller.select(law).unwrap();
        controller.encoders_mut().home(at_zero, &[0; NY]);
        controller.follow(raw);
        let upright = table.unwound(controller.encoders().counts(), Equilibrium::UPRIGHT);
        controller.encoders_mut().home(raw, &upright);
        controller.start(raw).unwrap();
        let mut detection = Detection::of_motor(table.drive.witness());
        detection.start(controller.encoders().counts(), &controller.positions().data.0[0]);
        Self { table, controller, detection, debounce: Debounce::default(), fault: None }
    }

    /// What the controller in C has to answer in this tick, and the pulses.
    fn tick(&mut self, setpoint: f32, raw: &[u32; NY]) -> (ControllerTick, i32) {
        self.controller.set_setpoint(setpoint).unwrap();
        let mut found = None;
        let command = self.controller.control_with(raw, |counts, y, e| {
            found = self.detection.test(&self.table.thresholds, counts, y, e);
        });
        let limits = &self.table.limits;
        let of_force = self.debounce.check_force(limits, command.requested_n != command.applied_n);
        let exceeded = envelope::exceeded(limits, self.controller.estimate().as_slice(), command.requested_n);
        self.fault = exceeded.or(found.map(|finding| finding.fault)).or(of_force);
        let Drive::Steps(mut pulses) = command.drive else { panic!("{command:?}") };
        let mut is_on = true;
        if let Some(fault) = self.fault {
            let mut brake = SlowDrive::default();
            if fault.leaves_drive_working() {
                brake.take_over(self.controller.estimate()[1]);
            }
            is_on = brake.is_moving();
            pulses = self.table.drive.pulses().map_or(0, |steps| brake.pulses(steps, self.table.tick_s));
        }
        let numbers = [command.requested_n, command.applied_n, self.controller.law_state().setpoint];
        let estimate = self.controller.estimate().iter().chain(self.controller.innovation().iter());
        let answer = ControllerTick {
            state: if self.fault.is_some() { FAULT } else { BALANCING },
            fault: self.fault.map_or(0, |fault| fault.code().into()),
            duty: pulses as u32,
            is_on,
            values: numbers.iter().chain(estimate).map(|value| value.to_bits()).collect(),
        };
        self.controller.predict_with(|counts, corrected, force| {
            self.detection.finish_tick(&self.table.thresholds.motor, counts, corrected, force);
        });
        (answer, pulses)
    }
}

#[test]
fn pulses_have_the_bits_of_the_firmware_with_one_two_and_four_links_and_with_a_slow_servo() {
    if !is_there("gcc") {
        return;
    }
    let mut slow = rig_and_table("double-stepper").0.clone();
    slow.actuator.pulses_mut().unwrap().bandwidth_hz = Some(20.0);
    let slow = (slow.clone(), table(&slow));
    let ideal = ["single-stepper", "double-stepper", "quadruple-stepper"].map(rig_and_table);
    for (rig, table) in ideal.into_iter().chain([&slow]) {
        let name = &rig.name;
        let header = c_header(rig, table).unwrap();
        for (law, _) in table.laws.present() {
            let run = recorded_steps(rig, table, &scenario(rig, law, 10_000), nothing);
            assert_eq!((run.fault, run.wanted.len()), (None, 10_000), "{name} {law}");
            let moved = run.wanted.iter().filter(|tick| tick.duty != 0).count();
            assert!(moved > 1000, "{name} {law}: {moved} ticks with pulses");
            for dialect in [STRICT, super::HOSTILE, super::ARDUINO] {
                let answers = replayed(&header, dialect, &run.input);
                let first = first_difference(&run, &answers);
                assert_eq!(differing(&run, &answers), 0, "{name} {law} {dialect:?} {first}");
            }
        }
    }
}

#[test]
fn a_speed_limit_that_is_left_out_and_a_pulse_that_is_lost_are_noticed() {
    if !is_there("gcc") {
        return;
    }
    let (rig, table) = rig_and_table("single-stepper");
    let header = c_header(rig, table).unwrap();
    let run = recorded_steps(rig, table, &scenario(rig, Law::Lqr, 2000), nothing);
    let forgetful = header.replace("    c->emitted = target;\n", "    c->emitted = target + (pulses > 0);\n");
    assert_ne!(forgetful, header);
    assert!(differing(&run, &replayed(&forgetful, STRICT, &run.input)) > 100);
    // A drive that is hardly fast enough for the step of the set-point.
    let mut slow = table.clone();
    let steps = *slow.drive.pulses().unwrap();
    slow.drive = DriveMap::Pulses(StepMap { speed_limit_m_per_s: 0.03, ..steps });
    let header = c_header(rig, &slow).unwrap();
    let run = recorded_steps(rig, &slow, &scenario(rig, Law::Lqr, 2000), nothing);
    assert_eq!(differing(&run, &replayed(&header, STRICT, &run.input)), 0);
    let unlimited = header.replace("if (within == next)", "if (true)");
    assert_ne!(unlimited, header);
    assert!(differing(&run, &replayed(&unlimited, STRICT, &run.input)) > 0, "{:?}", run.fault);
}

#[test]
fn faults_of_a_stepper_end_the_law_in_the_tick_of_the_firmware() {
    if !is_there("gcc") {
        return;
    }
    let (rig, table) = rig_and_table("single-stepper");
    let header = c_header(rig, table).unwrap();
    let defects: [(Disturbance, &[Fault]); 4] = [
        // The link's counter stands still.
        (
            |tick, _, raw| {
                if tick >= 500 {
                    raw[1] = 5
                }
            },
            &[Fault::Encoder, Fault::Frozen],
        ),
        // A pulse is counted that was not given, again and again.
        (
            |tick, _, raw| {
                if tick >= 500 {
                    raw[0] = raw[0].wrapping_add(tick as u32)
                }
            },
            &[Fault::Encoder],
        ),
        // Somebody pulls the link over.
        (
            |tick, bench, _| {
                if tick >= 500 {
                    bench.pull(0.0, &[0.3])
                }
            },
            &[Fault::Angle, Fault::Motor, Fault::Encoder],
        ),
        // The drive is off: the motor's test finds it, by the link.
        (
            |tick, bench, _| {
                if tick >= 500 {
                    bench.spoil(StepDefect::Off)
                }
            },
            &[Fault::Motor],
        ),
    ];
    for (number, (defect, expected)) in defects.into_iter().enumerate() {
        let run = recorded_steps(rig, table, &scenario(rig, Law::Lqr, 3000), defect);
        assert!(run.fault.is_some_and(|fault| expected.contains(&fault)), "{number}: {:?}", run.fault);
        assert!(run.wanted.len() > 500, "{number}");
        let answers = replayed(&header, STRICT, &run.input);
        assert_eq!(differing(&run, &answers), 0, "{number} {}", first_difference(&run, &answers));
        // The negative control: with the motor's test at the cart, whose count shows nothing.
        if expected == [Fault::Motor] {
            let at_cart = header.replace("UPRIGHT_MOTOR_SENSOR 1", "UPRIGHT_MOTOR_SENSOR 0");
            assert!(differing(&run, &replayed(&at_cart, STRICT, &run.input)) > 0);
        }
    }
}

/// What the controller in C is told of a defect, in every tick from then on: see `replay.c`.
const TRIP: u32 = 64;
const TRIP_AT_SWITCH: u32 = 128;

/// A run of the whole firmware, with a defect that the controller in C hears of by `action`, and its answers. It comes
/// when the cart is fastest.
fn stopped(name: &'static str, defect: Defect, action: u32) -> (FirmwareRun, Vec<ControllerTick>) {
    let (rig, table) = rig_and_table(name);
    let mut scenario = scenario(rig, Law::Lqr, 300);
    // The cart has to catch the link.
    scenario.start[2] = 0.4 * f64::from(table.limits.arm_angle_rad);
    let speed = |tick: &ControllerTick| f32::from_bits(tick.values[4]).abs();
    let healthy = recorded(rig, table, &scenario, None).wanted;
    let fastest = (3..100).max_by(|&a, &b| speed(&healthy[a]).total_cmp(&speed(&healthy[b]))).unwrap();
    let mut run = recorded(rig, table, &scenario, Some((fastest, defect)));
    for row in &mut run.input[run.first + fastest..] {
        row[0] |= action;
    }
    let program = Program::that_replays(&c_header(rig, table).unwrap(), STRICT);
    // The hand lets go, and the record begins, when telemetry says so: some ticks after the law has begun.
    let begun = |early: usize| {
        let mut run = run.clone();
        let armed = run.input.iter().position(|row| row[0] & 4 != 0).unwrap();
        run.input[armed][0] &= !4;
        run.input[armed - early..armed].iter_mut().for_each(|row| row[0] |= 8);
        run.input[armed - early][0] |= 4;
        run.first -= early;
        let answers = program.replayed(&run.input);
        (run, answers)
    };
    let law = |(run, answers): &(FirmwareRun, Vec<ControllerTick>)| {
        let ticks = run.first..run.first + fastest;
        ticks.into_iter().all(|tick| answers[tick].duty == command(&run.outputs[tick]))
    };
    (0..4).map(begun).find(law).unwrap_or_else(|| panic!("{name}: the law has other pulses"))
}

#[test]
fn after_a_fault_a_steppers_cart_is_braked_with_the_pulses_of_the_whole_firmware() {
    if !is_there("gcc") {
        return;
    }
    let defects: [(Defect, u32, Fault, bool); 3] = [
        (|pins, _| pins.raw_counts[1] = pins.raw_counts[1].wrapping_add(700), 0, Fault::Encoder, true),
        (|pins, _| pins.contacts.limit_high = true, TRIP_AT_SWITCH, Fault::LimitSwitch, true),
        (|pins, _| pins.contacts.emergency_stop = true, TRIP, Fault::EmergencyStop, false),
    ];
    for (defect, action, fault, brakes) in defects {
        for name in ["single-stepper", "quadruple-stepper"] {
            let (run, answers) = stopped(name, defect, action);
            assert_eq!(run.fault, Some(fault), "{name}");
            let wanted: Vec<i32> = run.outputs.iter().map(|output| command(output) as i32).collect();
            let found: Vec<i32> = answers.iter().map(|tick| tick.duty as i32).collect();
            let balances = run.first;
            assert_eq!(found[balances..], wanted[balances..], "{name} {fault}");
            let on = run.outputs.iter().zip(&answers).skip(balances);
            assert!(on.clone().all(|(output, tick)| output.enable == tick.is_on), "{name} {fault}");
            let from = answers.iter().position(|tick| tick.state == FAULT).unwrap();
            let wanted = &wanted[from..];
            let braking = wanted.iter().filter(|pulses| **pulses != 0).count();
            println!("{name} {fault}: {:?}", &wanted[..braking]);
            assert_eq!(braking > 0, brakes, "{name} {fault}: {wanted:?}");
            assert!(answers[from..].iter().all(|tick| tick.state == FAULT), "{name} {fault}");
        }
    }
}
