//! The whole firmware with a drive that takes pulses: homing by the switches, jog, balancing, faults and stops.

use core::f64::consts::PI;

use upright::board::Output;
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::homing::Homing;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::client::AnyTelemetry;
use upright_closed_loop::harness::{RailEnds, World, record, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, StepDefect};
use upright_trust::verify::linear;

use crate::published::{certified, rig, table};
use crate::supervised::{balancing, cause, tick};

const STEPPERS: [&str; 3] = ["single-stepper", "double-stepper", "quadruple-stepper"];

/// The single stepper with a motor behind its pulses, which lets go of the cart when it is off.
fn with_motor() -> Rig {
    let mut rig = rig("single-stepper");
    rig.chain_mut().unwrap().cart.mass_kg = Some(0.3);
    let motor = &mut rig.reality.step_motor;
    (motor.holding_force_n, motor.full_step_m) = (Some(60.0), Some(2e-4));
    rig
}

fn leaning(rig: &Rig) -> Scenario {
    let mut scenario = Scenario::at_rest(rig, Law::Lqr);
    scenario.start[2] = 0.01;
    scenario
}

#[test]
fn every_stepper_is_homed_jogged_and_balanced_and_follows_its_set_point() {
    for name in STEPPERS {
        let rig = rig(name);
        let values = table(&rig);
        let scenario = Scenario { duration_s: 10.0, step_m: 0.05, step_at_s: 2.0, ..leaning(&rig) };
        let scenario = Scenario { start: vec![0.0; scenario.start.len()], ..scenario };
        let run = with_firmware(&values, |firmware| record(&rig, &values, &scenario, firmware));
        let run = run.unwrap().unwrap();
        assert!(run.fault.is_none() && run.summary.survives(), "{name}: {:?} {}", run.fault, run.summary);
        // The cart moves back and forth by what the steps of the encoders add.
        let last: Vec<f64> =
            run.trace.samples().filter(|sample| sample.t > 6.0).map(|sample| sample.state[0]).collect();
        let cart_m = last.iter().sum::<f64>() / last.len() as f64;
        assert!((cart_m - 0.05).abs() < 0.02, "{name}: {cart_m}");
        // Each tick's estimate stands beside the state of this tick, and not of one after it.
        let samples: Vec<_> = run.trace.samples().collect();
        let off_m = |late: usize| -> f64 {
            samples.windows(2).map(|pair| (pair[1 - late].estimate[0] - pair[1].state[0]).abs()).sum()
        };
        assert!(off_m(0) < 0.5 * off_m(1), "{name}: {} and {}", off_m(0), off_m(1));
        let moves = |tick: &&upright_closed_loop::harness::FirmwareTick| tick.output.pulses() != 0;
        assert!(run.ticks.iter().filter(moves).count() > 100, "{name}");
    }
}

/// A hanging rig that nobody holds, with switches at the ends of its rail.
struct Free<'h, 't> {
    world: &'h mut World<'t>,
    ends: RailEnds,
    /// Whether the motor turns the wrong way.
    is_reversed: bool,
    has_switches: bool,
    emergency_stop: bool,
    telemetry: Option<AnyTelemetry>,
}

impl Free<'_, '_> {
    fn tick(&mut self) -> Output {
        let mut inputs = self.world.inputs();
        if self.has_switches {
            self.ends.press(self.world.bench.state()[0], &mut inputs.contacts);
        }
        if self.is_reversed {
            inputs.raw_counts[0] = inputs.raw_counts[0].wrapping_neg();
        }
        inputs.contacts.emergency_stop = self.emergency_stop;
        let output = self.world.session.tick(&inputs).unwrap();
        while let Some(telemetry) = self.world.session.next_telemetry() {
            self.telemetry = Some(telemetry);
        }
        self.world.bench.tick(match output.drive {
            Drive::Steps(pulses) if self.is_reversed => Drive::Steps(-pulses),
            drive => drive,
        });
        output
    }

    fn ask(&mut self, request: Request) -> Answer {
        let id = self.world.session.send(request);
        for _ in 0..10 {
            self.tick();
            while let Some((answered, answer)) = self.world.session.next_reply() {
                if answered == id {
                    return answer;
                }
            }
        }
        panic!("no answer to {request:?}")
    }

    fn telemetry(&self) -> &AnyTelemetry {
        self.telemetry.as_ref().unwrap()
    }

    fn cart_m(&self) -> f64 {
        self.world.bench.state()[0]
    }

    /// Homes by the switches; returns the time it takes (s).
    fn home(&mut self) -> f64 {
        assert_eq!(self.ask(Request::HomeRail), Answer::Done);
        let period_s = self.world.bench.period_s();
        for tick in 0..6000 {
            self.tick();
            if !matches!(self.telemetry().homing, Homing::Touch { .. } | Homing::HoldStill) {
                return f64::from(tick) * period_s;
            }
        }
        panic!("homing does not end")
    }
}

/// Lets a person do something with the hanging rig, whose cart is at `cart_m`.
fn hanging<R>(rig: &Rig, cart_m: f64, action: impl FnOnce(&mut Free<'_, '_>) -> R) -> R {
    let values = table(rig);
    with_firmware(&values, |target| {
        let mut world = World::new(rig, &values, &Scenario::at_rest(rig, Law::Lqr), target).unwrap();
        let mut start = vec![0.0; rig.states()];
        (start[0], start[2]) = (cart_m, PI);
        world.bench.hold(&start);
        action(&mut Free {
            world: &mut world,
            ends: RailEnds::of(rig),
            is_reversed: false,
            has_switches: true,
            emergency_stop: false,
            telemetry: None,
        })
    })
    .unwrap()
}

#[test]
fn the_drive_finds_both_switches_and_the_middle_between_them() {
    for rig in [rig("single-stepper"), with_motor()] {
        for cart_m in [-0.1, 0.05] {
            hanging(&rig, cart_m, |free| {
                let took_s = free.home();
                for _ in 0..10 {
                    free.tick();
                }
                let telemetry = free.telemetry();
                assert_eq!((telemetry.homing, telemetry.state), (Homing::Homed, State::Calibrated));
                let counted_m = f64::from(telemetry.counts[0]) * 5e-5;
                println!("from {cart_m}: {took_s} s, at {} m, counted {counted_m}", free.cart_m());
                assert!((counted_m - free.cart_m()).abs() < 1e-3 && free.cart_m().abs() < 2e-3);
                assert!(free.tick().enable, "it holds the cart");
            });
        }
    }
}

#[test]
fn homing_ends_where_a_switch_should_have_been() {
    for (is_reversed, has_switches) in [(true, true), (false, false), (true, false)] {
        hanging(&rig("single-stepper"), 0.0, |free| {
            (free.is_reversed, free.has_switches) = (is_reversed, has_switches);
            let took_s = free.home();
            println!("reversed {is_reversed}, switches {has_switches}: {took_s} s");
            for _ in 0..10 {
                free.tick();
            }
            assert_eq!(
                (free.telemetry().homing, free.telemetry().state),
                (Homing::WrongTravel, State::Disarmed)
            );
            assert!(!free.tick().enable);
            assert!(took_s < if has_switches { 4.0 } else { 8.0 }, "{took_s}");
        });
    }
    // A drive does not start on a switch.
    hanging(&rig("single-stepper"), 0.171, |free| {
        assert_eq!(free.ask(Request::HomeRail), Answer::NotNow(Inhibits::LIMIT_SWITCH));
    });
}

/// The motor's sign after a jog of the homed rig.
fn jogged(rig: &Rig, is_reversed: bool, along: bool) -> MotorSign {
    hanging(rig, 0.0, |free| {
        free.is_reversed = is_reversed;
        for _ in 0..200 {
            free.tick();
        }
        assert_eq!(free.ask(Request::Home), Answer::Done);
        // Its encoders are known: a person turns each of them.
        sign_check(free, rig);
        for tick in 0..200 {
            if tick % 5 == 0 {
                free.world.session.send(Request::Jog { along });
            }
            free.tick();
            if free.telemetry().motor != MotorSign::Unchecked {
                break;
            }
        }
        let _ = free.ask(Request::Arm);
        free.telemetry().motor
    })
}

/// Turns the only link and lets it hang again.
fn sign_check(free: &mut Free<'_, '_>, rig: &Rig) {
    assert_eq!(free.ask(Request::CheckSigns), Answer::Done);
    let mut state = vec![0.0; rig.states()];
    for angle in [0.3, 0.0] {
        for _ in 0..200 {
            state[2] = PI + angle;
            free.world.bench.hold(&state);
            free.tick();
            free.world.bench.hold(&state);
        }
    }
}

#[test]
fn the_link_shows_in_which_direction_the_drive_moves_the_cart() {
    let rig = rig("single-stepper");
    for along in [true, false] {
        assert_eq!(jogged(&rig, false, along), MotorSign::Checked);
        assert_eq!(jogged(&rig, true, along), MotorSign::Reversed);
    }
}

#[test]
fn disarming_lets_go_of_the_cart_and_loses_its_position() {
    hanging(&rig("single-stepper"), 0.0, |free| {
        for _ in 0..200 {
            assert!(!free.tick().enable, "not homed, not held");
        }
        assert_eq!(free.ask(Request::Home), Answer::Done);
        assert!(free.tick().enable);
        assert_eq!(free.ask(Request::Disarm), Answer::Done);
        assert!(!free.tick().enable);
        assert_eq!((free.telemetry().state, free.telemetry().homing), (State::Disarmed, Homing::NotHomed));
        let Answer::NotNow(inhibits) = free.ask(Request::Arm) else { panic!("armed") };
        assert!(inhibits.contains(Inhibits::NOT_HOMED));
    });
}

/// The pulses after a fault, tick by tick, until the drive is off, and its cause.
fn stopped(fault: Fault) -> (Vec<i32>, Option<Fault>) {
    let rig = rig("quadruple-stepper");
    let scenario = Scenario { start: vec![0.0; rig.states()], ..leaning(&rig) };
    balancing(&rig, &table(&rig), &scenario, |world| {
        world.session.send(Request::Setpoint(0.1));
        let is_fast = (0..3000).any(|number| {
            if number % 50 == 49 {
                world.session.send(Request::KeepAlive);
            }
            tick(world);
            world.bench.state()[1].abs() > 0.1
        });
        assert!(is_fast);
        let mut pulses = Vec::new();
        for _ in 0..100 {
            let mut inputs = world.inputs();
            inputs.contacts.limit_high = fault == Fault::LimitSwitch;
            inputs.contacts.emergency_stop = fault == Fault::EmergencyStop;
            inputs.contacts.driver_fault = fault == Fault::Driver;
            let output = world.session.tick(&inputs).unwrap();
            if !output.enable {
                break;
            }
            pulses.push(output.pulses());
            world.bench.tick(output.drive);
        }
        (pulses, cause(world).map(|cause| cause.fault))
    })
    .unwrap()
}

#[test]
fn a_fault_of_the_rig_brings_the_cart_to_rest_and_a_fault_of_the_drive_cuts_it() {
    for fault in [Fault::EmergencyStop, Fault::Driver] {
        assert_eq!(stopped(fault), (Vec::new(), Some(fault)));
    }
    let (pulses, fault) = stopped(Fault::LimitSwitch);
    assert_eq!(fault, Some(Fault::LimitSwitch));
    // 0.1 m/s at 25 m/s²: 4 ms and 0.2 mm, which are 16 pulses of 12.5 µm.
    println!("{pulses:?}");
    let sum: i32 = pulses.iter().sum();
    assert!((3..=6).contains(&pulses.len()) && (12..28).contains(&sum.abs()), "{pulses:?}");
    // 2 pulses fewer in each tick; whole pulses may move one of them to the next.
    assert!(
        pulses
            .windows(2)
            .all(|pair| (1..=3).contains(&(pair[0].abs() - pair[1].abs())) || pair[0].abs() <= 1),
        "{pulses:?}"
    );
}

#[test]
fn the_share_of_its_pulses_that_a_drive_may_miss_is_the_gain_margin() {
    let rig = rig("quadruple-stepper");
    let values = table(&rig);
    let linear = linear(&rig, certified(&rig), &values).unwrap();
    let lqr = linear.iter().find(|report| report.law == Law::Lqr).unwrap();
    assert!(lqr.stable && lqr.spectral_radius > 0.9, "{}", lqr.spectral_radius);
    let gain = lqr.margins.as_ref().unwrap().lowest_gain;
    println!("spectral radius {}, lowest gain {gain}", lqr.spectral_radius);
    let untested = values.without_tests();
    let stands = |gain: f64| {
        let scenario = Scenario { torque_noise_n_m: 1e-5, ..leaning(&rig) };
        balancing(&rig, &untested, &scenario, |world| {
            (0..4000).all(|_| {
                let inputs = world.inputs();
                let output = world.session.tick(&inputs).unwrap();
                world.bench.spoil(StepDefect::Misses(1.0 - gain));
                world.bench.tick(output.drive);
                world.session.fault().is_none()
            })
        })
        .unwrap()
    };
    assert!(stands(1.0) && stands(0.5 * (1.0 + gain)));
    assert!(!stands(0.85 * gain), "negative control");
}

/// The fault of a balancing rig whose drive has a defect from 200 ticks on, or whose board then counts so many pulses
/// too many; the ticks it takes, and the largest lean.
fn found(rig: &Rig, defect: Option<StepDefect>, off_by: u32, seed: u64) -> (Option<Fault>, u32, f64) {
    let expected = (rig.kalman.as_ref().unwrap().joint_noise[0] / rig.tick.period_s).sqrt();
    let scenario = Scenario { seed, torque_noise_n_m: expected.min(1e-4), ..leaning(rig) };
    balancing(rig, &table(rig), &scenario, |world| {
        let mut lean = 0.0f64;
        for number in 0..4000 {
            let mut inputs = world.inputs();
            let since = u32::checked_sub(number, 200);
            if since.is_some() {
                inputs.raw_counts[0] = inputs.raw_counts[0].wrapping_add(off_by);
                lean = lean.max(world.bench.state()[2].abs());
            }
            let output = world.session.tick(&inputs).unwrap();
            if let Some(fault) = world.session.fault() {
                return (Some(fault), since.unwrap_or_default(), lean);
            }
            if let (Some(_), Some(defect)) = (since, defect) {
                world.bench.spoil(defect);
            }
            world.bench.tick(output.drive);
        }
        (None, 3800, lean)
    })
    .unwrap()
}

#[test]
fn a_drive_that_is_off_is_found_by_the_link_and_a_wrong_count_by_the_pulses_that_were_commanded() {
    let rigs = [rig("single-stepper"), with_motor(), rig("double-stepper"), rig("quadruple-stepper")];
    for (rig, [dead_ticks, weak_ticks]) in rigs.into_iter().zip([[75, 75], [75, 75], [40, 40], [25, 35]]) {
        assert_eq!(found(&rig, None, 0, 1).0, None, "negative control");
        let defects = [
            (StepDefect::Off, dead_ticks),
            (StepDefect::Jammed, dead_ticks),
            (StepDefect::Misses(0.75), weak_ticks),
        ];
        for (defect, most_ticks) in defects {
            for seed in 0..2 {
                let (fault, ticks, lean) = found(&rig, Some(defect), 0, seed);
                println!("{} {defect:?}: {fault:?} after {ticks} ticks at {lean} rad", rig.name);
                assert!(fault.is_some() && ticks <= most_ticks && lean < 0.05, "{fault:?} {ticks} {lean}");
            }
        }
    }
    // A link that needs little of the drive does not show that a quarter of the pulses is missing.
    assert_eq!(found(&rig("single-stepper"), Some(StepDefect::Misses(0.25)), 0, 0).0, None);
    let rig = rig("single-stepper");
    // The board has counted four pulses too many: 0.2 mm.
    let (fault, ticks, _) = found(&rig, None, 4, 1);
    assert!(fault == Some(Fault::Encoder) && ticks <= 5, "{fault:?} {ticks}");
}
