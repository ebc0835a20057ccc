//! Time: one integer unit for every clock.

/// Time since power was switched on, in units of 1/25.2 GHz: periods of 8, 12, 16, 24, 25, 84, 168, 180, 252, 336 and
/// 525 MHz are whole numbers of it. A run of twenty years fits.
pub type Time = u64;

/// Units of [`Time`] per second.
pub const UNITS_PER_SECOND: Time = 25_200_000_000;

/// Units of [`Time`] per microsecond.
pub const UNITS_PER_MICROSECOND: Time = UNITS_PER_SECOND / 1_000_000;

/// A time that is never reached.
pub(crate) const NEVER: Time = Time::MAX;

/// Period of a frequency in hertz, rounded to units.
pub(crate) fn period(hz: u32) -> Time {
    (UNITS_PER_SECOND + Time::from(hz) / 2) / Time::from(hz.max(1))
}

/// Frequency of a period in units, in hertz.
pub(crate) fn frequency(period: Time) -> u32 {
    u32::try_from(UNITS_PER_SECOND / period.max(1)).unwrap_or(u32::MAX)
}

/// Converts seconds to [`Time`], rounded down to a whole unit.
pub fn seconds(seconds: f64) -> Time {
    (seconds * UNITS_PER_SECOND as f64) as Time
}
