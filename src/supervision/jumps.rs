//! How far a counter may move in a tick while no model predicts it: as far as a cart or a joint can. The controller in
//! C refuses counters that move further; while the controller runs, the tests of the innovation find them:
//! [`detection`](crate::supervision::detection).

use crate::table::{Limits, SensorRow};

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
pub fn furthest_counts<const NY: usize>(
    limits: &Limits,
    sensors: &[SensorRow; NY],
    tick_s: f32,
) -> [u32; NY] {
    let mut furthest = [u32::MAX; NY];
    let [travel, _] = limits.travel_counts;
    let share = FASTEST_TURNS_PER_S * tick_s;
    let share = if share < FURTHEST_TURN { share } else { FURTHEST_TURN };
    for (furthest, sensor) in furthest.iter_mut().zip(sensors) {
        let SensorRow { turn_counts: turn, step, .. } = *sensor;
        if turn > 0 {
            *furthest = (share * turn as f32 + EDGES) as u32;
        } else if travel > 0 {
            *furthest = (FASTEST_M_PER_S * tick_s / step + EDGES) as u32;
        }
    }
    furthest
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { travel_counts: [40_000, 400], ..Limits::none() };

    fn sensors(turns: [i32; 3]) -> [SensorRow; 3] {
        let steps = [2.5e-5, 1.57e-3, 0.314];
        let row = |i: usize| SensorRow { turn_counts: turns[i], step: steps[i], ..SensorRow::default() };
        core::array::from_fn(row)
    }

    #[test]
    fn a_counter_that_is_cleared_or_wraps_elsewhere_jumps_and_a_thrown_link_does_not() {
        let joints = sensors([0, 4000, 20]);
        // 30 turns/s and 10 m/s; one of the coarse encoder's 20 counts is 50 turns/s. An ESP32's counter that is
        // cleared at 30 000, and a reading of 12 bits that wraps, move further.
        assert_eq!(furthest_counts(&LIMITS, &joints, 0.001), [402, 122, 2]);
        // In a slow tick, a quarter of a turn.
        assert_eq!(furthest_counts(&LIMITS, &joints, 0.05)[1], 1002);
        assert_eq!(furthest_counts(&Limits::none(), &sensors([0; 3]), 0.001), [u32::MAX; 3], "a model");
    }
}
