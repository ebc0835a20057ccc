//! What has to hold after every tick, whatever was sent. It is derived from the inputs and the replies alone, not with
//! the firmware's own functions: a condition that the firmware forgets is still checked here.

use std::collections::VecDeque;

use crate::gains::{SENSORS, STATES, TABLE};
use upright::board::Output;
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request, Telemetry};
use upright::supervision::fault::{Cause, Fault};
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;

use crate::simulated_rig::{SHAKING, SimulatedRig, Tested};

/// What was known before a tick.
pub(crate) struct Invariants {
    state: State,
    cause: Option<Cause>,
    tick: u32,
    /// Counts of the last ticks with the motor off.
    counts: VecDeque<[i32; SENSORS]>,
    /// Tick in which arming was last refused because of a latched fault, or soon after one.
    arm_held_at: Option<u32>,
    /// Largest force while the rig is shaken (N).
    largest_input: f32,
}

/// Arming needs this many slow ticks.
const SLOW_TICKS: usize = TABLE.limits.arm_ticks as usize / 4;

impl Invariants {
    pub(crate) fn new(firmware: &Tested) -> Self {
        let (state, cause) = (firmware.state(), firmware.cause());
        Self {
            state,
            cause,
            tick: 0,
            counts: VecDeque::new(),
            arm_held_at: None,
            largest_input: SHAKING.largest_input,
        }
    }

    /// Checks a tick; `answered` is the request that was answered in it, with the answer.
    pub(crate) fn check(
        &mut self,
        firmware: &Tested,
        rig: &SimulatedRig,
        answered: Option<&(Request, Answer)>,
    ) {
        self.tick += 1;
        // In the tick of a disarm command, the motor was still on when the counts were read.
        if self.state == State::Balancing {
            self.counts.clear();
        } else {
            self.counts.push_back(*firmware.controller().encoders().counts());
        }
        if self.counts.len() > SLOW_TICKS {
            self.counts.pop_front();
        }
        self.motor(firmware, rig, answered);
        setpoint(firmware, answered);
        self.first_cause(firmware, answered);
        self.arming(firmware, rig, answered);
        (self.state, self.cause) = (firmware.state(), firmware.cause());
    }

    /// The motor is on only while balancing, driving or shaking, within its limits, and off in the tick of a fault or
    /// after a disarm.
    fn motor(&self, firmware: &Tested, rig: &SimulatedRig, answered: Option<&(Request, Answer)>) {
        let (before, after) = (self.state, firmware.state());
        let Output { enable, duty, drive } = rig.output;
        assert!(duty.abs() <= 1.0 && (enable || duty == 0.0), "{duty}");
        match drive {
            Drive::Force(force) => {
                assert!(force.is_finite() && force.abs() <= TABLE.drive.largest_force_n(), "{force}")
            }
            Drive::Duty(duty) => assert!(duty.is_finite() && duty.abs() <= 1.0, "{duty}"),
            Drive::Steps(_) => panic!("pulses for a motor"),
        }
        let disarmed = matches!(answered, Some((Request::Disarm, Answer::Done)));
        if enable && before == State::Jogging {
            let most = TABLE.limits.jog_force_n;
            assert!(matches!(drive, Drive::Force(force) if force.abs() <= most), "{drive:?}");
        }
        if enable && before == State::Identifying {
            assert!(
                matches!(drive, Drive::Force(force) if force.abs() <= self.largest_input),
                "shaken with {drive:?}, at most {} N are asked for",
                self.largest_input
            );
        }
        if enable {
            let may = [State::Jogging, State::Identifying, State::Armed, State::Balancing, State::Stilling];
            assert!(may.contains(&before), "motor on after {before:?}");
            // Found in the second half of the tick; the motor is off from the next one.
            let late =
                firmware.cause().is_some_and(|cause| matches!(cause.fault, Fault::LinkLost | Fault::Table));
            let goes_on =
                matches!(after, State::Jogging | State::Identifying | State::Balancing | State::Stilling);
            assert!(goes_on || disarmed || late, "motor on in {after:?}");
            let contacts = rig.contacts;
            assert!(!contacts.emergency_stop && !contacts.driver_fault);
            assert!(!contacts.clock_fault && !contacts.board_fault);
            assert!(!contacts.limit_low && !contacts.limit_high && rig.supply_v.is_finite());
        } else {
            assert_eq!(drive, Drive::OFF);
            assert_ne!(after, State::Balancing, "balancing with the motor off");
        }
        let on = [
            State::Jogging,
            State::Identifying,
            State::Armed,
            State::Balancing,
            State::Homing,
            State::Stilling,
        ];
        let is_off = !on.contains(&after);
        assert!(!disarmed || is_off, "{after:?}");
    }

    /// The first cause of a fault stays until it is cleared.
    fn first_cause(&self, firmware: &Tested, answered: Option<&(Request, Answer)>) {
        let cleared = matches!(answered, Some((Request::Clear, Answer::Done)));
        if self.state == State::Fault && !cleared {
            assert_eq!((firmware.state(), firmware.cause()), (State::Fault, self.cause));
        }
        assert!(firmware.state() != State::Fault || firmware.cause().is_some());
    }

    /// Nothing but a command arms, and only when no inhibit holds.
    fn arming(&mut self, firmware: &Tested, rig: &SimulatedRig, answered: Option<&(Request, Answer)>) {
        match answered {
            Some((Request::Arm, Answer::Done)) => self.no_inhibit(firmware, rig),
            Some((Request::Arm, _)) => {
                let locked = self.arm_held_at.is_some_and(|at| self.tick - at < TABLE.limits.still_ticks);
                if locked || firmware.state() == State::Fault {
                    self.arm_held_at = Some(self.tick);
                }
            }
            Some((Request::Jog { .. }, Answer::Done)) if self.state != State::Jogging => {
                assert!(
                    matches!(self.state, State::Calibrated | State::Homing),
                    "driven in {:?}",
                    self.state
                );
                self.nothing_against_jogging(firmware, rig);
            }
            Some((Request::Shake(shaking), Answer::Done)) => {
                self.largest_input = shaking.largest_input;
                assert!(
                    matches!(self.state, State::Calibrated | State::Homing),
                    "shaken in {:?}",
                    self.state
                );
                assert_eq!(firmware.motor_sign(), MotorSign::Checked);
                self.nothing_against_jogging(firmware, rig);
            }
            _ => assert!(firmware.state() != State::Armed || self.state == State::Armed, "armed unasked"),
        }
        assert!(
            firmware.state() != State::Balancing || matches!(self.state, State::Armed | State::Balancing),
            "balancing without having been armed"
        );
    }

    /// The links hang, the cart is on its rail, and all contacts are closed.
    fn nothing_against_jogging(&self, firmware: &Tested, rig: &SimulatedRig) {
        let limits = &TABLE.limits;
        assert_eq!(firmware.calibration().signs(), Signs::Checked);
        let contacts = rig.contacts;
        assert!(!contacts.limit_low && !contacts.limit_high, "driven on a limit switch");
        assert!(!contacts.emergency_stop && !contacts.driver_fault);
        assert!(!contacts.clock_fault && !contacts.board_fault);
        assert!(rig.supply_v >= limits.supply_min_v && rig.supply_v.is_finite(), "driven without supply");
        let Some(counts) = self.counts.back() else { panic!("a tick has counts") };
        for (sensor, &count) in counts.iter().enumerate().skip(1) {
            let row = &TABLE.sensors[sensor];
            let turn = i64::from(row.turn_counts);
            let from_rest = i64::from(count) - i64::from(row.rest_counts);
            let away = from_rest.rem_euclid(turn).min((-from_rest).rem_euclid(turn));
            assert!(away <= i64::from(row.sign_counts) / 2 + 1, "driven while a link does not hang");
        }
    }

    fn no_inhibit(&self, firmware: &Tested, rig: &SimulatedRig) {
        let limits = &TABLE.limits;
        assert!(matches!(self.state, State::Calibrated | State::Homing), "armed in {:?}", self.state);
        assert_eq!(firmware.calibration().signs(), Signs::Checked);
        assert_eq!(firmware.motor_sign(), MotorSign::Checked);
        let contacts = rig.contacts;
        assert!(!contacts.limit_low && !contacts.limit_high, "armed on a limit switch");
        assert!(!contacts.emergency_stop && !contacts.driver_fault);
        assert!(!contacts.clock_fault && !contacts.board_fault);
        assert!(rig.supply_v >= limits.supply_min_v && rig.supply_v.is_finite(), "armed without supply");
        let Some(counts) = self.counts.back() else { panic!("a tick has counts") };
        let position_m = TABLE.sensors[0].step * counts[0] as f32;
        let [low, high] = limits.setpoints_m();
        assert!((low..=high).contains(&position_m), "armed off centre");
        let mut angle = 0.0;
        for (&count, sensor) in counts.iter().zip(&TABLE.sensors).skip(1) {
            let turn = f64::from(sensor.turn_counts);
            let nearest = (f64::from(count) / turn).round() * turn;
            angle += sensor.step * (f64::from(count) - nearest) as f32;
            assert!(angle.abs() <= limits.arm_angle_rad * 1.0001, "armed while tilted");
        }
        for sensor in 0..SENSORS {
            let all = || self.counts.iter().map(|counts| counts[sensor]);
            let (least, most) = (all().min().unwrap_or_default(), all().max().unwrap_or_default());
            assert!(most.wrapping_sub(least) <= 2 * TABLE.sensors[sensor].slow_counts, "armed while moving");
        }
        let held = self.arm_held_at.is_some_and(|at| self.tick - at < limits.still_ticks);
        assert!(!held, "armed by a command that was held since the fault");
    }
}

/// An accepted set-point is finite and far enough from the ends of the rail, and the one that the law follows is on it.
fn setpoint(firmware: &Tested, answered: Option<&(Request, Answer)>) {
    let [low, high] = TABLE.limits.setpoints_m();
    if let Some((Request::Setpoint(wanted), answer)) = answered {
        let good = (low..=high).contains(wanted);
        assert_eq!(*answer == Answer::Done, good, "set-point {wanted}: {answer:?}");
    }
    let ([low, high], controller) = (TABLE.limits.rail_m, firmware.controller());
    for setpoint in [controller.setpoint(), controller.law_state().setpoint] {
        assert!((low..=high).contains(&setpoint), "set-point {setpoint}");
    }
}

/// All numbers of a telemetry message are finite, and the force is within its limit.
pub(crate) fn telemetry(telemetry: &Telemetry<STATES, SENSORS>) {
    let vectors = telemetry.estimate.iter().chain(&telemetry.innovation);
    let numbers = [telemetry.setpoint_m, telemetry.requested_n, telemetry.applied_n, telemetry.drive];
    assert!(vectors.chain(&numbers).all(|number| number.is_finite()), "{telemetry:?}");
    assert!(telemetry.applied_n.abs() <= TABLE.drive.largest_force_n(), "{telemetry:?}");
}
