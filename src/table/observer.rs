//! Model and gain of the observer.

use nalgebra::{SMatrix, SVector};

use crate::table::part::part;

part! {
    /// Model and gain of the observer for `NX` states and `NY` sensors: a steady-state Kalman filter in filter form.
    #[derive(Copy)]
    pub struct ObserverGains<NX to MX, NY to MY; T> {
        /// Ad of `x⁺ = Ad x + Bd u` over one tick: a column for each state now, a row for each state a tick later.
        pub ad: SMatrix<T, NX, NX>,
        /// Bd, what one newton held for one tick adds to each state.
        pub bd: SVector<T, NX>,
        /// L of `x̂ = x̂⁻ + L e`: a column for each sensor, a row for each state.
        pub l: SMatrix<T, NX, NY>,
    }
}
