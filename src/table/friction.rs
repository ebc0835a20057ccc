//! Known Coulomb friction, which the controller compensates.

use nalgebra::SMatrix;

use crate::table::part::part;

part! {
    /// Coulomb friction of `NY` axes, the cart's and the joints', and what it does to `NX` states. At a rate ω it is
    /// taken as `-clamp(slope ω, ±coulomb)`.
    #[derive(Copy)]
    pub struct FrictionMap<NX to MX, NY to MY; T> {
        /// A column for each axis: coulomb (N or N m), slope (N s/m or N m s/rad), and the force on the cart for a
        /// friction of 1 (1 or 1/m) with the LQR and with pole placement.
        pub axes: SMatrix<T, 4, NY>,
        /// What a friction of 1, held for one tick, adds to each state: a column for each axis.
        pub effect: SMatrix<T, NX, NY>,
    }
}
