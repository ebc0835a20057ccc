//! Thresholds above which the supervisor reports a fault of an encoder or the motor; the tests are in
//! [`detection`](crate::supervision::detection).

use crate::table::part::part;

part! {
    /// Thresholds of the fault tests for `NY` sensors; `f32::MAX` where there is nothing to test.
    #[derive(Copy)]
    pub struct Thresholds<NY to MY;> {
        /// Largest plausible innovation of each sensor (m or rad).
        pub innovation: [f32; NY],
        /// Largest predicted motion of each sensor while its counter stands still (m or rad).
        pub frozen: [f32; NY],
        /// Largest innovation of each sensor under a push that the rig survives (m or rad); [`f32::MAX`] where pushes
        /// are not told from defects.
        pub push: [f32; NY],
        /// Model and thresholds of the motor test.
        pub motor: MotorTest,
    }
}

part! {
    /// Effect of a missing force on the innovation of the first sensor, and when it counts as a fault.
    ///
    /// The error `(p, v)` of the predicted position and speed follows
    /// `p⁺ = a_pp p' + a_pv v' - b_p u, v⁺ = a_vp p' + a_vv v' - b_v u` with `p' = p - l_p p, v' = v - l_v p`. p is
    /// the innovation that a missing `u` causes.
    #[derive(Copy)]
    pub struct MotorTest<;> {
        /// a_pp, a_pv, a_vp, a_vv over one tick, the observer's correction included.
        pub a: [f32; 4],
        /// b_p (m/N), b_v (m/(s N)).
        pub b: [f32; 2],
        /// Share of the force that may be missing.
        pub ratio: f32,
        /// Least sum of p² for a verdict (m²).
        pub energy: f32,
    }
}

impl MotorTest {
    /// A test that never finds anything.
    pub const NONE: Self = Self { a: [0.0; 4], b: [0.0; 2], ratio: 1.0, energy: f32::MAX };
}

impl<const NY: usize> Thresholds<NY> {
    /// Thresholds that are never exceeded.
    pub const fn none() -> Self {
        Self {
            innovation: [f32::MAX; NY],
            frozen: [f32::MAX; NY],
            push: [f32::MAX; NY],
            motor: MotorTest::NONE,
        }
    }

    /// Whether pushes by hand are told from defects.
    #[inline(always)]
    pub fn survives_pushes(&self) -> bool {
        self.push.first().is_some_and(|push| *push < f32::MAX)
    }

    /// Whether every threshold is positive.
    pub(crate) fn is_sound(&self) -> bool {
        let of_sensors = [&self.innovation, &self.frozen, &self.push].into_iter().flatten();
        let thresholds = of_sensors.chain([&self.motor.ratio, &self.motor.energy]);
        thresholds.into_iter().all(|threshold| *threshold > 0.0)
    }
}
