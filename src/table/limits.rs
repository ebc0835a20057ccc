//! The limits that the supervisor enforces, as part of the gain table.

use crate::table::equilibrium::Equilibrium;
use crate::table::part::part;

part! {
    /// Limits for `NY` sensors. `upright design` computes them from `[limits]` of the rig file. Times are in ticks. If
    /// the rig has no such limit, a maximum is `f32::MAX` and a minimum 0. If a sensor has no turns, rest position or
    /// sign to check (any sensor of a `[model]`), the value is 0.
    #[derive(Copy)]
    pub struct Limits<NY to MY;> {
        /// Soft limits of the rail, low and high (m).
        pub rail_m: [f32; 2],
        /// Largest angle of any link from the vertical (rad).
        pub angle_rad: f32,
        /// Largest speed of the cart (m/s).
        pub speed_m_per_s: f32,
        /// Largest force of the jog (N). For a drive with pulses, an acceleration (m/s²) that moves the links while
        /// the rig is shaken.
        pub jog_force_n: f32,
        /// Least supply voltage of the power stage (V).
        pub supply_min_v: f32,
        /// Longest time for which the supply may be too low (ticks).
        pub supply_ticks: u32,
        /// Longest time for which the law may ask for more than the largest force (ticks).
        pub saturated_ticks: u32,
        /// Longest silence of a host that commands the set-point (ticks).
        pub link_ticks: u32,
        /// Largest angle of any link from the vertical at which balancing begins (rad).
        pub arm_angle_rad: f32,
        /// Time for which all links have to be upright and slow before balancing begins (ticks).
        pub arm_ticks: u32,
        /// Time for which cart and links have to be still before they are homed (ticks).
        pub still_ticks: u32,
        /// Distance between the limit switches, and its tolerance when homing finds it (counts).
        pub travel_counts: [i32; 2],
        /// The middle between the limit switches, from position 0 (counts).
        pub middle_counts: i32,
        /// Largest motion of each sensor within `arm_ticks` that is still slow (counts).
        pub slow_counts: [i32; NY],
        /// Position of each sensor while the links hang at rest: half a turn for the first link, else 0 (counts).
        pub rest_counts: [i32; NY],
        /// A whole turn of each joint; 0 for the cart (counts).
        pub turn_counts: [i32; NY],
        /// Distance that each sensor has to be moved when its sign is checked (counts).
        pub sign_counts: [i32; NY],
    }
}

/// Share of the way between the soft limits of the rail that set-points keep from either of them. The cart goes beyond
/// its set-point: it overshoots, moves outwards before it returns, and noise and friction move it to and fro. The
/// design's bound on the speed of the set-point leaves half of this margin for the latter.
pub const SETPOINT_MARGIN: f32 = 0.1;

impl<const NY: usize> Limits<NY> {
    /// The lowest and the highest position (m) that the cart may be told to hold, or be balanced at. Position 0, where
    /// the cart starts, always is one of them.
    pub fn setpoints_m(&self) -> [f32; 2] {
        let [low, high] = self.rail_m;
        // Both products are finite, which the length of a rail without limits is not.
        let margin = SETPOINT_MARGIN * high - SETPOINT_MARGIN * low;
        let (lowest, highest) = (low + margin, high - margin);
        // Comparisons, because `f32::min` would be a function call in the image.
        [if lowest < 0.0 { lowest } else { 0.0 }, if highest > 0.0 { highest } else { 0.0 }]
    }

    /// Limits that are never exceeded: for a controller without a supervisor.
    pub const fn none() -> Self {
        Self {
            rail_m: [-f32::MAX, f32::MAX],
            angle_rad: f32::MAX,
            speed_m_per_s: f32::MAX,
            jog_force_n: 0.0,
            supply_min_v: 0.0,
            supply_ticks: 1,
            saturated_ticks: u32::MAX,
            link_ticks: u32::MAX,
            arm_angle_rad: f32::MAX,
            arm_ticks: 1,
            still_ticks: 1,
            travel_counts: [0; 2],
            middle_counts: 0,
            slow_counts: [i32::MAX; NY],
            rest_counts: [0; NY],
            turn_counts: [0; NY],
            sign_counts: [0; NY],
        }
    }

    /// Whether every limit has a valid value.
    pub(crate) fn is_sound(&self) -> bool {
        let [low, high] = self.rail_m;
        let ticks =
            [self.supply_ticks, self.saturated_ticks, self.link_ticks, self.arm_ticks, self.still_ticks];
        let counts = [&self.slow_counts, &self.turn_counts, &self.sign_counts];
        low < high
            && [self.angle_rad, self.speed_m_per_s, self.arm_angle_rad].iter().all(|limit| *limit > 0.0)
            && self.supply_min_v >= 0.0
            && self.jog_force_n >= 0.0
            && ticks.iter().all(|&ticks| ticks > 0)
            && counts.into_iter().flatten().chain(&self.travel_counts).all(|&counts| counts >= 0)
    }

    /// `counts` with whole turns removed from each joint, so that it is within half a turn of 0.
    pub fn within_half_a_turn(&self, counts: &[i32; NY]) -> [i32; NY] {
        let mut wrapped = *counts;
        for (count, &turn) in wrapped.iter_mut().zip(&self.turn_counts) {
            if turn > 0 {
                let half = turn / 2;
                *count = count.wrapping_add(half).rem_euclid(turn) - half;
            }
        }
        wrapped
    }

    /// Counts at rest `at` an equilibrium. The first sensor is the cart's, and every joint has one.
    fn rest(&self, at: Equilibrium) -> [i32; NY] {
        let mut rest = [0; NY];
        for (joint, (rest, turn)) in rest.iter_mut().zip(&self.turn_counts).skip(1).enumerate() {
            *rest = at.half_turns(joint) * (turn / 2);
        }
        rest
    }

    /// Distance of these counts from rest `at` an equilibrium, without whole turns of the joints.
    pub fn from_rest(&self, counts: &[i32; NY], at: Equilibrium) -> [i32; NY] {
        self.away(counts, &self.rest(at))
    }

    fn away(&self, counts: &[i32; NY], rest: &[i32; NY]) -> [i32; NY] {
        let mut away = *counts;
        away.iter_mut().zip(rest).for_each(|(count, rest)| *count = count.wrapping_sub(*rest));
        self.within_half_a_turn(&away)
    }

    /// These counts without whole turns of the joints, so that each is within half a turn of where it rests `at` an
    /// equilibrium.
    pub fn unwound(&self, counts: &[i32; NY], at: Equilibrium) -> [i32; NY] {
        let rest = self.rest(at);
        let mut unwound = self.away(counts, &rest);
        unwound.iter_mut().zip(&rest).for_each(|(count, rest)| *count = count.wrapping_add(*rest));
        unwound
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_turns_are_taken_off_where_the_joint_rests() {
        let limits = Limits::<3> { turn_counts: [0, 4096, 1000], ..Limits::none() };
        let unwound = |counts, bits| limits.unwound(&counts, Equilibrium::of_bits(bits));
        assert_eq!(unwound([7, 3 * 4096 + 5, -1003], 0b00), [7, 5, -3]);
        assert_eq!(unwound([70_000, -2047, 998], 0b11), [70_000, 2049, -2]);
        // Link 1 is down, link 2 up: its joint rests half a turn back.
        assert_eq!(unwound([0, 2040, 502], 0b01), [0, 2040, -498]);
        assert_eq!(unwound([0, -5, -502], 0b10), [0, -5, 498]);
    }

    pub(crate) fn limits() -> Limits<3> {
        Limits {
            rail_m: [-1.0, 1.0],
            angle_rad: 0.35,
            speed_m_per_s: 2.0,
            jog_force_n: 1.0,
            supply_min_v: 0.0,
            supply_ticks: 1,
            saturated_ticks: 10,
            link_ticks: 10,
            arm_angle_rad: 0.05,
            arm_ticks: 10,
            still_ticks: 10,
            travel_counts: [2000, 20],
            middle_counts: 0,
            slow_counts: [1; 3],
            rest_counts: [0, 2048, 0],
            turn_counts: [0, 4096, 4095],
            sign_counts: [50, 130, 130],
        }
    }

    #[test]
    fn whole_turns_are_taken_away_and_nothing_else() {
        let limits = limits();
        for turns in -3..=3 {
            let raised = [5000, 4096 * turns + 7, 4095 * turns - 9];
            assert_eq!(limits.within_half_a_turn(&raised), [5000, 7, -9]);
        }
        assert_eq!(limits.within_half_a_turn(&[-5000, 2047, 2046]), [-5000, 2047, 2046]);
    }

    #[test]
    fn set_points_keep_a_tenth_of_the_rail_from_its_limits_and_position_0_always_is_one() {
        let near = |rail_m, wanted: [f32; 2]| {
            let found = Limits { rail_m, ..limits() }.setpoints_m();
            assert!(
                found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-6),
                "{found:?}"
            );
        };
        near([-1.0, 1.0], [-0.8, 0.8]);
        near([-0.25, 1.75], [-0.05, 1.55]);
        near([-0.125, 1.875], [0.0, 1.675]);
        near([-1.875, 0.125], [-1.675, 0.0]);
        let [low, high] = Limits::<3>::none().setpoints_m();
        assert!(low < -1e38 && high > 1e38 && high.is_finite());
    }

    #[test]
    fn an_impossible_limit_is_found() {
        assert!(limits().is_sound());
        let unsound = |change: &dyn Fn(&mut Limits<3>)| {
            let mut limits = limits();
            change(&mut limits);
            !limits.is_sound()
        };
        assert!(unsound(&|l| l.rail_m = [1.0, -1.0]));
        assert!(unsound(&|l| l.angle_rad = f32::NAN));
        assert!(unsound(&|l| l.rail_m[0] = f32::NAN));
        assert!(unsound(&|l| l.supply_min_v = f32::NAN));
        assert!(unsound(&|l| l.jog_force_n = -1.0));
        assert!(unsound(&|l| l.travel_counts[1] = -1));
        assert!(unsound(&|l| l.speed_m_per_s = 0.0));
        assert!(unsound(&|l| l.arm_ticks = 0));
        assert!(unsound(&|l| l.turn_counts[1] = -1));
    }
}
