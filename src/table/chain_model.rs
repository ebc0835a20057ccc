//! The constants of the nonlinear equations of motion.

use nalgebra::{SMatrix, SVector};

use crate::table::part::part;

part! {
    /// Constants of the equations of motion of `N` links on a cart; the equations are in [`plant`](crate::plant). Where
    /// the drive imposes the cart's acceleration, that is the input instead of the force: M_t is 1, `reaction` and d_0
    /// are 0, and `b_reduced` is `b`.
    pub struct ChainModel<N to M; T> {
        /// 1 / M_t, M_t the mass of cart and links together (1/kg).
        pub inverse_mass: T,
        /// a_j = Σ_i m_i h_ij (kg m).
        pub a: SVector<T, N>,
        /// g a_j (N m).
        pub weight: SVector<T, N>,
        /// b_jk = Σ_i m_i h_ij h_ik + δ_jk I_j, symmetric (kg m²).
        pub b: SMatrix<T, N, N>,
        /// b_jk - a_j a_k / M_t, symmetric (kg m²).
        pub b_reduced: SMatrix<T, N, N>,
        /// What the links' accelerations add to the cart's equation: a_j, or 0 where the drive imposes the cart's
        /// acceleration (kg m).
        pub reaction: SVector<T, N>,
        /// d_0, viscous friction of the cart (N s/m).
        pub cart_friction: T,
        /// d_i, viscous friction of each joint on its relative rate (N m s/rad).
        pub joint_frictions: SVector<T, N>,
    }
}
