//! A tick of the controller that follows a planned motion.

use super::{Controller, LawState, Mode, MotorCommand};
use crate::control::motion::Reference;

impl<const NX: usize, const NY: usize> Controller<'_, NX, NY> {
    /// First half of a tick of a started controller that follows a planned motion: as
    /// [`control_with`](Self::control_with), but with the reference and the gains of `reference`:
    ///
    /// ```text
    /// e = y - C x̂⁻,   x̂ = x̂⁻ + L_k e,   u = sat(u_k - K_k (x̂ - x_k))
    /// ```
    ///
    /// The command to a drive with lag leads, so that its force is `u` at the end of the tick.
    pub fn control_on_reference(
        &mut self,
        raw: &[u32; NY],
        reference: &Reference<NX, NY>,
        judge: impl FnOnce(&[i32; NY], &[f32; NY], &mut [f32; NY]),
    ) -> MotorCommand {
        let Mode::Running(observer) = self.mode else {
            self.encoders.update(raw);
            return Self::off();
        };
        let mut y = self.encoders.measure(raw, observer.sensors);
        self.subtract_lead(&mut y);
        let e = &mut self.innovation.data.0[0];
        *e = observer.innovation(&y, &self.estimate.data.0[0]);
        judge(self.encoders.counts(), &y, e);
        for (column, e) in reference.l.data.0.iter().zip(*e) {
            for (x, l) in self.estimate.iter_mut().zip(column) {
                *x += l * e;
            }
        }
        let mut requested = reference.u;
        for ((k, x), planned) in reference.k.iter().zip(&self.estimate).zip(&reference.x) {
            requested -= k * (x - planned);
        }
        let stays = self.table.drive.late().stays;
        if stays != 0.0 {
            requested = (requested - stays * self.state.pending) / (1.0 - stays);
        }
        self.actuate(requested)
    }

    /// Second half of such a tick: calls `finish` as [`predict_with`](Self::predict_with) does; then `predict`
    /// replaces the estimate by the one a tick later, with the given mean force (N) held.
    #[inline(always)]
    pub fn predict_on_reference(
        &mut self,
        finish: impl FnOnce(&[i32; NY], &dyn Fn() -> [f32; NY], f32),
        predict: impl FnOnce(&mut [f32; NX], f32),
    ) {
        let force = self.respond();
        let estimate = &mut self.estimate.data.0[0];
        if let Mode::Running(observer) = &self.mode {
            finish(self.encoders.counts(), &|| observer.measured(estimate), force);
        }
        let cart = self.cart_after_lag();
        predict(&mut self.estimate.data.0[0], force);
        if let (Some(cart), Some(position)) = (cart, self.estimate.get_mut(0)) {
            *position = cart;
        }
    }

    /// Removes whole turns from the joints: from now on, the counter readings `raw` stand for the positions `counts`,
    /// and the estimate is shifted by as much.
    pub fn unwind(&mut self, raw: &[u32; NY], counts: &[i32; NY]) {
        if let Mode::Running(_) = &self.mode {
            let turns = counts.iter().zip(self.encoders.counts()).map(|(new, old)| new.wrapping_sub(*old));
            for (sensor, turn) in self.table.sensors.iter().zip(turns) {
                if let Some(position) = self.estimate.get_mut(sensor.state as usize) {
                    *position += sensor.step * turn as f32;
                }
            }
        }
        self.encoders.home(raw, counts);
    }

    /// Moves the governed set-point by one tick towards the requested one, and returns it (m).
    pub fn govern(&mut self) -> f32 {
        self.state.govern(self.target, self.active.gains.setpoint_step);
        self.state.setpoint
    }

    /// Hands over to the control law, with the governed set-point at `setpoint_m` (m) and no integral; the pending
    /// force is that of the motion. The next tick has to be one of [`control_with`](Self::control_with).
    pub fn hand_over(&mut self, setpoint_m: f32) {
        self.state = LawState { setpoint: setpoint_m, pending: self.state.pending, ..LawState::default() };
    }
}
