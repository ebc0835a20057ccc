//! A board of your own: the black STM32F407VET6 board with the encoders of a cart and one link.

use cortex_m::peripheral::SYST;
use stm32f4xx_hal::adc::{Adc, config::SampleTime};
use stm32f4xx_hal::gpio::{Analog, Input, Output as OutputPin, PA4, PB0, PB1, PB2, PB10, PB12, PB13};
use stm32f4xx_hal::pac::{ADC1, TIM1, TIM2, TIM3};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::qei::Qei;
use stm32f4xx_hal::timer::PwmChannel;
use stm32f4xx_hal::watchdog::IndependentWatchdog;
use upright::board::{Board, Contacts, Inputs, Output};
use upright::control::encoder::CounterWidth;

use own_board::gains::SENSORS;

use crate::CLOCK_HZ;

/// What the control task reads and drives.
pub struct OwnBoard {
    pub cart: Qei<TIM2>,
    pub link: Qei<TIM3>,
    pub pwm: PwmChannel<TIM1, 0>,
    pub direction: PB12<OutputPin>,
    pub enable: PB13<OutputPin>,
    pub limit_low: PB0<Input>,
    pub limit_high: PB1<Input>,
    pub emergency_stop: PB2<Input>,
    pub driver_fault: PB10<Input>,
    pub supply: (Adc<ADC1>, PA4<Analog>),
    pub watchdog: IndependentWatchdog,
    /// Set by the main loop when a tick was due before the last one had ended.
    pub overrun: bool,
}

/// Volts of the supply per millivolt at the pin, behind 10 kΩ and 1 kΩ.
const SUPPLY_V_PER_MV: f32 = 11.0e-3;

impl Board<SENSORS> for OwnBoard {
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32, CounterWidth::Bits16];

    fn inputs(&mut self) -> Inputs<SENSORS> {
        let (adc, pin) = &mut self.supply;
        let sample = adc.convert(pin, SampleTime::Cycles_56);
        Inputs {
            raw_counts: [self.cart.count(), u32::from(self.link.count())],
            supply_v: SUPPLY_V_PER_MV * f32::from(adc.sample_to_millivolts(sample)),
            // Contacts open when pressed, against a pull-up: a broken wire counts as pressed.
            contacts: Contacts {
                limit_low: self.limit_low.is_high(),
                limit_high: self.limit_high.is_high(),
                emergency_stop: self.emergency_stop.is_high(),
                driver_fault: self.driver_fault.is_low(),
                overrun: core::mem::take(&mut self.overrun),
                clock_fault: false,
                board_fault: false,
            },
        }
    }

    fn tick_s(&self) -> f32 {
        (SYST::get_reload() + 1) as f32 / CLOCK_HZ as f32
    }

    fn drive(&mut self, output: &Output) {
        self.enable.set_state(output.enable.into());
        self.direction.set_state((output.duty > 0.0).into());
        self.pwm.set_duty((output.duty.abs() * f32::from(self.pwm.get_max_duty())) as u16);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn cycles(&self) -> u32 {
        cortex_m::peripheral::DWT::cycle_count()
    }
}
