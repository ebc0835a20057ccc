//! The limits that the supervisor enforces, as part of the gain table.

use crate::table::part::part;

part! {
    /// Limits of a rig. `upright design` computes them from `[limits]` of the rig file. Times are in ticks. If the rig
    /// has no such limit, a maximum is `f32::MAX` and a minimum 0.
    #[derive(Copy)]
    pub struct Limits<;> {
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
    }
}

/// Share of the way between the soft limits of the rail that set-points keep from either of them. The cart goes beyond
/// its set-point: it overshoots, moves outwards before it returns, and noise and friction move it to and fro. The
/// design's bound on the speed of the set-point leaves half of this margin for the latter.
pub const SETPOINT_MARGIN: f32 = 0.1;

impl Limits {
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
        }
    }

    /// Whether every limit has a valid value.
    pub(crate) fn is_sound(&self) -> bool {
        let [low, high] = self.rail_m;
        let ticks =
            [self.supply_ticks, self.saturated_ticks, self.link_ticks, self.arm_ticks, self.still_ticks];
        low < high
            && [self.angle_rad, self.speed_m_per_s, self.arm_angle_rad].iter().all(|limit| *limit > 0.0)
            && self.supply_min_v >= 0.0
            && self.jog_force_n >= 0.0
            && ticks.iter().all(|&ticks| ticks > 0)
            && self.travel_counts.iter().all(|&counts| counts >= 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn limits() -> Limits {
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
        }
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
        let [low, high] = Limits::none().setpoints_m();
        assert!(low < -1e38 && high > 1e38 && high.is_finite());
    }

    #[test]
    fn an_impossible_limit_is_found() {
        assert!(limits().is_sound());
        let unsound = |change: &dyn Fn(&mut Limits)| {
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
    }
}
