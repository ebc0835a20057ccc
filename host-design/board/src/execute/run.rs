//! The processor's main loop: instructions, exceptions, sleep.

use crate::clock::{NEVER, Time};
use crate::error::{Stopped, Trap, Violation};
use crate::instruction::Op;
use crate::machine::Microcontroller;
use crate::peripherals::rcc::{SOFTWARE_FLAG, WATCHDOG_FLAG};
use crate::timing::CoreTiming;

impl Microcontroller {
    /// Runs until a time.
    pub(crate) fn run_until(&mut self, end: Time) -> Result<(), Stopped> {
        self.run(end).map_err(|violation| Stopped {
            violation,
            program_counter: self.registers.pc,
            time: self.bus.now,
        })
    }

    fn run(&mut self, end: Time) -> Result<(), Violation> {
        while self.bus.now < end {
            if self.bus.now >= self.bus.deadline {
                self.bus.advance();
            }
            if self.bus.watchdog_reset || self.bus.system.reset_requested {
                let flag = if self.bus.watchdog_reset { WATCHDOG_FLAG } else { SOFTWARE_FLAG };
                self.bus.reset(flag);
                self.reset()?;
            }
            if self.held || self.locked_up || self.bus.rcc.stopped || self.bus.debug_freeze.halted {
                self.bus.now = self.idle_until(end);
                continue;
            }
            if self.bus.now < self.stalled_until {
                self.bus.now = self.idle_until(end.min(self.stalled_until));
                continue;
            }
            if self.bus.system.nvic.changed && self.take_pending()? {
                self.bus.now += Time::from(self.cycles) * self.bus.hclk;
                self.watch.forget();
                continue;
            }
            if self.asleep {
                self.sleep(end);
                continue;
            }
            self.run_steps(end)?;
        }
        Ok(())
    }

    /// Executes instructions until an exception or a peripheral event may be due, or until `end`.
    fn run_steps(&mut self, end: Time) -> Result<(), Violation> {
        loop {
            self.step()?;
            let bus = &self.bus;
            if bus.system.nvic.changed || self.asleep || bus.now >= bus.deadline.min(end) || self.locked_up {
                return Ok(());
            }
            if bus.system.reset_requested {
                return Ok(());
            }
            if self.next < self.bus.pc && self.skips {
                self.skip_waiting(end);
            }
        }
    }

    /// The next deadline, but not beyond the end of the run.
    fn idle_until(&self, end: Time) -> Time {
        let deadline = if self.held { NEVER } else { self.bus.deadline };
        deadline.clamp(self.bus.now + 1, end.max(self.bus.now + 1))
    }

    /// WFI or WFE: wakes if an exception is pending, else advances time to the next deadline in whole clocks. The event
    /// that each exception leaves behind ends no WFI (B1.5.19), and WFE only before it sleeps.
    fn sleep(&mut self, end: Time) {
        if self.wakes() {
            self.asleep = false;
            self.bus.system.nvic.changed = true;
            return;
        }
        let until = self.idle_until(end);
        let clocks = (until - self.bus.now).div_ceil(self.bus.hclk);
        self.bus.now += clocks * self.bus.hclk;
    }

    /// Executes one instruction.
    #[inline]
    fn step(&mut self) -> Result<(), Violation> {
        let pc = self.registers.pc;
        self.bus.pc = pc;
        self.executed += 1;
        self.cycles = 1;
        let is_slow = self.bus.timing == CoreTiming::Slow;
        let it = self.registers.it;
        let done = match self.decoded_at(pc) {
            Ok(place) => {
                let instruction = self.decoded[place];
                self.next = pc.wrapping_add(instruction.length.into());
                self.registers.r[15] = pc.wrapping_add(4);
                if is_slow {
                    let last = pc.wrapping_add(u32::from(instruction.length) - 1);
                    self.cycles += self.pipeline.wait_for_result(instruction.op) + self.bus.go_on_to(last);
                }
                if it == 0 {
                    self.in_it = false;
                    self.execute(instruction.op)
                } else {
                    self.conditional(instruction.op, it)
                }
            }
            Err(trap) => Err(trap),
        };
        match done {
            Ok(()) => self.registers.pc = self.next,
            Err(Trap::Stop(violation)) => return Err(violation),
            Err(Trap::Fault(fault)) => {
                self.registers.it = it;
                self.fault(fault)?;
            }
        }
        if is_slow {
            self.bus.cache.spend(self.cycles);
        }
        self.bus.now += Time::from(self.cycles) * self.bus.hclk;
        Ok(())
    }

    /// Executes an instruction of an IT block if its condition holds.
    fn conditional(&mut self, op: Op, it: u8) -> Result<(), Trap> {
        let last = it & 15 == 8;
        let never =
            matches!(op, Op::It(_) | Op::BranchIf { .. } | Op::BranchZero { .. } | Op::ChangeMasks { .. });
        if never {
            return Err(Violation::Unpredictable(self.code_at(self.registers.pc)).into());
        }
        self.registers.advance_it();
        if !self.registers.holds(it >> 4) {
            return Ok(());
        }
        self.in_it = true;
        let straight = self.next;
        self.execute(op)?;
        if self.next != straight && !last {
            return Err(Violation::Unpredictable(self.code_at(self.registers.pc)).into());
        }
        Ok(())
    }
}
