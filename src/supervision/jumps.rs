//! Counters that jump while no model predicts them: they move further in a tick than a cart or a joint can.
//!
//! While the controller runs, the tests of the innovation find them: [`detection`](crate::supervision::detection).

use crate::table::{GainTable, Limits};

/// No cart is faster, pushed or thrown by hand (m/s).
const FASTEST_M_PER_S: f32 = 10.0;
/// No joint is faster, turned by hand or in a chain that falls (turns/s).
const FASTEST_TURNS_PER_S: f32 = 30.0;
/// Nor is more believed of a slow tick (turns): from half a turn on, nobody could tell the direction.
const FURTHEST_TURN: f32 = 0.25;
/// A step's edge at both ends of the way (counts).
const EDGES: f32 = 2.0;

/// How far each sensor may move in a tick of `tick_s` (counts); `steps` is the travel per count (m or rad). Without a
/// limit for a sensor of a `[model]`, of which nobody knows what it measures.
pub fn furthest_counts<const NY: usize>(limits: &Limits<NY>, steps: &[f32; NY], tick_s: f32) -> [u32; NY] {
    let mut furthest = [u32::MAX; NY];
    let [travel, _] = limits.travel_counts;
    let share = FASTEST_TURNS_PER_S * tick_s;
    let share = if share < FURTHEST_TURN { share } else { FURTHEST_TURN };
    for ((furthest, &turn), &step) in furthest.iter_mut().zip(&limits.turn_counts).zip(steps) {
        if turn > 0 {
            *furthest = (share * turn as f32 + EDGES) as u32;
        } else if travel > 0 {
            *furthest = (FASTEST_M_PER_S * tick_s / step + EDGES) as u32;
        }
    }
    furthest
}

/// What a firmware knows of jumps.
#[derive(Debug, Clone)]
pub struct Jumps<const NY: usize> {
    /// How far each sensor may move in a tick (counts).
    pub furthest_counts: [u32; NY],
    /// Ticks in a row in which a counter has jumped.
    pub in_a_row: u32,
}

impl<const NY: usize> Jumps<NY> {
    /// None so far. Without an observer, nobody knows how far a count is, and nothing is balanced.
    pub fn none_with<const NX: usize>(table: &GainTable<NX, NY>) -> Self {
        let furthest_counts = table.observer.as_ref().map_or([u32::MAX; NY], |observer| {
            furthest_counts(&table.limits, &observer.step.data.0[0], table.tick_s)
        });
        Self { furthest_counts, in_a_row: 0 }
    }
}

/// The first sensor that has jumped, if the counts were `before` and are `after` a tick.
#[inline]
pub fn jumped<const NY: usize>(before: &[i32; NY], after: &[i32; NY], furthest: &[u32; NY]) -> Option<u8> {
    let is_far = |((&before, &after), &furthest): ((&i32, &i32), &u32)| {
        after.wrapping_sub(before).unsigned_abs() > furthest
    };
    Some(before.iter().zip(after).zip(furthest).position(is_far)? as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits<3> =
        Limits { travel_counts: [40_000, 400], turn_counts: [0, 4000, 20], ..Limits::none() };
    const STEPS: [f32; 3] = [2.5e-5, 1.57e-3, 0.314];

    #[test]
    fn a_counter_that_is_cleared_or_wraps_elsewhere_jumps_and_a_thrown_link_does_not() {
        let jump_in = |moved, tick_s| jumped(&[0; 3], &moved, &furthest_counts(&LIMITS, &STEPS, tick_s));
        let jump = |moved| jump_in(moved, 0.001);
        // 30 turns/s and 10 m/s; one of the coarse encoder's 20 counts is 50 turns/s.
        assert_eq!(jump([400, -120, 2]), None);
        assert_eq!((jump([-30_000, 0, 0]), jump([410, 0, 0])), (Some(0), Some(0)));
        // An ESP32's counter that is cleared at 30 000; a reading of 12 bits that wraps.
        assert_eq!(
            (jump([0, -30_000, 0]), jump([0, 4095, 0]), jump([0, 130, 0])),
            (Some(1), Some(1), Some(1))
        );
        assert_eq!((jump([0, 0, 10]), jump([0, i32::MIN, i32::MIN])), (Some(2), Some(1)));
        // In a slow tick, a quarter of a turn.
        assert_eq!(jump_in([0, 1000, 0], 0.05), None);
        assert_eq!(jump_in([0, -1003, 0], 0.05), Some(1));
        let model = furthest_counts(&Limits::none(), &STEPS, 0.001);
        assert_eq!(jumped(&[0; 3], &[i32::MIN; 3], &model), None, "a model");
    }
}
