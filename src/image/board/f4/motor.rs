//! The motor: PWM with a dead-man timer, direction and enable.
//!
//! Every tick with the motor on restarts timer 1 for a fixed number of PWM periods, three ticks long: one-pulse mode
//! with the repetition counter (RM0090, 17.3.10, 17.3.3). When ticks stop, for whatever reason, the timer stops too,
//! at the end of a period, with its counter at 0. In PWM mode 2 the output is inactive while the counter is below the
//! compare value (17.3.9). The compare value is never 0 here, so the output stops inactive. This needs no code and no
//! other clock.
//!
//! A restart sets the counter to 0, which would cut a period short. So the counter is set back to where it was, or a
//! little nearer to where it is wanted at a restart: the time that a restart takes is not known to the clock, and what
//! it is off by would add up until restarts fall into the pulses, and cut them.
//!
//! The emergency stop is the timer's break input: it switches the output off in hardware (17.3.12). Only code can
//! switch the output on again, once the contact is closed.

use crate::pac::TIM1;
use upright::board::Output;
use upright::boards::f4::TICK_US;
use upright::boards::wiring::{Signal, wire_of};
use upright::gains::TABLE;

use super::chosen::BOARD;
use super::pins;

/// Whether the drive of the gain table takes pulses, which `steps.rs` gives in place of the PWM.
pub(super) const GIVES_PULSES: bool = TABLE.drive.pulses().is_some();

/// Approximate PWM frequency (Hz): above hearing.
const PWM_HZ: u32 = 20_000;

/// Timer clocks from reading the counter to starting it again, about.
const RESTART: u32 = 20;

/// The PWM in ticks of a certain length.
#[derive(Clone, Copy)]
struct Pwm {
    /// Timer clocks per PWM period.
    period: u32,
    /// PWM periods until the motor is off after ticks stop: those of three ticks, which fit into the 8-bit repetition
    /// counter.
    periods: u32,
}

impl Pwm {
    /// In ticks of so many processor cycles, of which the longest gives a period that fits into the timer's 16 bits.
    const fn of(tick_cycles: u32) -> Self {
        let wanted = tick_cycles / (super::CLOCK_HZ / PWM_HZ);
        let per_tick = match wanted {
            0 => 1,
            1..=85 => wanted,
            _ => 85,
        };
        Self { period: tick_cycles / per_tick, periods: 3 * per_tick }
    }

    /// Shortest inactive time of the output in each period (timer clocks): power stages with a bootstrap supply need
    /// the pause, and none can follow a pause of nanoseconds. The duty is at most 98 %.
    fn least_pause(self) -> u32 {
        self.period / 50
    }

    /// Counter wanted at a restart: the output is inactive there up to a duty of three quarters. Above it, a restart
    /// interrupts a pulse for about `RESTART`, 0.12 µs.
    fn wanted_phase(self) -> u32 {
        self.period / 5
    }

    /// Largest change of the phase in a tick (timer clocks), more than the restart's time is off by.
    fn largest_shift(self) -> u32 {
        self.period / 128
    }
}

const _: () = {
    let longest = (super::CLOCK_HZ as u64 * TICK_US[1] as u64 / 1_000_000) as u32;
    assert!(Pwm::of(longest).period <= 65_535, "the longest tick is too long for this timer");
};

/// OC1M = 111, PWM mode 2; OC1PE: compare values change with a restart, not within a period (17.4.7).
const MODE: u32 = 0b111 << 4 | 1 << 3;
/// CC1E, or CC1NE for the complementary output, which is not inverted while it is the only one enabled (17.4.9).
const OUTPUT: u32 = match wire_of(BOARD.wiring, Signal::Pwm).function.as_bytes() {
    b"TIM1_CH1" => 1,
    b"TIM1_CH1N" => 1 << 2,
    _ => panic!("the board's PWM is not at channel 1 of timer 1"),
};
/// OSSI: outputs are low instead of floating while the main output is off. The break input is active high, that is,
/// when the contact or its wire is open. LOCK level 1 keeps these settings until the next reset (17.4.18).
const PROTECTION: u32 = 1 << 13 | 1 << 12 | 1 << 10 | 0b01 << 8;
const MAIN_OUTPUT: u32 = 1 << 15;

/// Timer 1 and the pins of the power stage.
pub(super) struct Motor {
    pub(super) timer: TIM1,
    pwm: Pwm,
    on: bool,
    failed: bool,
}

impl Motor {
    /// Sets up the timer with the motor off, for ticks of so many processor cycles.
    pub(super) fn set_up(timer: TIM1, tick_cycles: u32) -> Self {
        let pwm = Pwm::of(tick_cycles);
        // SAFETY, here and below: values within the widths of the fields.
        timer.arr().write(|w| unsafe { w.bits(pwm.period - 1) });
        timer.ccr1().write(|w| unsafe { w.bits(pwm.period) });
        timer.rcr().write(|w| unsafe { w.bits(pwm.periods - 1) });
        timer.ccmr1_output().write(|w| unsafe { w.bits(MODE) });
        timer.ccer().write(|w| unsafe { w.bits(OUTPUT) });
        timer.bdtr().write(|w| unsafe { w.bits(PROTECTION) });
        let failed = !is_set_up(&timer, pwm);
        Self { timer, pwm, on: false, failed }
    }

    /// Whether the timer once did not hold what was written to it; the motor then stays off.
    pub(super) fn has_failed(&self) -> bool {
        self.failed
    }

    /// Whether the motor may be driven, if that is wanted; if not, lets it coast.
    #[inline(always)]
    pub(super) fn may_drive(&mut self, wanted: bool) -> bool {
        if wanted && !self.on {
            // Pulses change what is loaded.
            self.failed |=
                !if GIVES_PULSES { is_routed(&self.timer) } else { is_set_up(&self.timer, self.pwm) };
        }
        if !wanted || self.failed {
            off(&self.timer);
            self.on = false;
            return false;
        }
        true
    }

    /// Writes what the next update loads: PSC, ARR, RCR and CCR1. If a write is lost, lets the motor coast for good and
    /// returns false.
    pub(super) fn load(&mut self, [divider, reload, repetitions, compare]: [u32; 4]) -> bool {
        let timer = &self.timer;
        // SAFETY: values within the widths of the fields.
        timer.psc().write(|w| unsafe { w.bits(divider) });
        timer.arr().write(|w| unsafe { w.bits(reload) });
        timer.rcr().write(|w| unsafe { w.bits(repetitions) });
        timer.ccr1().write(|w| unsafe { w.bits(compare) });
        self.failed |= timer.psc().read().bits() != divider
            || timer.arr().read().bits() != reload
            || timer.rcr().read().bits() != repetitions
            || timer.ccr1().read().bits() != compare;
        self.may_drive(true)
    }

    /// Drives the motor for at most three ticks, or lets it coast.
    pub(super) fn drive(&mut self, output: &Output) {
        if !self.may_drive(output.enable) {
            return;
        }
        let Pwm { period, .. } = self.pwm;
        let (wanted, shift) = (self.pwm.wanted_phase(), self.pwm.largest_shift());
        let active = (output.duty.abs() * period as f32 + 0.5) as u32;
        let compare = period - active.min(period - self.pwm.least_pause());
        self.timer.ccr1().write(|w| unsafe { w.bits(compare) });
        let phase = if self.on { self.timer.cnt().read().bits() } else { wanted };
        // Not `clamp`, which can panic.
        let nearer = wanted.max(phase.saturating_sub(shift)).min(phase + shift);
        // The update loads the compare value and the repetition counter and sets the counter to 0 (17.4.6: UG), where
        // the output is inactive: a safe moment to change the direction.
        self.timer.egr().write(|w| w.ug().set_bit());
        pins::push_along_x(output.duty > 0.0);
        // Never beyond the period: the counter would run on to the end of its range, with the output active.
        let phase = nearer + RESTART;
        let phase = if phase < period { phase } else { 0 };
        self.timer.cnt().write(|w| unsafe { w.bits(phase) });
        // In one-pulse mode the update may have stopped the timer.
        self.timer.cr1().write(|w| w.opm().set_bit().cen().set_bit());
        self.turn_on();
    }

    /// Enables the power stage and its input.
    #[inline(always)]
    pub(super) fn turn_on(&mut self) {
        if !self.on {
            // Has no effect while the contact of the emergency stop is open.
            self.timer.bdtr().modify(|_, w| w.moe().set_bit());
            pins::enable(true);
            self.on = true;
        }
    }

    /// Whether the contact of the emergency stop has been open since the last call, even if it is closed again.
    pub(super) fn was_stopped(&self) -> bool {
        let stopped = self.timer.sr().read().bif().bit_is_set();
        if stopped {
            // Writing a zero clears this flag; writing ones leaves the others unchanged. The rest is reserved.
            // SAFETY: any combination of the flags is allowed.
            self.timer.sr().write(|w| unsafe { w.bits(0x1eff & !(1 << 7)) });
        }
        stopped
    }
}

/// Whether the timer holds what was written to it. A write can be lost: a period of 65 536 clocks instead would mean
/// full force for any duty.
fn is_set_up(timer: &TIM1, pwm: Pwm) -> bool {
    timer.arr().read().bits() == pwm.period - 1
        && timer.rcr().read().bits() == pwm.periods - 1
        && is_routed(timer)
}

/// Whether mode, output and protection are those that were written.
#[inline(always)]
fn is_routed(timer: &TIM1) -> bool {
    timer.ccmr1_output().read().bits() == MODE
        && timer.ccer().read().bits() == OUTPUT
        && timer.bdtr().read().bits() & !MAIN_OUTPUT == PROTECTION
}

/// Turns the motor off at once: the main output, the enable pin and the timer.
pub(super) fn off(timer: &TIM1) {
    timer.bdtr().modify(|_, w| w.moe().clear_bit());
    pins::enable(false);
    timer.cr1().write(|w| w.cen().clear_bit());
}
