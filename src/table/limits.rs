//! What the supervisor enforces, as part of the gain table.

/// Limits for `NY` sensors, worked out by `upright design` from `[limits]` of the rig file. Times are in ticks. A limit that a rig does
/// not have is `f32::MAX`, a least value 0; a sensor without turns, rest or sign to check (any of a `[model]`) has 0
/// there.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits<const NY: usize> {
    /// Soft limits of the rail, low and high (m).
    pub rail_m: [f32; 2],
    /// Largest angle of any link from the vertical (rad).
    pub angle_rad: f32,
    /// Largest speed of the cart (m/s).
    pub speed_m_per_s: f32,
    /// Least supply voltage of the power stage (V).
    pub supply_min_v: f32,
    /// The supply may be too low for so long (ticks).
    pub supply_ticks: u32,
    /// The law may ask for more than the largest force for so long (ticks).
    pub saturated_ticks: u32,
    /// A host that commands the set-point may be silent for so long (ticks).
    pub link_ticks: u32,
    /// Largest angle of any link from the vertical at which balancing begins (rad).
    pub arm_angle_rad: f32,
    /// All links have to be upright and slow for so long before balancing begins (ticks).
    pub arm_ticks: u32,
    /// Cart and links have to be still for so long before they are homed (ticks).
    pub still_ticks: u32,
    /// Distance between the limit switches (counts), and by how much it may differ when homing finds it.
    pub travel_counts: [i32; 2],
    /// The middle between the limit switches, from position 0 (counts).
    pub middle_counts: i32,
    /// A joint or the cart may move by so much within `arm_ticks` and still be slow (counts).
    pub slow_counts: [i32; NY],
    /// Where each sensor stands while the links hang at rest: half a turn for the first link, else 0 (counts).
    pub rest_counts: [i32; NY],
    /// A whole turn of each joint (counts); 0 for the cart.
    pub turn_counts: [i32; NY],
    /// How far each sensor has to be moved when its sign is checked (counts).
    pub sign_counts: [i32; NY],
}

impl<const NY: usize> Limits<NY> {
    /// Limits that nothing exceeds: for a controller without supervisor.
    pub const fn none() -> Self {
        Self {
            rail_m: [-f32::MAX, f32::MAX],
            angle_rad: f32::MAX,
            speed_m_per_s: f32::MAX,
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

    /// The scalar values in order, as bits.
    pub(crate) fn scalars(&self) -> [u32; 14] {
        let [low, high] = self.rail_m;
        let [travel, tolerance] = self.travel_counts;
        [
            low.to_bits(),
            high.to_bits(),
            self.angle_rad.to_bits(),
            self.speed_m_per_s.to_bits(),
            self.supply_min_v.to_bits(),
            self.supply_ticks,
            self.saturated_ticks,
            self.link_ticks,
            self.arm_angle_rad.to_bits(),
            self.arm_ticks,
            self.still_ticks,
            travel as u32,
            tolerance as u32,
            self.middle_counts as u32,
        ]
    }

    /// Whether every limit can be a limit.
    pub(crate) fn is_sound(&self) -> bool {
        let [low, high] = self.rail_m;
        let positive = [self.angle_rad, self.speed_m_per_s, self.arm_angle_rad];
        low < high
            && positive.iter().all(|limit| *limit > 0.0 && limit.is_finite())
            && self.supply_min_v >= 0.0
            && self.supply_min_v.is_finite()
            && [low, high].iter().all(|limit| limit.is_finite())
            && [self.supply_ticks, self.saturated_ticks, self.link_ticks, self.arm_ticks, self.still_ticks]
                .iter()
                .all(|&ticks| ticks > 0)
            && [&self.slow_counts, &self.turn_counts, &self.sign_counts]
                .iter()
                .all(|counts| counts.iter().all(|&c| c >= 0))
            && self.travel_counts.iter().all(|&counts| counts >= 0)
    }

    /// `counts` with each joint turned by whole turns to the half turn on either side of 0.
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
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn limits() -> Limits<3> {
        Limits {
            rail_m: [-1.0, 1.0],
            angle_rad: 0.35,
            speed_m_per_s: 2.0,
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
    fn a_limit_that_cannot_be_one_is_found() {
        assert!(limits().is_sound());
        let unsound = |change: &dyn Fn(&mut Limits<3>)| {
            let mut limits = limits();
            change(&mut limits);
            !limits.is_sound()
        };
        assert!(unsound(&|l| l.rail_m = [1.0, -1.0]));
        assert!(unsound(&|l| l.angle_rad = f32::NAN));
        assert!(unsound(&|l| l.speed_m_per_s = 0.0));
        assert!(unsound(&|l| l.arm_ticks = 0));
        assert!(unsound(&|l| l.turn_counts[1] = -1));
    }
}
