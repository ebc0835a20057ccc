//! The supply of the power stage, behind a divider of 10 kΩ and 1 kΩ.

use hal::pac::ADC;

/// Volts of the supply per step of the converter, from the Pico's 3.3 V.
const VOLTS_PER_STEP: f32 = 3.3 * 11.0 / 4096.0;

const ON: u32 = 1 << 0;
const START: u32 = 1 << 2;
const READY: u32 = 1 << 8;

/// The converter; input 0.
pub(super) struct Supply {
    converter: ADC,
}

impl Supply {
    /// Turns the converter on and starts a conversion for the first tick.
    pub(super) fn set_up(converter: ADC) -> Self {
        // SAFETY, here and below: bits of CS (4.9.6).
        converter.cs().write(|w| unsafe { w.bits(ON) });
        // Bounded: a converter that never becomes ready reports 0 V.
        let _ = (0..1000).any(|_| converter.cs().read().bits() & READY != 0);
        converter.cs().write(|w| unsafe { w.bits(ON | START) });
        Self { converter }
    }

    /// The voltage measured in the previous tick (V); starts the next conversion, which takes 2 µs. If the converter
    /// has not finished, the voltage is 0 V.
    pub(super) fn volts(&mut self) -> f32 {
        let is_ready = self.converter.cs().read().bits() & READY != 0;
        let steps = if is_ready { self.converter.result().read().bits() } else { 0 };
        self.converter.cs().write(|w| unsafe { w.bits(ON | START) });
        steps as f32 * VOLTS_PER_STEP
    }
}
