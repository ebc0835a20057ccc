//! Tests of the encoders that pushes by hand do not fail, for a rig that balances with a force.
//!
//! A push moves the innovation far, but smoothly, and counters keep counting; a broken encoder does neither.
//!
//! - *No jump*: from tick to tick, an innovation grows by at most its threshold. A measurement beyond that is rejected
//!   (the prediction takes its place) and counted. After the third in a row, the encoder has a fault if the innovation
//!   has stayed where it jumped to; if it moves on, something pushes, and the measurement is accepted.
//! - *Not frozen*: while a counter stays at two neighbouring values, its innovation grows by at most the same
//!   threshold: the model must not say that the shaft moves on.
//! - *No push* that is harder than the rig survives: the innovation stays within a larger limit.

use crate::supervision::fault::Fault;
use crate::supervision::finding::{Finding, IN_A_ROW};
use crate::table::Thresholds;

/// A counter that has stayed at two neighbouring values for this many ticks may be frozen.
pub const STILL_TICKS: u32 = 10;
/// After [`IN_A_ROW`] measurements, a jump has changed by less than this share of its size.
const JUMP_CHANGE: f32 = 0.5;

/// State of these tests.
#[derive(Debug, Clone)]
pub(super) struct Pushes<const NY: usize> {
    sensors: [PushedSensor; NY],
    /// Last innovation of each sensor that was accepted (m or rad).
    accepted: [f32; NY],
    /// Whether every innovation was within its threshold in the last tick.
    was_calm: bool,
    /// Whether [`finish_tick`](Self::finish_tick) has to note which counters stand still.
    is_calm: bool,
    /// Whether the state of the sensors is that of these tests, not of earlier ones.
    is_started: bool,
    /// Number of ticks since the start; it wraps around.
    ticks: u32,
    /// Number of rejected measurements.
    rejected: u32,
}

/// State of the tests of one sensor.
#[derive(Debug, Clone, Copy, Default)]
struct PushedSensor {
    /// The lower one of the two neighbouring values at which the counter stands still, or the only one.
    lowest: i32,
    /// 1 if it has had both of these values, else 0.
    width: u32,
    /// The tick since which it stands still.
    since: u32,
    /// The innovation closest to 0 since then; 0 once its sign has changed (m or rad).
    closest: f32,
    /// Jump of the first of the measurements that are rejected now (m or rad).
    jump: f32,
    /// Rejected measurements in a row.
    rejected: u32,
    /// Ticks in a row beyond the limit for pushes.
    pushed: u32,
}

impl<const NY: usize> Default for Pushes<NY> {
    fn default() -> Self {
        let sensors = [PushedSensor::default(); NY];
        Self {
            sensors,
            accepted: [0.0; NY],
            was_calm: true,
            is_calm: false,
            is_started: false,
            ticks: 0,
            rejected: 0,
        }
    }
}

/// What these tests find in one tick.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PushFindings {
    /// A broken encoder.
    pub(super) encoder: Option<Finding>,
    /// A push that is too hard.
    pub(super) push: Option<Finding>,
}

impl<const NY: usize> Pushes<NY> {
    /// Restarts the tests; the number of rejected measurements stays. The first tick resets the rest, which its output
    /// need not wait for.
    pub(super) fn start(&mut self) {
        (self.was_calm, self.is_calm, self.is_started) = (true, false, false);
    }

    /// Number of measurements rejected since the start.
    pub(super) fn rejected(&self) -> u32 {
        self.rejected
    }

    /// Sets the number of rejected measurements to 0.
    pub(super) fn reset_rejected(&mut self) {
        self.rejected = 0;
    }

    /// Tests the innovation of a tick (m or rad); sets that of a rejected measurement to 0.
    #[inline(always)]
    pub(super) fn test(
        &mut self,
        thresholds: &Thresholds<NY>,
        counts: &[i32; NY],
        e: &mut [f32; NY],
    ) -> PushFindings {
        let mut is_calm = true;
        for (e, limit) in e.iter().zip(&thresholds.innovation) {
            // False for NaN, too.
            is_calm &= e.abs() <= *limit;
        }
        self.is_calm = is_calm && self.was_calm;
        // Within the threshold, no test of a sensor can fail.
        if self.is_calm {
            self.accepted = *e;
            return PushFindings::default();
        }
        self.was_calm = is_calm;
        self.watch(counts, e);
        self.test_sensors(thresholds, e)
    }

    /// Notes which counters stand still, if the tick was calm.
    #[inline]
    pub(super) fn finish_tick(&mut self, counts: &[i32; NY]) {
        if self.is_calm {
            self.watch(counts, &{ self.accepted });
        }
    }

    /// Notes which counters stand still, from the first tick on.
    fn watch(&mut self, counts: &[i32; NY], e: &[f32; NY]) {
        if !self.is_started {
            for (sensor, &lowest) in self.sensors.iter_mut().zip(counts) {
                *sensor = PushedSensor { lowest, ..PushedSensor::default() };
            }
            (self.is_started, self.ticks) = (true, 0);
            if !self.is_calm {
                self.accepted = [0.0; NY];
            }
        }
        self.ticks = self.ticks.wrapping_add(1);
        for (memory, (&counts, &e)) in self.sensors.iter_mut().zip(counts.iter().zip(e)) {
            memory.watch(counts, e, self.ticks);
        }
    }

    /// Tests each sensor, of which at least one is, or was, beyond its threshold.
    #[cold]
    #[inline(never)]
    fn test_sensors(&mut self, thresholds: &Thresholds<NY>, e: &mut [f32; NY]) -> PushFindings {
        let (mut jumped, mut frozen, mut push) = (None, None, None);
        let memories = self.sensors.iter_mut().zip(&mut self.accepted);
        let limits = thresholds.innovation.iter().zip(&thresholds.push);
        for (((memory, accepted), e), ((&limit, &hardest), sensor)) in memories.zip(e).zip(limits.zip(0..)) {
            let finding = |fault| Some(Finding { fault, sensor });
            if self.ticks.wrapping_sub(memory.since) >= STILL_TICKS && (*e - memory.closest).abs() > limit {
                frozen = finding(Fault::Frozen);
            }
            memory.pushed = if e.abs() > hardest { memory.pushed.saturating_add(1) } else { 0 };
            if memory.pushed >= IN_A_ROW {
                push = finding(Fault::Disturbed);
            }
            let change = change(*accepted, *e);
            // False for NaN, too.
            if change.abs() <= limit || !memory.rejects(change) {
                (*accepted, memory.rejected) = (*e, 0);
                continue;
            }
            *e = 0.0;
            self.rejected = self.rejected.saturating_add(1);
            if memory.rejected >= IN_A_ROW {
                jumped = jumped.or(finding(Fault::Encoder));
            }
        }
        PushFindings { encoder: jumped.or(frozen), push }
    }
}

impl PushedSensor {
    /// Notes whether the counter stands still, and the innovation `e` (m or rad) closest to 0 since it does.
    #[inline(never)]
    fn watch(&mut self, counts: i32, e: f32, tick: u32) {
        let above = counts.wrapping_sub(self.lowest);
        if above as u32 > self.width {
            if self.width > 0 || !(above == 1 || above == -1) {
                *self = Self { lowest: counts, width: 0, since: tick, closest: e, ..*self };
                return;
            }
            (self.lowest, self.width) = (self.lowest.min(counts), 1);
        }
        // Of two numbers with the same sign, the one closer to 0 has the smaller bits.
        let (bits, closest) = (e.to_bits(), self.closest.to_bits());
        self.closest = f32::from_bits(if (bits ^ closest) >> 31 == 0 { bits.min(closest) } else { 0 });
    }

    /// Whether a measurement is rejected whose innovation has changed by `change` (m or rad), which is too much. Not if
    /// it is the third in a row, and has moved on since the first.
    fn rejects(&mut self, change: f32) -> bool {
        self.rejected = self.rejected.saturating_add(1);
        if self.rejected == 1 {
            self.jump = change;
        }
        // False for NaN, too.
        let moves_on = (change - self.jump).abs() >= JUMP_CHANGE * self.jump.abs();
        self.rejected < IN_A_ROW || !moves_on
    }
}

/// By how much the innovation `e` is beyond what lies between 0 and the last accepted one (m or rad).
fn change(accepted: f32, e: f32) -> f32 {
    let is_same_side = e * accepted > 0.0;
    if is_same_side && e.abs() <= accepted.abs() {
        return 0.0;
    }
    e - if is_same_side { accepted } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::MotorTest;

    const THRESHOLDS: Thresholds<2> =
        Thresholds { innovation: [1.0; 2], frozen: [f32::MAX; 2], push: [5.0; 2], motor: MotorTest::NONE };

    /// The first finding and its tick, for the counts and innovations `of` each tick.
    fn first_at(of: impl Fn(i32) -> ([i32; 2], [f32; 2])) -> Option<(i32, Finding)> {
        let mut pushes = Pushes::default();
        (1..1000).find_map(|tick| {
            let (counts, mut e) = of(tick);
            let found = pushes.test(&THRESHOLDS, &counts, &mut e);
            pushes.finish_tick(&counts);
            found.encoder.or(found.push).map(|finding| (tick, finding))
        })
    }

    /// The same with counters that move.
    fn first(of: impl Fn(i32) -> [f32; 2]) -> Option<(i32, Finding)> {
        first_at(|tick| ([2 * tick; 2], of(tick)))
    }

    fn finding(fault: Fault, sensor: u8) -> Finding {
        Finding { fault, sensor }
    }

    #[test]
    fn a_jump_that_stays_is_a_fault_in_its_third_tick_and_one_of_two_ticks_is_not() {
        assert_eq!(first(|_| [0.9, -0.9]), None);
        assert_eq!(first(|tick| [0.0, if tick % 3 == 0 { 0.0 } else { 5.0 }]), None);
        let from_20 = |tick: i32| if tick >= 20 { -1.1 } else { 0.0 };
        assert_eq!(first(|tick| [0.0, from_20(tick)]), Some((22, finding(Fault::Encoder, 1))));
        assert_eq!(first(|tick| [from_20(tick), 0.0]), Some((22, finding(Fault::Encoder, 0))));
        assert_eq!(first(|_| [f32::NAN, 0.0]), Some((3, finding(Fault::Encoder, 0))));
    }

    #[test]
    fn a_push_is_no_fault_until_it_is_harder_than_the_rig_survives() {
        // Smooth, or so sudden that every tick changes the innovation by more than the threshold.
        for (rate, to) in [(0.1, 4.9), (1.5, 4.9), (0.1, 5.4), (1.5, 7.0)] {
            let pushed = |tick: i32| [0.0, (rate * (tick - 20).max(0) as f32).min(to)];
            let found = first(pushed);
            match found {
                Some((tick, found)) => {
                    assert!(to > 5.0, "{rate} {to}");
                    assert_eq!(found, finding(Fault::Disturbed, 1));
                    assert!((24..75).contains(&tick), "{tick}");
                }
                None => assert!(to < 5.0, "{rate} {to}"),
            }
        }
    }

    #[test]
    fn a_rejected_measurement_has_no_innovation_and_is_counted() {
        let mut pushes = Pushes::default();
        let mut e = [7.0, 0.5];
        assert_eq!(pushes.test(&THRESHOLDS, &[7, 1], &mut e).encoder, None);
        assert_eq!((e, pushes.rejected()), ([0.0, 0.5], 1));
        pushes.reset_rejected();
        assert_eq!(pushes.rejected(), 0);
    }

    #[test]
    fn a_counter_with_at_most_two_values_is_frozen_once_the_model_has_moved_on() {
        let growing = |tick: i32| [0.0, 0.08 * tick as f32];
        let frozen = Some((13, finding(Fault::Frozen, 1)));
        assert_eq!(first_at(|tick| ([2 * tick, 7], growing(tick))), frozen);
        // An open wire: the count alternates between two values.
        assert_eq!(first_at(|tick| ([2 * tick, i32::MIN + tick % 2], growing(tick))), frozen);
        // Three values are motion, and so is a fast one; only its size is limited.
        let three = first_at(|tick| ([2 * tick, tick % 3], growing(tick)));
        assert_eq!(three, Some((65, finding(Fault::Disturbed, 1))));
        // A pushed link that stands still at the end of its motion, and moves on.
        let steady = |tick: i32| [0.0, 0.1 * tick.clamp(0, 40) as f32];
        assert_eq!(first_at(|tick| ([2 * tick, 2 * tick.min(40)], steady(tick))), None);
    }
}
