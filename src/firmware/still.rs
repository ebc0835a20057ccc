//! Stilling the links: the conditions for its start, one tick of it, and its end.

use super::Firmware;
use crate::board::{Inputs, Output};
use crate::supervision::calibration::links_hang;
use crate::supervision::fault::{Cause, Fault};
use crate::supervision::inhibits::Inhibits;
use crate::supervision::stilling::LONGEST_S;
use crate::table::{StillingGains, SwingUp};

/// After a command, the links are still when they have been slow for this part of `arm_ticks`, twice as long as before
/// they are raised: links without friction swing on when the motor is off. After a fall it is all of it, because the
/// motor may have to be jogged before the links can be stilled again.
const SLOW_PART_OF_ARM_TICKS: u32 = 2;
/// The links are still only while the base is within this share of the rail's length from the middle.
const MIDDLE: f32 = 0.05;

impl<'t, const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'t, NX, NY, S> {
    /// Begins to still the links. `id` is that of the command.
    pub(super) fn begin_stilling(&mut self, id: u64) -> Result<(), Inhibits> {
        let counts = *self.controller.encoders().counts();
        let inhibits = self
            .inhibits_in_motion()
            .union(self.held_inhibit(id))
            .union(Inhibits::NO_STILLING.when(self.table.stilling.is_none()))
            .union(self.off_centre_inhibit(&counts, self.table.limits.rail_m));
        self.supervisor.start_stilling(inhibits)?;
        self.restart_stiller((LONGEST_S / self.table.tick_s) as u32);
        Ok(())
    }

    /// For how many ticks the motor stills the links after this fault; 0: it goes off.
    fn ticks_after(&self, fault: Fault) -> u32 {
        let falls = fault.is_fall() && self.supervisor.state().controls();
        self.table.stilling.as_ref().filter(|_| falls).map_or(0, |gains| gains.after_fall_ticks)
    }

    /// Begins to still the links if `cause` is a fall after which the table wants that; returns whether it does.
    #[inline(never)]
    pub(super) fn stills_after(&mut self, cause: Cause) -> bool {
        let ticks = self.ticks_after(cause.fault);
        if ticks > 0 {
            self.supervisor.fall(cause);
            self.restart_stiller(ticks);
        }
        ticks > 0
    }

    /// Begins with the links as they move now.
    #[inline(never)]
    fn restart_stiller(&mut self, longest_ticks: u32) {
        let counts = *self.controller.encoders().counts();
        self.stiller.begin(&counts, longest_ticks);
        self.calibration.restart_slow(&counts);
        self.debounce.start();
        self.last_volts = 0.0;
    }

    /// A tick in which the motor stills the links. It ends when they hang and are slow.
    // Not inlined into the tick: the tool that computes the bound on the stack has to follow every jump there.
    #[inline(never)]
    pub(super) fn still(&mut self, inputs: &Inputs<NY>) {
        let table = self.table;
        let counts = self.follow();
        let Some(gains) = &table.stilling else { return self.supervisor.disarm() };
        if let Some(fault) = self.debounce.check_inputs(&table.limits, table.drive.supply_max_v(), inputs) {
            return self.trip(fault, None);
        }
        if self.hangs_still(&counts) || self.stiller.is_over() {
            return self.supervisor.disarm();
        }
        match self.still_with(gains, &counts) {
            Ok(input) => {
                let (drive, applied) = self.actuate(input, self.stiller.speed_m_per_s(), gains.speed_m_per_s);
                (self.requested_n, self.applied_n) = (input, applied);
                self.stiller.take_applied(applied);
                self.output = Output::on(drive, &table.drive);
            }
            Err((fault, sensor)) => self.trip(fault, sensor),
        }
    }

    fn still_with(
        &mut self,
        gains: &StillingGains<NY>,
        counts: &[i32; NY],
    ) -> Result<f32, (Fault, Option<u8>)> {
        let driven = self.table.drive.pulses().map(|_| self.slow_drive.speed_m_per_s());
        self.stiller.update(counts, self.table, gains, driven)
    }

    /// Whether the links hang and are slow, with the base near the middle.
    fn hangs_still(&self, counts: &[i32; NY]) -> bool {
        let has_fallen = self.supervisor.fault().is_some();
        let slow_ticks = self.table.limits.arm_ticks / if has_fallen { 1 } else { SLOW_PART_OF_ARM_TICKS };
        let [low, high] = self.table.limits.rail_m;
        let near = [-MIDDLE * (high - low), MIDDLE * (high - low)];
        links_hang(counts, &self.table.sensors)
            && self.calibration.slow_ticks() >= slow_ticks
            && self.off_centre_inhibit(counts, near).is_empty()
    }
}
