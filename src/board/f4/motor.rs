//! The motor: PWM with a dead-man timer, direction and enable.
//!
//! Timer 1 does not run on its own. Every tick with the motor on starts it for a fixed number of PWM periods, three
//! ticks long, and the next tick restarts it: one-pulse mode with the repetition counter (RM0090, 17.3.10, 17.3.3).
//! When ticks stop, for whatever reason, the timer stops too, at the end of a period, with its counter at 0. In PWM
//! mode 2 the output is inactive while the counter is below the compare value (17.3.9). The compare value is never 0
//! here, so the output stops inactive. This needs no code and no other clock.
//!
//! The emergency stop is the timer's break input: it switches the output off in hardware (17.3.12). Only code can
//! switch the output on again, once the contact is closed.

use stm32f4xx_hal::pac::{RCC, TIM1};
use upright::board::Output;
use upright::gains::TABLE;

use super::pins;
use crate::CYCLES_PER_TICK;

/// Approximate PWM frequency (Hz): above hearing.
const PWM_HZ: u32 = 20_000;

/// PWM periods per tick: a whole number, so that a restart cuts no period short. Three ticks of them fit into the
/// 8-bit repetition counter.
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
/// PWM periods until the motor is off after ticks stop.
const PERIODS: u32 = 3 * PERIODS_PER_TICK;

/// Timer 1 and the pins of the power stage.
pub(super) struct Motor {
    timer: TIM1,
    on: bool,
}

impl Motor {
    /// Sets up the timer with the motor off.
    pub(super) fn set_up(rcc: &RCC, timer: TIM1) -> Self {
        rcc.apb2enr().modify(|_, w| w.tim1en().set_bit());
        // SAFETY, here and below: values within the widths of the fields.
        timer.arr().write(|w| unsafe { w.bits(PERIOD - 1) });
        timer.ccr1().write(|w| unsafe { w.bits(PERIOD) });
        timer.rcr().write(|w| unsafe { w.bits(PERIODS - 1) });
        // OC1M = 111, PWM mode 2; OC1PE: compare values change with a new start, not within a period (17.4.7).
        timer.ccmr1_output().write(|w| unsafe { w.bits(0b111 << 4 | 1 << 3) });
        timer.ccer().write(|w| w.cc1e().set_bit());
        // OSSI: outputs are low instead of floating while the main output is off. The break input is active high, that
        // is, when the contact or its wire is open. LOCK level 1 keeps these settings until the next reset (17.4.18).
        timer.bdtr().write(|w| unsafe { w.bits(1 << 13 | 1 << 12 | 1 << 10 | 0b01 << 8) });
        Self { timer, on: false }
    }

    /// Drives the motor for at most three ticks, or lets it coast.
    pub(super) fn drive(&mut self, output: &Output) {
        if !output.enable {
            off(&self.timer);
            self.on = false;
            return;
        }
        let duty = output.drive.duty(TABLE.force_limit_n);
        pins::push_along_x(duty > 0.0);
        // 1 … PERIOD; the module's documentation says why not 0.
        let compare = PERIOD - (duty.abs() * (PERIOD - 1) as f32) as u32;
        self.timer.ccr1().write(|w| unsafe { w.bits(compare) });
        // The update loads the compare value and the repetition counter and sets the counter to 0 (17.4.6: UG). In
        // one-pulse mode it may stop the timer, so the timer is started after it.
        self.timer.egr().write(|w| w.ug().set_bit());
        self.timer.cr1().write(|w| w.opm().set_bit().cen().set_bit());
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
            // Writing a zero clears this flag; writing ones leaves the others unchanged.
            // SAFETY: any combination of bits is allowed.
            self.timer.sr().write(|w| unsafe { w.bits(!(1 << 7)) });
        }
        stopped
    }
}

/// Turns the motor off at once: the main output, the enable pin and the timer.
pub(super) fn off(timer: &TIM1) {
    timer.bdtr().modify(|_, w| w.moe().clear_bit());
    pins::enable(false);
    timer.cr1().write(|w| w.cen().clear_bit());
}
