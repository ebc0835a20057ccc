//! What moves the cart in a step of the integration.

/// Force on the cart in a step (N), and its derivatives; or the motion that is imposed on it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct CartForce {
    /// Force (N), or an imposed acceleration (m/s²).
    pub(crate) force: f64,
    /// Imposed jump of the cart's speed at the beginning of the step (m/s).
    pub(crate) jump: f64,
    /// Derivative by the delay (N/tick).
    pub(crate) by_delay: f64,
    /// Derivative by the dead zone (N/V).
    pub(crate) by_dead_zone: f64,
    /// e: back-EMF as damping (N·s/m); 0 while the motor turns freely.
    pub(crate) back_emf: f64,
}
