//! The A/D converter: the supply voltage of the power stage, and the wiper of a potentiometer.

use crate::pac::{ADC_COMMON, ADC1};
use upright::boards::wiring::Wire;

use super::chosen::BOARD;
use super::sensors::WIPER_WIRE;

/// Input 12 is the supply, input 17 the internal reference (RM0090, 13.10).
const SUPPLY: u8 = 12;
const REFERENCE: u8 = 17;

/// The reference's reading at 3.3 V, measured at the factory (datasheet, internal reference voltage).
const CALIBRATION: *const u16 = 0x1fff_7a2a as *const u16;

/// Iterations of the loop that waits for a conversion: at least 100 µs.
const PATIENCE: u32 = 5_000;
/// As above, in a tick: at least 6 µs.
const PATIENCE_IN_A_TICK: u32 = 300;

/// Input of the wiper, if there is one: 0 to 7 are PA0 to PA7 (datasheet, pin definitions).
const WIPER: Option<u8> = match WIPER_WIRE {
    Some(Wire { port: b'A', pin: pin @ 0..=7, .. }) => Some(pin),
    Some(_) => panic!("this pin is no input of the converter"),
    None => None,
};

/// The A/D converter; it makes one conversion per tick, and one more for a potentiometer.
pub(super) struct Supply {
    converter: ADC1,
    volts_per_step: f32,
}

impl Supply {
    /// Turns the converter on and measures the microcontroller's own supply, which is 3.0 V on some boards.
    pub(super) fn set_up(converter: ADC1, common: &ADC_COMMON) -> Self {
        // PCLK2 / 4 = 21 MHz; the maximum is 30 MHz (RM0090, 13.13.16). TSVREFE: the internal reference.
        // SAFETY, here and below: values within the fields described there.
        common.ccr().write(|w| unsafe { w.adcpre().bits(0b01).tsvrefe().set_bit() });
        // Input 12 is sampled for 84 cycles, enough for 1 kΩ; input 17 for 480 cycles, which is 23 µs; it needs 10 µs.
        converter.smpr1().write(|w| unsafe { w.bits(0b100 << 6 | 0b111 << 21) });
        if let Some(wiper) = WIPER {
            // 56 cycles, enough for 10 kΩ (datasheet, equation 1).
            converter.smpr2().write(|w| unsafe { w.bits(0b011 << (3 * u32::from(wiper))) });
        }
        converter.sqr3().write(|w| unsafe { w.bits(REFERENCE.into()) });
        converter.cr2().write(|w| w.adon().set_bit());
        // Converter and reference need 3 µs and 10 µs to start (datasheet, tSTAB and tSTART).
        cortex_m::asm::delay(super::CLOCK_HZ / 1_000_000 * 12);
        let mut supply = Self { converter, volts_per_step: 0.0 };
        supply.start_conversion();
        let measured = (0..PATIENCE).find_map(|_| supply.result());
        supply.converter.sqr3().write(|w| unsafe { w.bits(SUPPLY.into()) });
        // SAFETY: the chip's own data; reading them has no side effect.
        let calibration = unsafe { CALIBRATION.read_volatile() };
        supply.volts_per_step = reference_v(calibration.into(), measured.unwrap_or_default() as f32)
            * BOARD.supply_divider
            / 4096.0;
        // For the first tick.
        supply.start_conversion();
        supply
    }

    fn start_conversion(&self) {
        self.converter.cr2().write(|w| w.adon().set_bit().swstart().set_bit());
    }

    /// The result of a conversion, once it has ended; reading it clears the flag (13.13.1).
    fn result(&self) -> Option<u32> {
        let ended = self.converter.sr().read().eoc().bit_is_set();
        ended.then(|| self.converter.dr().read().bits())
    }

    /// The voltage measured in the previous tick (V); starts the next conversion, which takes 5 µs. If the converter
    /// has not finished, the voltage is 0 V.
    ///
    /// If there is a potentiometer, its reading goes to `wiper` before that; 0 if the converter has not finished.
    pub(super) fn volts(&mut self, wiper: &mut u32) -> f32 {
        let volts = self.result().unwrap_or_default() as f32 * self.volts_per_step;
        if let Some(input) = WIPER {
            // SAFETY: numbers of inputs.
            self.converter.sqr3().write(|w| unsafe { w.bits(input.into()) });
            self.start_conversion();
            *wiper = (0..PATIENCE_IN_A_TICK).find_map(|_| self.result()).unwrap_or_default();
            self.converter.sqr3().write(|w| unsafe { w.bits(SUPPLY.into()) });
        }
        self.start_conversion();
        volts
    }
}

/// The microcontroller's own supply (V), from the factory's reading of the reference and from ours. If the result is
/// impossible, for example because there is no calibration, returns the board's nominal voltage.
fn reference_v(calibration: f32, measured: f32) -> f32 {
    let volts = 3.3 * calibration / measured;
    if (2.5..3.7).contains(&volts) { volts } else { BOARD.reference_v }
}
