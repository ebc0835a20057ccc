//! The board: a NUCLEO-G474RE with the encoders of a cart and one link.

use cortex_m::peripheral::DWT;
use embassy_stm32::adc::{Adc, SampleTime};
use embassy_stm32::gpio::{self, Input};
use embassy_stm32::peripherals::{ADC1, IWDG, PC0, TIM1, TIM2, TIM3};
use embassy_stm32::timer::qei::Qei;
use embassy_stm32::timer::simple_pwm::SimplePwmChannel;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, pac};
use embassy_time::Instant;
use upright::board::{Board, Contacts, Inputs, Output};
use upright::control::encoder::CounterWidth;

use crate::TICK;
use crate::gains::SENSORS;

const _: () = assert!(SENSORS == 2, "this board counts two encoders: those of the cart and of one link");

/// What the control task reads and drives.
pub(crate) struct Hardware {
    pub(crate) cart: Qei<'static, TIM2>,
    pub(crate) link: Qei<'static, TIM3>,
    pub(crate) pwm: SimplePwmChannel<'static, TIM1>,
    pub(crate) direction: gpio::Output<'static>,
    pub(crate) enable: gpio::Output<'static>,
    pub(crate) limit_low: Input<'static>,
    pub(crate) limit_high: Input<'static>,
    pub(crate) emergency_stop: Input<'static>,
    pub(crate) driver_fault: Input<'static>,
    pub(crate) converter: Adc<'static, ADC1>,
    pub(crate) supply: Peri<'static, PC0>,
    pub(crate) watchdog: IndependentWatchdog<'static, IWDG>,
    /// When the next tick is due.
    pub(crate) next_tick: Instant,
    /// Whether the last tick ended after the next one was due.
    pub(crate) is_late: bool,
}

/// Lines of the chip that note edges: the emergency stop at PB2 opens, the power stage at PB10 reports a fault.
const STOPPED: usize = 2;
const FAULTY: usize = 10;

/// Notes these edges, so that what is shorter than a tick is seen, too. No interrupt is enabled for them.
pub(crate) fn note_edges() {
    /// The port, in the registers that select it for four lines each.
    const PORT_B: u8 = 1;
    for line in [STOPPED, FAULTY] {
        pac::SYSCFG.exticr(line / 4).modify(|ports| ports.set_exti(line % 4, PORT_B));
        pac::EXTI.imr(0).modify(|lines| lines.set_line(line, true));
    }
    pac::EXTI.rtsr(0).modify(|lines| lines.set_line(STOPPED, true));
    pac::EXTI.ftsr(0).modify(|lines| lines.set_line(FAULTY, true));
}

/// Whether there has been an edge since the last call.
fn was_noted(line: usize) -> bool {
    let was_noted = pac::EXTI.pr(0).read().line(line);
    if was_noted {
        pac::EXTI.pr(0).write(|lines| lines.set_line(line, true));
    }
    was_noted
}

/// Volts of the supply per step of the converter, from 3.3 V, behind 10 kΩ and 1 kΩ.
const VOLTS_PER_STEP: f32 = 3.3 * 11.0 / 4096.0;

impl Board<SENSORS> for Hardware {
    // Of the 32 bits of TIM2, embassy's `Qei` reads 16.
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits16; SENSORS];

    fn inputs(&mut self) -> Inputs<SENSORS> {
        let steps = self.converter.blocking_read(&mut self.supply, SampleTime::CYCLES47_5);
        Inputs {
            raw_counts: [self.cart.count().into(), self.link.count().into()],
            supply_v: VOLTS_PER_STEP * f32::from(steps),
            // Contacts open when pressed, against a pull-up: a broken wire counts as pressed.
            contacts: Contacts {
                limit_low: self.limit_low.is_high(),
                limit_high: self.limit_high.is_high(),
                emergency_stop: was_noted(STOPPED) | self.emergency_stop.is_high(),
                driver_fault: was_noted(FAULTY) | self.driver_fault.is_low(),
                overrun: self.is_late,
                clock_fault: false,
                board_fault: false,
            },
        }
    }

    fn tick_s(&self) -> f32 {
        TICK.as_micros() as f32 * 1e-6
    }

    fn drive(&mut self, output: &Output) {
        self.enable.set_level(output.enable.into());
        self.direction.set_level((output.duty > 0.0).into());
        self.pwm.set_duty_cycle((output.duty.abs() * self.pwm.max_duty_cycle() as f32) as u32);
    }

    fn end_tick(&mut self) {
        self.is_late = Instant::now() >= self.next_tick;
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }

    fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}
