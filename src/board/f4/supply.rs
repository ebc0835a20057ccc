//! The supply voltage of the power stage.

use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, RCC};

/// Volts per step of the converter: 12 bits for 3.3 V, behind a divider of 10 kΩ and 1 kΩ.
const VOLTS_PER_STEP: f32 = 3.3 / 4096.0 * 11.0;

/// The A/D converter; it makes one conversion per tick.
pub(super) struct Supply {
    converter: ADC1,
}

impl Supply {
    /// Turns the converter on. The first tick starts the first conversion, long after the 3 µs that the converter
    /// needs.
    pub(super) fn set_up(rcc: &RCC, converter: ADC1, common: &ADC_COMMON) -> Self {
        rcc.apb2enr().modify(|_, w| w.adc1en().set_bit());
        // PCLK2 / 4 = 21 MHz; the maximum is 30 MHz (RM0090, 13.13.16).
        // SAFETY, here and below: values of the fields described there.
        common.ccr().write(|w| unsafe { w.adcpre().bits(0b01) });
        // Input 12, sampled for 84 cycles: enough for 1 kΩ.
        converter.smpr1().write(|w| unsafe { w.bits(0b100 << 6) });
        converter.sqr3().write(|w| unsafe { w.bits(12) });
        converter.cr2().write(|w| w.adon().set_bit());
        Self { converter }
    }

    /// The voltage measured in the previous tick (V); starts the next conversion, which takes 5 µs. If the converter
    /// has not finished, the voltage is 0 V.
    pub(super) fn volts(&mut self) -> f32 {
        let volts = if self.converter.sr().read().eoc().bit_is_set() {
            // Reading the result clears the flag (RM0090, 13.13.1).
            self.converter.dr().read().bits() as f32 * VOLTS_PER_STEP
        } else {
            0.0
        };
        self.converter.cr2().write(|w| w.adon().set_bit().swstart().set_bit());
        volts
    }
}
