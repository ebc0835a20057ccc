//! The pulses of a tick, for a drive that imposes the cart's acceleration.

use super::{Controller, MotorCommand};
use crate::control::actuator::Drive;
use crate::table::{Scalar, StepMap};

impl<const NX: usize, const NY: usize, T: Scalar> Controller<'_, NX, NY, T> {
    /// The step nearest to the cart's position; 0 without such a drive.
    pub(super) fn nearest_step(&self) -> i32 {
        self.table.steps.as_ref().and_then(|steps| steps.nearest(self.position())).unwrap_or_default()
    }

    /// Limits the acceleration and converts it to the pulses of this tick. Their count defines the position: each tick
    /// ends at the step nearest to the predicted position, so that what is rounded off is not lost.
    #[inline(never)]
    pub(super) fn step(&mut self, steps: &StepMap<T>, requested: T) -> MotorCommand<T> {
        let (tick_s, speed) = (self.table.tick_s, self.speed());
        self.applied = steps.limited(requested, speed, tick_s);
        let mean = speed + T::from_f32(0.5) * self.applied * tick_s;
        // A state that is not a number moves nothing; the supervisor turns the motor off.
        let target = steps.nearest(self.position() + mean * tick_s).unwrap_or(self.emitted);
        let pulses = target.wrapping_sub(core::mem::replace(&mut self.emitted, target));
        MotorCommand { requested_n: requested, applied_n: self.applied, drive: Drive::Steps(pulses) }
    }

    /// The cart's position (m).
    fn position(&self) -> T {
        self.estimate.get(0).copied().unwrap_or_default()
    }
}
