//! The pulses of a tick, for a drive that imposes the cart's acceleration.

use super::{Controller, MotorCommand};
use crate::control::actuator::Drive;
use crate::table::{Scalar, StepMap};

impl<const NX: usize, const NY: usize, T: Scalar> Controller<'_, NX, NY, T> {
    /// The step nearest to the position that the drive is commanded while the cart has the estimated position and
    /// speed; 0 without such a drive.
    pub(super) fn nearest_step(&self) -> i32 {
        let steps = self.table.drive.pulses();
        steps.and_then(|steps| steps.nearest(self.commanded(steps))).unwrap_or_default()
    }

    /// Limits the acceleration and converts it to the pulses of this tick. Their count defines the position: each tick
    /// ends at the step nearest to the commanded position, so that what is rounded off is not lost.
    #[inline(never)]
    pub(super) fn step(&mut self, steps: &StepMap<T>, requested: T) -> MotorCommand<T> {
        let (tick_s, speed) = (self.table.tick_s, self.speed());
        self.applied = steps.limited(requested, speed, tick_s);
        let commanded_speed = speed + self.applied * steps.lead_s;
        // A state that is not a number moves nothing; the supervisor turns the motor off.
        let target = steps.nearest(self.commanded(steps) + commanded_speed * tick_s).unwrap_or(self.emitted);
        let pulses = target.wrapping_sub(core::mem::replace(&mut self.emitted, target));
        MotorCommand { requested_n: requested, applied_n: self.applied, drive: Drive::Steps(pulses) }
    }

    /// The sensor of a cart that pulses move counts the pulses: subtracts how far the command is ahead of the cart at
    /// the predicted speed (m).
    // Called in three places, and only without plain laws: one copy.
    #[inline(never)]
    pub(super) fn subtract_lead(&self, y: &mut [T; NY]) {
        if let (Some(steps), Some(cart)) = (self.table.drive.pulses(), y.first_mut()) {
            *cart -= steps.lag_s * self.speed();
        }
    }

    /// Where the cart of a drive with lag is after this tick (m): within a tick its acceleration decays. None for other
    /// drives, whose acceleration is constant.
    #[inline(never)]
    pub(super) fn cart_after_lag(&self) -> Option<T> {
        let steps = self.table.drive.pulses().filter(|steps| steps.lag_s > T::default())?;
        let mean = self.speed() + self.applied * (steps.lead_s - steps.lag_s);
        Some(self.position() + mean * self.table.tick_s)
    }

    fn position(&self) -> T {
        self.estimate.get(0).copied().unwrap_or_default()
    }

    /// The position that the drive is commanded (m).
    fn commanded(&self, steps: &StepMap<T>) -> T {
        self.position() + steps.lag_s * self.speed()
    }
}
