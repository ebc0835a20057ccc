//! The constants of the nonlinear equations of motion.

use nalgebra::{SMatrix, SVector};

use crate::table::part::part;

part! {
    /// Constants of the equations of motion of `N` links on a cart or an arm; the equations are in
    /// [`plant`](crate::plant). The units are those of a cart: on an arm, the base moves by an angle, so that rad takes
    /// the place of m, N m that of N, and kg m² that of kg. Where the drive imposes the base's acceleration, that is
    /// the input instead of the force: M_t is 1, `reaction` and d_0 are 0, and `b_reduced` is `b`.
    #[derive(Copy)]
    pub struct ChainModel<N to M; T> {
        /// 1 / M_t, M_t the mass of cart and links together (1/kg).
        pub inverse_mass: T,
        /// a_j = Σ_i m_i r_i h_ij, with r_i = 1 on a cart and the radius of link i on an arm (kg m).
        pub a: SVector<T, N>,
        /// g Σ_i m_i h_ij (N m).
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
        /// What the turning of an arm adds; none on a cart.
        pub turning: Option<Turning<N, T>>,
    }
}

part! {
    /// What the turning of an arm adds to the equations of its links: the kinetic energy
    /// ½ α̇² Σ_jk β_jk sin φ_j sin φ_k of links that turn about the arm's axis while they lean away from the vertical.
    #[derive(Copy)]
    pub struct Turning<N to M; T> {
        /// β_jk = Σ_i m_i h_ij h_ik + δ_jk (I_j - I_j of the turn about the link's own length), symmetric (kg m²).
        pub beta: SMatrix<T, N, N>,
        /// Share of it that acts on the arm: 1, or 0 where the drive imposes the arm's acceleration.
        pub reaction: T,
    }
}
