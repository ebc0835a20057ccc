//! Fault detection by the innovation: do encoders and motor behave as the model says?
//!
//! Three tests run in every tick of balancing and of a planned motion. `upright design` computes all thresholds from
//! the covariance of the Kalman filter and a stated rate of false alarms.
//!
//! - *Plausible*: `|e_i|` within its threshold. A measurement beyond it is rejected (the prediction takes its place)
//!   and counted; the third in a row is a fault: of the encoder if no other measurement of the tick is rejected, else
//!   of the motor, because a wrong force moves all of them.
//! - *Not frozen*: while a counter stands still, the motion that the model predicts for it stays small. The predicted
//!   motion is summed with a memory of [`MEMORY`] ticks, so that a small constant model error raises no alarm.
//! - *Motor*: the innovation of the cart is compared with the one that a missing force `-u` would cause. Their ratio,
//!   by least squares with the same memory, is 0 for a healthy motor, 1 for a dead one and 2 for a reversed one. For a
//!   drive with pulses, whose count shows nothing, it is the innovation of the first link and a missing acceleration.
//!
//! While a rig balances with a force, a hand may push it. Then [`pushes`](crate::supervision::pushes) tests the
//! encoders instead, and the missing force also has to explain nearly all of the innovation, which a hand's force does
//! not: for a dead motor with a memory of [`LONG_MEMORY`] ticks, and with the short one for a motor that is stuck, of
//! which about twice the force is missing.

use crate::supervision::fault::Fault;
use crate::supervision::finding::{Finding, IN_A_ROW};
use crate::supervision::pushes::{PushFindings, Pushes};
use crate::table::{MotorTest, Thresholds};

/// Memory of the sums (ticks): each tick keeps `1 - 1/MEMORY` of them.
pub const MEMORY: f32 = 16.0;
const KEEP: f32 = 1.0 - 1.0 / MEMORY;
/// Memory of the motor's test while a hand may push (ticks).
pub const LONG_MEMORY: f32 = 256.0;
const KEEP_LONG: f32 = 1.0 - 1.0 / LONG_MEMORY;
/// Least share of the innovation (of its sum of squares) that a missing force then has to explain …
const EXPLAINED: f32 = 0.985;
/// … and that of a motor that is stuck, in the shorter memory.
const STUCK_EXPLAINED: f32 = 0.95;
/// The missing share of a motor that is stuck lies between these.
const STUCK: [f32; 2] = [1.8125, 3.0];

/// State of the tests.
#[derive(Debug, Clone)]
pub struct Detection<const NY: usize> {
    sensors: [SensorMemory; NY],
    pushes: Pushes<NY>,
    /// The sensor of the motor's test: 0, the cart, or 1, the first link.
    motor_sensor: u8,
    /// Error `(p, v)` of predicted position and speed of that sensor (m, m/s) that a missing force would have caused by
    /// now.
    missing: [f32; 2],
    sums: MotorSums,
    /// The same with a longer memory, while a hand may push.
    long: MotorSums,
    /// Whether a hand may push in this tick.
    may_be_pushed: bool,
    /// Innovation for the motor's test in this tick (m or rad).
    motor_error: f32,
    /// What the motor's test has found after the last tick, where a hand may push.
    lacks_force: bool,
    rejected: u32,
}

/// Sums of the motor's test, which forget: `p` is the innovation that a missing force would have caused.
#[derive(Debug, Clone, Copy, Default)]
struct MotorSums {
    /// Sum of `e p` (m²).
    correlation: f32,
    /// Sum of `p²` (m²).
    energy: f32,
    /// Sum of `e²` (m²).
    error: f32,
}

impl MotorSums {
    #[inline(always)]
    fn add(&mut self, keep: f32, e: f32, p: f32) {
        self.correlation = keep * self.correlation + e * p;
        self.energy = keep * self.energy + p * p;
        self.error = keep * self.error + e * e;
    }

    /// Whether there is enough energy for a verdict, and more than the share `ratio` of the force is missing.
    #[inline(always)]
    fn lacks(&self, ratio: f32, energy: f32) -> bool {
        self.energy > energy && self.correlation > ratio * self.energy
    }

    /// Whether a missing force explains at least this share of the innovation.
    #[inline(always)]
    fn is_explained(&self, share: f32) -> bool {
        self.correlation * self.correlation > share * (self.energy * self.error)
    }
}

/// State of the tests of one sensor.
#[derive(Debug, Clone, Copy, Default)]
struct SensorMemory {
    counts: i32,
    /// Corrected estimate of its position in the previous tick (m or rad).
    corrected: f32,
    /// Predicted motion while the counter stands still (m or rad).
    moved: f32,
    /// Implausible measurements in a row.
    implausible: u32,
}

impl<const NY: usize> Default for Detection<NY> {
    fn default() -> Self {
        Self {
            sensors: [SensorMemory::default(); NY],
            pushes: Pushes::default(),
            motor_sensor: 0,
            missing: [0.0; 2],
            sums: MotorSums::default(),
            long: MotorSums::default(),
            may_be_pushed: false,
            motor_error: 0.0,
            lacks_force: false,
            rejected: 0,
        }
    }
}

impl<const NY: usize> Detection<NY> {
    /// Tests that have not begun, with the motor's test at this sensor: [`DriveMap::witness`].
    ///
    /// [`DriveMap::witness`]: crate::table::DriveMap::witness
    pub fn of_motor(sensor: usize) -> Self {
        Self { motor_sensor: sensor as u8, ..Self::default() }
    }

    /// Restarts the tests at positions `y` (m or rad); the number of rejected measurements stays.
    pub fn start(&mut self, counts: &[i32; NY], y: &[f32; NY]) {
        for ((sensor, &counts), &corrected) in self.sensors.iter_mut().zip(counts).zip(y) {
            *sensor = SensorMemory { counts, corrected, ..SensorMemory::default() };
        }
        self.pushes.start();
        (self.sums, self.long) = (MotorSums::default(), MotorSums::default());
        (self.missing, self.motor_error, self.lacks_force) = ([0.0; 2], 0.0, false);
    }

    /// Tests the innovation `e = y - C x̂⁻` of a tick (m or rad); sets that of an implausible measurement to 0.
    ///
    /// If several tests fail in one tick, the result is the first of: implausible, frozen, motor, pushed too hard.
    #[inline(always)]
    pub fn test(
        &mut self,
        thresholds: &Thresholds<NY>,
        counts: &[i32; NY],
        y: &[f32; NY],
        e: &mut [f32; NY],
    ) -> Option<Finding> {
        self.may_be_pushed = thresholds.survives_pushes();
        // The innovation of a rejected measurement is 0: it says nothing about the motor.
        let (found, lacks_force) = if self.may_be_pushed {
            let found = self.pushes.test(thresholds, counts, e);
            // Pushes are for force drives, whose motor the cart shows.
            self.motor_error = e.first().copied().unwrap_or_default();
            (found, self.lacks_force)
        } else {
            let encoder = self.test_sensors(thresholds, counts, y, e);
            // With constant indices, the processor has no bound to check.
            let e_motor = if self.motor_sensor == 0 { e.first() } else { e.get(1) };
            self.motor_error = e_motor.copied().unwrap_or_default();
            self.sums.add(KEEP, self.motor_error, self.missing[0]);
            let lacks_force = self.sums.lacks(thresholds.motor.ratio, thresholds.motor.energy);
            (PushFindings { encoder, push: None }, lacks_force)
        };
        let motor = lacks_force.then_some(Finding { fault: Fault::Motor, sensor: self.motor_sensor });
        found.encoder.or(motor).or(found.push)
    }

    /// Tests the size of each innovation, and the motion of each counter that stands still.
    #[inline(never)]
    fn test_sensors(
        &mut self,
        thresholds: &Thresholds<NY>,
        counts: &[i32; NY],
        y: &[f32; NY],
        e: &mut [f32; NY],
    ) -> Option<Finding> {
        let (mut is_plausible, mut frozen) = (true, None);
        let limits = thresholds.innovation.iter().zip(&thresholds.frozen);
        let measured = counts.iter().zip(y).zip(e.iter());
        // One pass over the sensors for both tests: every value is loaded once.
        for (((memory, ((&counts, y), e)), (&plausible, &still)), sensor) in
            self.sensors.iter_mut().zip(measured).zip(limits).zip(0..)
        {
            if counts == memory.counts {
                // y - e is the predicted position.
                memory.moved = KEEP * memory.moved + (y - *e - memory.corrected);
                if memory.moved.abs() > still {
                    frozen = Some(sensor);
                }
            } else {
                (memory.moved, memory.counts) = (0.0, counts);
            }
            // False for NaN, too.
            is_plausible &= e.abs() <= plausible;
        }
        let implausible = if is_plausible {
            self.sensors.iter_mut().for_each(|memory| memory.implausible = 0);
            None
        } else {
            self.reject(thresholds, e)
        };
        implausible.or(frozen.map(|sensor| Finding { fault: Fault::Frozen, sensor }))
    }

    /// Sets implausible innovations to 0, and counts them.
    #[cold]
    fn reject(&mut self, thresholds: &Thresholds<NY>, e: &mut [f32; NY]) -> Option<Finding> {
        let (mut rejected_now, mut implausible) = (0, None);
        let limits = thresholds.innovation.iter().zip(0..);
        for ((memory, e), (&plausible, sensor)) in self.sensors.iter_mut().zip(e).zip(limits) {
            if e.abs() <= plausible {
                memory.implausible = 0;
                continue;
            }
            *e = 0.0;
            memory.implausible = memory.implausible.saturating_add(1);
            self.rejected = self.rejected.saturating_add(1);
            rejected_now += 1;
            if memory.implausible >= IN_A_ROW && implausible.is_none() {
                implausible = Some(sensor);
            }
        }
        let fault = if rejected_now > 1 { Fault::Motor } else { Fault::Encoder };
        implausible.map(|sensor| Finding { fault, sensor })
    }

    /// Whether most of the force is missing, as with a dead motor, or about twice the force, as with one that is stuck.
    #[inline(never)]
    fn finds_missing_force(&mut self, test: &MotorTest) -> bool {
        let (e, [missing, _]) = (self.motor_error, self.missing);
        self.sums.add(KEEP, e, missing);
        self.long.add(KEEP_LONG, e, missing);
        let [least, most] = STUCK;
        // A steady error of the model adds up with the square root of the memory.
        let dead = self.long.lacks(test.ratio, LONG_MEMORY / MEMORY * test.energy);
        let stuck = self.sums.lacks(least, test.energy) && !self.sums.lacks(most, test.energy);
        (dead && self.long.is_explained(EXPLAINED)) || (stuck && self.sums.is_explained(STUCK_EXPLAINED))
    }

    /// Second half of a tick: stores the corrected estimate of the sensors' positions (m or rad) and the force `u` (N)
    /// that acts during this tick. Where a hand may push, the tests of frozen counters and of the motor are made here,
    /// after the output; a fault of the motor then comes in the next tick.
    #[inline]
    pub fn finish_tick(
        &mut self,
        test: &MotorTest,
        counts: &[i32; NY],
        corrected: &dyn Fn() -> [f32; NY],
        u: f32,
    ) {
        if self.may_be_pushed {
            self.pushes.finish_tick(counts);
            self.lacks_force = self.finds_missing_force(test);
        } else {
            for (sensor, corrected) in self.sensors.iter_mut().zip(corrected()) {
                sensor.corrected = corrected;
            }
        }
        let ([p, v], [pp, pv, vp, vv], [b_p, b_v]) = (self.missing, test.a, test.b);
        self.missing = [pp * p + pv * v - b_p * u, vp * p + vv * v - b_v * u];
    }

    /// What the test for a frozen counter compares: the predicted motion of each sensor while its counter stands still
    /// (m or rad).
    pub fn moved(&self) -> [f32; NY] {
        self.sensors.map(|sensor| sensor.moved)
    }

    /// Counts a measurement that was rejected before the tests.
    pub(crate) fn count_rejected(&mut self) {
        self.rejected = self.rejected.saturating_add(1);
    }

    /// Number of measurements rejected since power-up or the last [`reset_rejected`](Self::reset_rejected).
    pub fn rejected(&self) -> u32 {
        self.rejected.saturating_add(self.pushes.rejected())
    }

    /// Sets the number of rejected measurements to 0.
    pub fn reset_rejected(&mut self) {
        self.rejected = 0;
        self.pushes.reset_rejected();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const THRESHOLDS: Thresholds<2> = Thresholds {
        innovation: [1.0, 1.0],
        frozen: [3.0, 3.0],
        push: [f32::MAX; 2],
        // A filter that follows the measurement at once, and 1 m per newton and tick.
        motor: MotorTest { a: [0.0; 4], b: [1.0, 0.0], ratio: 0.5, energy: 4.0 },
    };

    /// The first finding and its tick, for the innovations `of` each tick and counters that move.
    fn first(of: impl Fn(i32) -> [f32; 2]) -> Option<(i32, Finding)> {
        let mut detection = Detection::default();
        detection.start(&[0; 2], &[0.0; 2]);
        (1..100).find_map(|tick| {
            let found = detection.test(&THRESHOLDS, &[tick; 2], &[tick as f32; 2], &mut of(tick));
            detection.finish_tick(&THRESHOLDS.motor, &[tick; 2], &|| [tick as f32; 2], 0.0);
            found.map(|finding| (tick, finding))
        })
    }

    fn finding(fault: Fault, sensor: u8) -> Finding {
        Finding { fault, sensor }
    }

    #[test]
    fn the_third_implausible_measurement_in_a_row_is_a_fault_and_two_are_not() {
        assert_eq!(first(|_| [0.9, -0.9]), None);
        assert_eq!(first(|tick| [0.0, if tick % 3 == 0 { 0.0 } else { 5.0 }]), None);
        let from_20 = |tick: i32| if tick >= 20 { -1.1 } else { 0.0 };
        assert_eq!(first(|tick| [0.0, from_20(tick)]), Some((22, finding(Fault::Encoder, 1))));
        assert_eq!(first(|tick| [from_20(tick), 0.0]), Some((22, finding(Fault::Encoder, 0))));
        assert_eq!(first(|tick| [from_20(tick), from_20(tick)]), Some((22, finding(Fault::Motor, 0))));
        assert_eq!(
            first(|tick| [f32::NAN, f32::from(tick as i16) * 0.0]),
            Some((3, finding(Fault::Encoder, 0)))
        );
    }

    #[test]
    fn a_rejected_measurement_has_no_innovation_and_is_counted() {
        let mut detection = Detection::<2>::default();
        let mut e = [7.0, 0.5];
        assert_eq!(detection.test(&THRESHOLDS, &[7, 1], &[7.0, 1.0], &mut e), None);
        assert_eq!((e, detection.rejected()), ([0.0, 0.5], 1));
        detection.start(&[0; 2], &[0.0; 2]);
        assert_eq!(detection.rejected(), 1, "a new start does not forget it");
        detection.reset_rejected();
        assert_eq!(detection.rejected(), 0);
    }

    /// The finding and its tick, for a second counter that stands still while the model moves it by `per_tick`.
    fn frozen(per_tick: f32) -> Option<(i32, Finding)> {
        let mut detection = Detection::<2>::default();
        detection.start(&[0; 2], &[0.0; 2]);
        (1..1000).find_map(|tick| {
            // The observer keeps following the measurement: every tick it predicts the same motion again.
            let mut e = [0.0, -per_tick];
            let found = detection.test(&THRESHOLDS, &[tick, 0], &[tick as f32, 0.0], &mut e);
            detection.finish_tick(&THRESHOLDS.motor, &[tick; 2], &|| [tick as f32, 0.0], 0.0);
            found.map(|finding| (tick, finding))
        })
    }

    #[test]
    fn a_counter_that_stands_still_while_the_model_moves_is_found() {
        assert_eq!(frozen(0.4), Some((10, finding(Fault::Frozen, 1))));
        assert_eq!(frozen(-0.4), Some((10, finding(Fault::Frozen, 1))));
        // A small steady error of the model is no alarm, however long it lasts.
        assert_eq!(frozen(0.18), None);
    }

    /// The finding and its tick, for a motor that lacks the share `missing` of an alternating force.
    fn motor(missing: f32) -> Option<(i32, Finding)> {
        let mut detection = Detection::<2>::default();
        detection.start(&[0; 2], &[0.0; 2]);
        let mut force = 0.0;
        (1..1000).find_map(|tick| {
            let mut e = [-missing * force, 0.0];
            let found = detection.test(&THRESHOLDS, &[tick; 2], &[tick as f32; 2], &mut e);
            force = if tick % 4 < 2 { 0.4 } else { -0.4 };
            detection.finish_tick(&THRESHOLDS.motor, &[tick; 2], &|| [tick as f32; 2], force);
            found.map(|finding| (tick, finding))
        })
    }

    #[test]
    fn a_motor_of_which_more_than_half_is_missing_is_found() {
        assert_eq!(motor(0.0), None);
        assert_eq!(motor(0.45), None);
        // Not enough excitation for a verdict: 0.16 per tick sums up to at most 16 · 0.16 = 2.56.
        assert_eq!(motor(1.0), None);
        let found = |missing: f32| {
            let mut detection = Detection::<2>::default();
            (1..100).find_map(|tick| {
                let mut e = [-missing * 0.6, 0.0];
                let found = detection.test(&THRESHOLDS, &[tick; 2], &[tick as f32; 2], &mut e);
                detection.finish_tick(&THRESHOLDS.motor, &[tick; 2], &|| [tick as f32; 2], 0.6);
                found.map(|finding| finding.fault)
            })
        };
        assert_eq!(found(0.45), None);
        assert_eq!(found(0.55), Some(Fault::Motor));
        assert_eq!(found(1.0), Some(Fault::Motor));
        assert_eq!(found(-1.0), None, "more force than asked for is not a missing one");
    }
    /// The finding and its tick where a hand may push, for a motor that lacks the share `missing` of a force of this
    /// size, and with another force `by_hand` on the cart.
    fn pushed(missing: f32, force_n: f32, by_hand: f32) -> Option<(i32, Finding)> {
        let thresholds = Thresholds { innovation: [9.0; 2], push: [90.0; 2], ..THRESHOLDS };
        let mut detection = Detection::<2>::default();
        detection.start(&[0; 2], &[0.0; 2]);
        let mut force = 0.0;
        (1..1000).find_map(|tick| {
            let mut e = [-missing * force + by_hand, 0.0];
            let found = detection.test(&thresholds, &[2 * tick; 2], &[tick as f32; 2], &mut e);
            force = if tick % 4 < 2 { force_n } else { -force_n };
            detection.finish_tick(&thresholds.motor, &[tick; 2], &|| [tick as f32; 2], force);
            found.map(|finding| (tick, finding))
        })
    }

    #[test]
    fn where_a_hand_may_push_a_missing_force_has_to_explain_the_innovation() {
        let motor = Some(Finding { fault: Fault::Motor, sensor: 0 });
        assert_eq!(pushed(0.0, 0.6, 0.0), None);
        assert_eq!(pushed(0.45, 0.6, 0.0), None);
        assert_eq!(pushed(0.55, 0.6, 0.0).map(|(_, found)| found), motor);
        assert_eq!(pushed(1.0, 0.6, 0.0).map(|(_, found)| found), motor);
        assert_eq!(pushed(1.0, 0.6, 0.4), None, "a hand explains a part of it");
        assert_eq!(pushed(-1.0, 0.6, 0.0), None, "more force than asked for is not a missing one");
        // 0.25 per tick sums up to 4 after 17 ticks in the long memory, and to 64 never.
        assert_eq!(pushed(1.0, 0.4, 0.0), None);
    }

    #[test]
    fn a_motor_that_is_stuck_is_found_within_the_short_memory() {
        let within = |missing| pushed(missing, 1.0, 0.0).is_some_and(|(tick, _)| tick < 8);
        assert!(within(2.0));
        assert!(!within(1.2), "a dead motor needs the long memory");
        assert!(!within(3.5), "a hand that pushes harder than the motor");
    }
}
