//! The drive of the cart: what the controller commands it, and what becomes of the command.

use crate::numbers::Scalar;
use crate::table::force::{ForceMap, Late};
use crate::table::motor::MotorMap;
use crate::table::part::part;
use crate::table::steps::StepMap;

/// Highest supply voltage as a multiple of the table's. There, forces are larger by the same factor; most power stages
/// and brake choppers have their limit above it.
const OVER_VOLTAGE: f32 = 1.25;

part! {
    /// The drive of the cart, by what it holds during a tick.
    pub enum DriveMap<T> {
        /// A force: a power stage controls the motor's current, or the rig says nothing about its motor.
        Force(map: ForceMap<T>) = 0,
        /// A voltage: a motor whose constants are known.
        Volts(map: MotorMap<T>) = 1,
        /// The cart's acceleration, by step pulses. It is the input of the plant instead of the force.
        Pulses(map: StepMap<T>) = 2,
    }
}

impl<T: Scalar> DriveMap<T> {
    /// The force that it commands (N), directly or by a voltage.
    pub fn force(&self) -> Option<&ForceMap<T>> {
        match self {
            DriveMap::Force(force) | DriveMap::Volts(MotorMap { force, .. }) => Some(force),
            DriveMap::Pulses(_) => None,
        }
    }

    /// Its pulses, if it moves the cart by pulses: also while no law commands it, and to where it counts them itself.
    pub const fn pulses(&self) -> Option<&StepMap<T>> {
        match self {
            DriveMap::Pulses(steps) => Some(steps),
            DriveMap::Force(_) | DriveMap::Volts(_) => None,
        }
    }

    /// What of a command acts later: only of a force.
    pub fn late(&self) -> Late<T> {
        self.force().map_or_else(Late::none, |force| force.late)
    }
}

impl DriveMap {
    /// Largest force on the cart (N); [`f32::MAX`] where none is commanded.
    #[inline]
    pub fn largest_force_n(&self) -> f32 {
        match self {
            DriveMap::Force(force) => force.limit_n,
            DriveMap::Volts(motor) => motor.force.limit_n,
            DriveMap::Pulses(_) => f32::MAX,
        }
    }

    /// Largest input of the plant: a force (N), or an acceleration (m/s²).
    pub fn largest_input(&self) -> f32 {
        self.pulses().map_or(self.largest_force_n(), |steps| steps.acceleration_limit_m_per_s2)
    }

    /// The sensor that shows what the motor does (0: cart, 1: first link …). The count of a drive with pulses is what
    /// it was told, so that only the links show what it has done.
    pub fn witness(&self) -> usize {
        usize::from(self.pulses().is_some())
    }

    /// Supply voltage of the power stage that the table was designed for (V), if that matters.
    pub fn supply_v(&self) -> Option<f32> {
        match self {
            DriveMap::Volts(motor) => Some(motor.supply_v),
            DriveMap::Force(_) | DriveMap::Pulses(_) => None,
        }
    }

    /// Highest supply voltage of the power stage (V); no limit without motor data. A motor that brakes feeds its energy
    /// back and raises it.
    #[inline]
    pub fn supply_max_v(&self) -> f32 {
        self.supply_v().map_or(f32::INFINITY, |supply_v| OVER_VOLTAGE * supply_v)
    }

    /// Whether every input maps to a command.
    pub(crate) fn is_sound(&self) -> bool {
        match self {
            DriveMap::Force(force) => force.limit_n > 0.0,
            DriveMap::Volts(motor) => motor.force.limit_n > 0.0 && motor.is_sound(),
            DriveMap::Pulses(steps) => steps.is_sound(),
        }
    }
}
