//! The motor: PWM with a dead-man timer, direction and enable.
//!
//! Timer 1 does not run by itself. Every tick with the motor on starts it for a fixed number of PWM periods, three ticks
//! long at most, and the next tick restarts it: one-pulse mode with the repetition counter (RM0090, 17.3.10, 17.3.3).
//! When ticks stop, for whatever reason, the timer stops too, at the end of a period with its counter at 0. In PWM mode 2
//! the output is inactive while the counter is below the compare value (17.3.9), which is never 0 here: it stops inactive.
//! No code takes part in that, and no other clock.
//!
//! The emergency stop is the timer's break input: it takes the output away without code (17.3.12), and only code gives it
//! back, once the contact is closed again.

use stm32f4xx_hal::pac::{RCC, TIM1};
use upright::board::Output;
use upright::gains::TABLE;

use super::pins;
use crate::CYCLES_PER_TICK;

/// Frequency that the PWM comes near to (Hz): above hearing.
const PWM_HZ: u32 = 20_000;

/// PWM periods per tick: a whole number, so that a restart cuts no period short. Three ticks of them fit into the
/// repetition counter of 8 bits.
const PERIODS_PER_TICK: u32 = {
    let wanted = CYCLES_PER_TICK / (super::CLOCK_HZ / PWM_HZ);
    if wanted == 0 {
        1
    } else if wanted > 85 {
        85
    } else {
        wanted
    }
};
/// Timer clocks per PWM period.
const PERIOD: u32 = CYCLES_PER_TICK / PERIODS_PER_TICK;
const _: () =
    assert!(PERIOD <= 65_535, "tick.period_s: this board's PWM cannot be kept up over so long a tick");
/// Periods until the motor is off when ticks stop.
const PERIODS: u32 = 3 * PERIODS_PER_TICK;

/// Timer 1 and the pins of the power stage.
pub(super) struct Motor {
    timer: TIM1,
    on: bool,
}

impl Motor {
    /// Motor off.
    pub(super) fn set_up(rcc: &RCC, timer: TIM1) -> Self {
        rcc.apb2enr().modify(|_, w| w.tim1en().set_bit());
        // SAFETY, here and below: values within the widths of the fields.
        timer.arr().write(|w| unsafe { w.bits(PERIOD - 1) });
        timer.ccr1().write(|w| unsafe { w.bits(PERIOD) });
        timer.rcr().write(|w| unsafe { w.bits(PERIODS - 1) });
        // OC1M = 111, PWM mode 2; OC1PE: compare values change with a new start, not within a period (17.4.7).
        timer.ccmr1_output().write(|w| unsafe { w.bits(0b111 << 4 | 1 << 3) });
        timer.ccer().write(|w| w.cc1e().set_bit());
        // OSSI: low, instead of floating, while the main output is off. The break input is active when high, that is,
        // when the contact or its wire is open. LOCK level 1 keeps it so until the next reset (17.4.18).
        timer.bdtr().write(|w| unsafe { w.bits(1 << 13 | 1 << 12 | 1 << 10 | 0b01 << 8) });
        Self { timer, on: false }
    }

    /// Drives the motor for three ticks at most, or lets it coast.
    pub(super) fn drive(&mut self, output: &Output) {
        if !output.enable {
            off(&self.timer);
            self.on = false;
            return;
        }
        let duty = output.drive.duty(TABLE.force_limit_n);
        pins::push_along_x(duty > 0.0);
        // 1 … PERIOD: see above why not 0.
        let compare = PERIOD - (duty.abs() * (PERIOD - 1) as f32) as u32;
        self.timer.ccr1().write(|w| unsafe { w.bits(compare) });
        // The update loads the compare value and the repetition counter and sets the counter to 0 (17.4.6: UG). In
        // one-pulse mode it may stop the timer, so the start comes after it.
        self.timer.egr().write(|w| w.ug().set_bit());
        self.timer.cr1().write(|w| w.opm().set_bit().cen().set_bit());
        if !self.on {
            // Without effect while the emergency stop is open.
            self.timer.bdtr().modify(|_, w| w.moe().set_bit());
            pins::enable(true);
            self.on = true;
        }
    }

    /// Whether the emergency stop has been open since the last call, even if it is closed again.
    pub(super) fn was_stopped(&self) -> bool {
        let stopped = self.timer.sr().read().bif().bit_is_set();
        if stopped {
            // Writing a zero clears this flag; the others keep their value with a one.
            // SAFETY: any combination is allowed.
            self.timer.sr().write(|w| unsafe { w.bits(!(1 << 7)) });
        }
        stopped
    }
}

/// Motor off at once: the main output, the enable pin, and the timer.
pub(super) fn off(timer: &TIM1) {
    timer.bdtr().modify(|_, w| w.moe().clear_bit());
    pins::enable(false);
    timer.cr1().write(|w| w.cen().clear_bit());
}
