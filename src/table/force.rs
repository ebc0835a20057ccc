//! The force on the cart: its limit, and when it acts.

use crate::numbers::Scalar;
use crate::table::part::part;

part! {
    /// A force on the cart.
    #[derive(Copy)]
    pub struct ForceMap<; T> {
        /// Largest force on the cart (N).
        pub limit_n: T,
        /// What a delay or a lag leaves of it for later.
        pub late: Late<T>,
    }
}

part! {
    /// A force that acts late: a part of it is pending at the end of the tick in which it is commanded.
    #[derive(Copy)]
    pub struct Late<; T> {
        /// Share of the pending force in the mean force of a tick: 0 for a force that acts at once, 1 if it acts a tick
        /// later, `τ/T (1 - e^(-T/τ))` if it follows with the lag τ, and up to 1.2 with both.
        pub acts: T,
        /// Share of the pending force that is still pending after a tick: `e^(-T/τ)` with the lag τ, 0 without.
        pub stays: T,
    }
}

impl<T: Scalar> Late<T> {
    /// A force that acts at once.
    pub fn none() -> Self {
        Self { acts: T::default(), stays: T::default() }
    }
}

impl Late {
    /// Whether both are shares. With delay and lag, the first one is above 1.
    pub(crate) fn is_sound(&self) -> bool {
        [0.8 * self.acts, self.stays].iter().all(|share| (0.0..=1.0).contains(share))
    }
}
