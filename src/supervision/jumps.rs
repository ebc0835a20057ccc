//! Counters that jump while no model predicts them: they move further in a tick than a cart or a joint can.
//!
//! While the controller runs, the tests of the innovation find them: [`detection`](crate::supervision::detection).

use crate::table::Limits;

/// No cart is faster, pushed or thrown by hand (m/s).
const FASTEST_M_PER_S: f32 = 10.0;
/// No joint is faster, turned by hand or in a chain that falls (turns/s).
const FASTEST_TURNS_PER_S: f32 = 30.0;
/// Nor is more believed of a slow tick (turns): from half a turn on, nobody could tell the direction.
const FURTHEST_TURN: f32 = 0.25;
/// A step's edge at both ends of the way (counts).
const EDGES: f32 = 2.0;

/// How far a sensor may move in a tick of `tick_s` (counts); `step` is its travel per count (m or rad). Without a limit
/// for a sensor of a `[model]`, of which nobody knows what it measures.
pub fn furthest_counts<const NY: usize>(limits: &Limits<NY>, sensor: usize, step: f32, tick_s: f32) -> f32 {
    let turn = limits.turn_counts.get(sensor).copied().unwrap_or_default() as f32;
    let [travel, _] = limits.travel_counts;
    let share = FASTEST_TURNS_PER_S * tick_s;
    match (turn > 0.0, travel > 0) {
        (true, _) => turn * if share < FURTHEST_TURN { share } else { FURTHEST_TURN } + EDGES,
        (false, true) => FASTEST_M_PER_S * tick_s / step + EDGES,
        (false, false) => f32::MAX,
    }
}

/// The first sensor that has jumped, if the sensors have `moved` so far (counts) in a tick; `steps` is the travel per
/// count (m or rad).
pub fn jumped<const NY: usize>(
    moved: &[i32; NY],
    steps: &[f32; NY],
    limits: &Limits<NY>,
    tick_s: f32,
) -> Option<u8> {
    let is_far = |((&moved, &step), sensor): ((&i32, &f32), u8)| {
        let moved = moved.unsigned_abs() as f32;
        (moved > furthest_counts(limits, sensor.into(), step, tick_s)).then_some(sensor)
    };
    moved.iter().zip(steps).zip(0..).find_map(is_far)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits<3> =
        Limits { travel_counts: [40_000, 400], turn_counts: [0, 4000, 20], ..Limits::none() };
    const STEPS: [f32; 3] = [2.5e-5, 1.57e-3, 0.314];

    #[test]
    fn a_counter_that_is_cleared_or_wraps_elsewhere_jumps_and_a_thrown_link_does_not() {
        let jump = |moved| jumped(&moved, &STEPS, &LIMITS, 0.001);
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
        assert_eq!(jumped(&[0, 1000, 0], &STEPS, &LIMITS, 0.05), None);
        assert_eq!(jumped(&[0, -1003, 0], &STEPS, &LIMITS, 0.05), Some(1));
        assert_eq!(jumped(&[i32::MAX; 3], &STEPS, &Limits::none(), 0.001), None, "a model");
    }
}
