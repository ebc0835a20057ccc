//! Inhibits of arming: is the rig in a posture from which balancing may start?

use super::Firmware;
use crate::board::Contacts;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::jog::MotorSign;
use crate::supervision::sign_check::Signs;
use crate::table::SwingUp;

/// Arming requires that the rig has been slow for [`Limits::arm_ticks`] divided by this: long enough to refuse it
/// while a link swings through the vertical, short enough that a steady hand is never told to wait. The whole of
/// `arm_ticks` has to pass after arming before the motor is on.
///
/// [`Limits::arm_ticks`]: crate::table::Limits::arm_ticks
const MOVING_PART_OF_ARM_TICKS: u32 = 4;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Largest angle of a link from the vertical at these counts (rad); 0 for a rig without joints (a `[model]`).
    pub(super) fn largest_lean(&self, counts: &[i32; NY]) -> f32 {
        let (mut angle, mut largest) = (0.0, 0.0f32);
        let joints = counts.iter().zip(&self.table.sensors).filter(|(_, sensor)| sensor.turn_counts > 0);
        for (&count, sensor) in joints {
            angle += sensor.step * count as f32;
            // A comparison, because `f32::max` would be a function call in the image.
            if f32::abs(angle) > largest {
                largest = f32::abs(angle);
            }
        }
        largest
    }

    /// [`Inhibits::OFF_CENTRE`] if the cart is not between `low` and `high` (m) at these counts.
    #[inline(never)]
    pub(super) fn off_centre_inhibit(&self, counts: &[i32; NY], [low, high]: [f32; 2]) -> Inhibits {
        let step = self.table.sensors.first().map_or(0.0, |cart| cart.step);
        let position = step * counts.first().copied().unwrap_or_default() as f32;
        Inhibits::OFF_CENTRE.when(position < low || position > high)
    }

    /// Inhibits that follow from the contacts and the supply.
    pub(super) fn input_inhibits(&self) -> Inhibits {
        let Contacts { limit_low, limit_high, emergency_stop, driver_fault, .. } = self.contacts;
        let supply_v = self.table.limits.supply_min_v..=self.table.drive.supply_max_v();
        let supply_is_good = supply_v.contains(&self.supply_v) && self.supply_v.is_finite();
        Inhibits::LIMIT_SWITCH
            .when(limit_low || limit_high)
            .union(Inhibits::EMERGENCY_STOP.when(emergency_stop))
            .union(Inhibits::DRIVER.when(driver_fault))
            .union(Inhibits::SUPPLY.when(!supply_is_good))
    }

    /// All inhibits of arming that hold now, except [`Inhibits::HELD`], which is only known once a command to arm
    /// arrives.
    pub fn arming_inhibits(&self) -> Inhibits {
        if self.supervisor.state().motor_is_on() {
            return self.supervisor.arming_inhibits();
        }
        let limits = &self.table.limits;
        let counts = *self.controller.encoders().counts();
        let lean = self.largest_lean(&self.table.within_half_a_turn(&counts));
        self.inhibits_with_motor_off()
            .union(Inhibits::TILTED.when(lean > limits.arm_angle_rad))
            .union(self.off_centre_inhibit(&counts, limits.setpoints_m()))
    }

    /// Inhibits of turning the motor on, whatever the posture of the links.
    pub(super) fn inhibits_with_motor_off(&self) -> Inhibits {
        let is_unchecked = self.jog.sign() != MotorSign::Checked;
        self.inhibits_before_motor_check().union(Inhibits::MOTOR.when(is_unchecked))
    }

    /// The same, but without the check of the motor's sign: for the jog, which makes that check.
    pub(super) fn inhibits_before_motor_check(&self) -> Inhibits {
        self.inhibits_of_moving_rig().union(Inhibits::MOVING.when(self.moves()))
    }

    /// The same for a rig that may move.
    fn inhibits_of_moving_rig(&self) -> Inhibits {
        let state = self.supervisor.arming_inhibits();
        if self.supervisor.state().motor_is_on() {
            return state;
        }
        state
            .union(Inhibits::SIGNS.when(self.calibration.signs() != Signs::Checked))
            .union(self.input_inhibits())
            .union(Inhibits::NO_OBSERVER.when(self.table.observer.is_none()))
    }

    /// Inhibits of stilling links that move.
    pub(super) fn inhibits_in_motion(&self) -> Inhibits {
        let is_unchecked = self.jog.sign() != MotorSign::Checked;
        self.inhibits_of_moving_rig().union(Inhibits::MOTOR.when(is_unchecked))
    }

    /// Whether the rig has not been slow for long enough to begin anything.
    pub(super) fn moves(&self) -> bool {
        self.calibration.slow_ticks() < self.table.limits.arm_ticks / MOVING_PART_OF_ARM_TICKS
    }
}
