//! State of a chain of links.

use crate::numbers::{Number, Scalar};

/// State of a chain in absolute angles. A state's rate of change has the same type. On an arm, the angle of the arm
/// takes the place of the cart's position (rad, rad/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainState<const N: usize, T = f32> {
    /// Position of the cart (m).
    pub x: T,
    /// Velocity of the cart (m/s).
    pub xdot: T,
    /// Absolute angles `φ` of the links (rad).
    pub phi: [T; N],
    /// Rates `φ̇` of the absolute angles (rad/s).
    pub phidot: [T; N],
}

impl<const N: usize, T: Scalar> ChainState<N, T> {
    /// At rest with every link upright.
    pub fn upright() -> Self {
        let zero = T::default();
        Self { x: zero, xdot: zero, phi: [zero; N], phidot: [zero; N] }
    }

    /// Converts from `x, ẋ, θ_1, θ̇_1, …` with relative angles. Entries beyond 2N + 2 are ignored, missing ones are 0.
    #[inline]
    pub fn from_relative(state: &[T]) -> Self {
        let mut absolute = Self::upright();
        let mut joints = state.as_chunks::<2>().0.iter();
        if let Some(&[x, xdot]) = joints.next() {
            (absolute.x, absolute.xdot) = (x, xdot);
        }
        let (mut angle, mut rate) = (T::default(), T::default());
        for (j, joint) in joints.take(N).enumerate() {
            angle += joint[0];
            rate += joint[1];
            (absolute.phi[j], absolute.phidot[j]) = (angle, rate);
        }
        absolute
    }

    /// Writes `x, ẋ, θ_1, θ̇_1, …` with relative angles (2N + 2 entries).
    #[inline]
    pub fn write_relative(&self, state: &mut [T]) {
        let mut joints = state.as_chunks_mut::<2>().0.iter_mut();
        if let Some(cart) = joints.next() {
            *cart = [self.x, self.xdot];
        }
        let (mut angle, mut rate) = (T::default(), T::default());
        for (j, joint) in joints.take(N).enumerate() {
            *joint = [self.phi[j] - angle, self.phidot[j] - rate];
            (angle, rate) = (self.phi[j], self.phidot[j]);
        }
    }
}

impl<const N: usize, T: Number> ChainState<N, T> {
    /// `self + factor · rate`, entry by entry.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn plus(&self, factor: T, rate: &Self) -> Self {
        let mut sum = *self;
        sum.x += factor * rate.x;
        sum.xdot += factor * rate.xdot;
        for j in 0..N {
            sum.phi[j] += factor * rate.phi[j];
            sum.phidot[j] += factor * rate.phidot[j];
        }
        sum
    }
}
