//! The controller: one tick from state to force.

use nalgebra::SVector;

use crate::state_feedback::{saturate, state_feedback};
use crate::table::{Build, GainTable, Law, LawGains, TableError};

/// State feedback from a checked gain table.
#[derive(Debug, Clone)]
pub struct Controller<'t, const NX: usize> {
    table: &'t GainTable<NX>,
    law: Law,
    gains: &'t LawGains<NX>,
    setpoint: f32,
    pending: f32,
}

/// A force on the cart (N), positive along +x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Force {
    /// What the control law asks for.
    pub requested: f32,
    /// What may be applied: the request within the force limit, 0 if the request is not a number.
    pub limited: f32,
}

/// A request the controller does not follow; what was set before stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rejected {
    /// The table holds no gains for this law.
    NoSuchLaw,
    /// The set-point is not a finite number.
    Setpoint,
}

impl core::fmt::Display for Rejected {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Rejected::NoSuchLaw => "the gain table does not hold this control law",
            Rejected::Setpoint => "the set-point is not a finite number",
        })
    }
}

impl core::error::Error for Rejected {}

impl<'t, const NX: usize> Controller<'t, NX> {
    /// A controller at set-point 0 with the first law the table holds (LQR before pole placement).
    ///
    /// # Errors
    /// [`TableError`] if the table is damaged or was made for another build.
    pub fn new(table: &'t GainTable<NX>, build: &Build) -> Result<Self, TableError> {
        table.check(build)?;
        let (law, gains) = match (&table.lqr, &table.pole_placement) {
            (Some(gains), _) => (Law::Lqr, gains),
            (None, Some(gains)) => (Law::PolePlacement, gains),
            (None, None) => return Err(TableError::NoLaw),
        };
        Ok(Self { table, law, gains, setpoint: 0.0, pending: 0.0 })
    }

    /// The law in use.
    pub fn law(&self) -> Law {
        self.law
    }

    /// Uses another law of the table. Only while disarmed: a change of gains in mid-balance is a jump of the force.
    ///
    /// # Errors
    /// [`Rejected::NoSuchLaw`] if the table does not hold it.
    pub fn select(&mut self, law: Law) -> Result<(), Rejected> {
        self.gains = self.table.law(law).ok_or(Rejected::NoSuchLaw)?;
        self.law = law;
        Ok(())
    }

    /// Wanted cart position (m).
    pub fn setpoint(&self) -> f32 {
        self.setpoint
    }

    /// Asks for a cart position (m).
    ///
    /// # Errors
    /// [`Rejected::Setpoint`] if it is not finite.
    pub fn set_setpoint(&mut self, position: f32) -> Result<(), Rejected> {
        if !position.is_finite() {
            return Err(Rejected::Setpoint);
        }
        self.setpoint = position;
        Ok(())
    }

    /// One tick: the force for the state `x` (m, m/s, rad, rad/s …) measured at its start.
    ///
    /// With `delay_ticks = 0` the force is applied at once and held for one tick. With 1 it is applied, and held, from
    /// the start of the next tick; the law then also feeds back the force that is still on its way:
    ///
    /// ```text
    /// u = sat(N r - K x - k_pending u_pending)
    /// ```
    pub fn tick(&mut self, x: &SVector<f32, NX>) -> Force {
        let LawGains { k, k_pending, n } = self.gains;
        let requested = state_feedback(*n, self.setpoint, k, x) - k_pending * self.pending;
        let limited = saturate(requested, self.table.force_limit_n);
        self.pending = limited;
        Force { requested, limited }
    }

    /// Forgets the force on its way, as after the motor was off.
    pub fn reset(&mut self) {
        self.pending = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{TABLE_FORMAT, column};
    use nalgebra::vector;

    const BUILD: Build = Build { rig_hash: 7, tick_s: 0.001 };

    fn table() -> GainTable<2> {
        let mut table = GainTable {
            format: TABLE_FORMAT,
            states: 2,
            rig_hash: 7,
            tick_s: 0.001,
            delay_ticks: 1,
            force_limit_n: 5.0,
            lqr: Some(LawGains { k: column([1.0, 2.0]), k_pending: 0.5, n: 1.0 }),
            pole_placement: None,
            crc: 0,
        };
        table.crc = table.checksum();
        table
    }

    #[test]
    fn the_force_on_its_way_is_fed_back() {
        let table = table();
        let mut controller = Controller::new(&table, &BUILD).unwrap();
        let x = vector![-1.0, -1.0];
        assert_eq!(controller.tick(&x).limited, 3.0);
        assert_eq!(controller.tick(&x).limited, 1.5);
        controller.reset();
        assert_eq!(controller.tick(&x).limited, 3.0);
    }

    #[test]
    fn a_limited_force_is_what_counts_as_on_its_way() {
        let table = table();
        let mut controller = Controller::new(&table, &BUILD).unwrap();
        assert_eq!(controller.tick(&vector![-100.0, 0.0]), Force { requested: 100.0, limited: 5.0 });
        assert_eq!(controller.tick(&vector![0.0, 0.0]).requested, -2.5);
    }

    #[test]
    fn a_request_that_makes_no_sense_leaves_everything_as_it_was() {
        let table = table();
        let mut controller = Controller::new(&table, &BUILD).unwrap();
        controller.set_setpoint(0.25).unwrap();
        assert_eq!(controller.set_setpoint(f32::NAN), Err(Rejected::Setpoint));
        assert_eq!(controller.select(Law::PolePlacement), Err(Rejected::NoSuchLaw));
        assert_eq!((controller.setpoint(), controller.law()), (0.25, Law::Lqr));
    }

    #[test]
    fn a_table_that_does_not_fit_is_refused() {
        let refused = |change: &dyn Fn(&mut GainTable<2>), sealed: bool| {
            let mut table = table();
            change(&mut table);
            if sealed {
                table.crc = table.checksum();
            }
            Controller::new(&table, &BUILD).err()
        };
        assert_eq!(refused(&|_| (), true), None);
        assert_eq!(refused(&|t| t.format += 1, true), Some(TableError::Format));
        assert_eq!(refused(&|t| t.states = 3, true), Some(TableError::States));
        assert_eq!(refused(&|t| t.rig_hash ^= 1, true), Some(TableError::RigHash));
        assert_eq!(refused(&|t| t.tick_s = 0.002, true), Some(TableError::Tick));
        assert_eq!(refused(&|t| t.delay_ticks = 2, true), Some(TableError::Delay));
        assert_eq!(refused(&|t| t.force_limit_n = f32::NAN, true), Some(TableError::Value));
        assert_eq!(refused(&|t| t.lqr = None, true), Some(TableError::NoLaw));
        assert_eq!(refused(&|t| t.force_limit_n = 6.0, false), Some(TableError::Crc));
    }

    #[test]
    fn every_single_bit_of_a_gain_is_guarded_by_the_checksum() {
        for bit in 0..32 {
            let mut table = table();
            if let Some(law) = &mut table.lqr {
                law.k[1] = f32::from_bits(law.k[1].to_bits() ^ 1 << bit);
            }
            assert_eq!(table.check(&BUILD), Err(TableError::Crc));
        }
    }
}
