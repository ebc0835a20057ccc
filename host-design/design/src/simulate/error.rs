//! Why a simulation cannot be run.

use upright::control::controller::Rejected;
use upright::table::TableError;

use crate::plant::PlantError;

/// Largest number of ticks of a run: over an hour at 1 ms, and a record of some 450 MB for a quadruple pendulum.
pub(super) const MAX_TICKS: u32 = 4_000_000;

/// A run that cannot be started.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// There is no compiled plant with this number of links.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The firmware refuses the table.
    #[error("the firmware refuses the table: {0}")]
    Table(#[from] TableError),
    /// The firmware refuses a command of the scenario.
    #[error("the firmware rejects the scenario: {0}")]
    Rejected(#[from] Rejected),
    /// A standard deviation that is negative or not finite.
    #[error("a noise level of {0} is not possible: give a number of at least 0")]
    Noise(f64),
    /// A disturbing force that is not finite.
    #[error("a constant force of {0} N is not possible: give a finite number")]
    Offset(f64),
    /// A motor that stops the cart far too fast.
    #[error(
        "the back-EMF of the motor stops the cart within {within_s:.1e} s, a tick has {period_s} s; without load, the motor \
         moves it at no more than {speed_m_per_s:.1e} m/s: check gear_ratio, pulley_radius_m and resistance_ohm"
    )]
    StiffMotor {
        /// Time constant of the cart with the motor's terminals held at a voltage (s).
        within_s: f64,
        /// Control period (s).
        period_s: f64,
        /// Speed of the cart without load at full supply (m/s).
        speed_m_per_s: f64,
    },
    /// A run with the whole state measured, of a drive that counts its own pulses.
    #[error(
        "with kind = \"acceleration\", all that the controller knows of the cart is its own pulses, so it cannot measure \
         the whole state: leave --full-state out"
    )]
    FullState,
    /// The same without an observer.
    #[error(
        "with kind = \"acceleration\", all that the controller knows of the cart is its own pulses, so it needs an \
         observer: add [kalman] with acceleration_noise_m2_per_s3 and joint_noise, and give each link its encoder"
    )]
    NoObserver,
    /// A run whose record would not fit into memory.
    #[error("a run of {duration_s} s has more than {MAX_TICKS} ticks of {period_s} s: shorten it")]
    TooLong {
        /// Duration of the run (s).
        duration_s: f64,
        /// Control period (s).
        period_s: f64,
    },
    /// The firmware is not compiled for these dimensions on the host.
    #[error("no firmware for {states} states and {sensors} sensors")]
    Size {
        /// States of the table.
        states: usize,
        /// Sensors of the table.
        sensors: usize,
    },
}
