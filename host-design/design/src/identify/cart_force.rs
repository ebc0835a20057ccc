//! What moves the cart in a step of the integration.

/// Force on the cart in a step (N), and its derivatives; or the motion that is imposed on it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct CartForce {
    /// Force (N), or an imposed acceleration (m/s²).
    pub(super) force: f64,
    /// Imposed jump of the cart's speed at the beginning of the step (m/s).
    pub(super) jump: f64,
    /// Derivative by the delay (N/tick).
    pub(super) by_delay: f64,
    /// Derivative by the dead zone (N/V).
    pub(super) by_dead_zone: f64,
    /// e: back-EMF as damping (N·s/m); 0 while the motor turns freely.
    pub(super) back_emf: f64,
}
