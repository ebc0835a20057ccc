//! Boards with an STM32F405, STM32F407 or STM32F446.

mod angles;
mod chosen;
mod clock;
mod crash;
mod encoders;
mod guard;
mod memory;
mod motor;
mod pins;
mod sensors;
mod serial;
mod steps;
mod supply;
mod watchdog;

use crate::pac::{EXTI, PWR, Peripherals};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DWT, SYST};
use upright::board::{BadSamples, Board, Contacts, Inputs, Output};
pub(crate) use upright::boards::f4::TICK_US;
use upright::control::encoder::{CounterWidth, is_at_end};
use upright::flash_image::WordSums;
use upright::gains::{SENSORS, STATES};
use upright::protocol::message::Start;
use upright::table::GainTable;

use angles::Angles;
pub(crate) use clock::CLOCK_HZ;
use clock::Clock;
pub(crate) use memory::{MemoryCheck, tables};
use motor::{GIVES_PULSES, Motor};
use sensors::{ANY_IS_ABSOLUTE, ANY_IS_ON_BUS, WIPER_BITS, WIPER_WIRE};
pub(crate) use serial::{DmaBuffer, DmaLine};
use steps::Steps;
use supply::Supply;
use watchdog::Watchdog;

/// The pins and peripherals of the control task.
pub(crate) struct F4Hardware {
    motor: Motor,
    /// One, if the drive takes pulses.
    steps: [Steps; GIVES_PULSES as usize],
    /// One, if the rig has absolute sensors on the bus.
    angles: [Angles; ANY_IS_ON_BUS as usize],
    /// One, if the rig has absolute sensors.
    bad: [BadSamples<SENSORS>; ANY_IS_ABSOLUTE as usize],
    supply: Supply,
    exti: EXTI,
    power: PWR,
    watchdog: Watchdog,
    tick_s: f32,
    clock_fault: bool,
    wrong_chip: bool,
    image_is_damaged: bool,
    overrun: bool,
    /// Whether the limit switches were open at the end of the previous tick.
    limits: [bool; 2],
}

/// Sets up all peripherals but the watchdog, for ticks of so many processor cycles, with the motor off. Takes at most
/// 300 ms, even if a peripheral does not respond.
///
/// Also returns the check of memory, and what the board knows about the start.
pub(crate) fn set_up(
    device: Peripherals,
    buffer: &'static mut DmaBuffer,
    tables: [&'static GainTable<STATES, SENSORS>; 2],
    tick_cycles: u32,
) -> (F4Hardware, DmaLine, MemoryCheck, Start) {
    let tick_s = tick_cycles as f32 / CLOCK_HZ as f32;
    let rcc = &device.RCC;
    clock::enable_peripherals(rcc);
    pins::set_up(&device.SYSCFG, &device.EXTI);
    let motor = Motor::set_up(device.TIM1, tick_cycles);
    let (has_crashed, crash) = crash::take();
    let reset = clock::reset_reason(rcc, has_crashed);
    let clock = clock::set_up(rcc, &device.FLASH, &device.TIM11);
    encoders::set_up();
    let supply = Supply::set_up(device.ADC1, &device.ADC_COMMON);
    let line = serial::set_up(device.DMA1, clock.usart_bus_hz(), buffer);
    guard::watch_supply(&device.PWR, &device.EXTI);
    // SAFETY: the tick's timer belongs to RTIC and stays untouched; nothing else uses the others.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    guard::protect_stack(&core.MPU);
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let wrong_chip = !guard::chip_is_right(&device.DBGMCU);
    pins::set_status_led(clock == Clock::Full && !wrong_chip && !motor.has_failed());
    let angles: [Angles; ANY_IS_ON_BUS as usize] = core::array::from_fn(|_| Angles::new());
    angles.iter().for_each(Angles::set_up);
    // Clears flags that were set while the pull-ups charged the inputs.
    let _ = (motor.was_stopped(), pins::driver_fault_was_reported(&device.EXTI));
    // In this order: what changes in between is found by the check.
    let image = memory::words();
    let memory = MemoryCheck::new(tables, image, tick_s);
    let sums = memory::of_image(image);
    let hardware = F4Hardware {
        motor,
        steps: core::array::from_fn(|_| Steps::new(tick_cycles)),
        angles,
        bad: core::array::from_fn(|_| BadSamples::default()),
        supply,
        exti: device.EXTI,
        power: device.PWR,
        watchdog: Watchdog::new(device.IWDG, tick_s),
        tick_s,
        clock_fault: clock == Clock::Fallback,
        wrong_chip,
        image_is_damaged: sums != WordSums::carried_by(image),
        overrun: false,
        limits: [false; 2],
    };
    (hardware, line, memory, Start { reset, crash, image: sums.weighted })
}

impl F4Hardware {
    /// Starts the watchdog. Everything has to be ready for the first tick.
    pub(crate) fn start_watchdog(&self) {
        self.watchdog.start(if self.clock_fault { Clock::Fallback } else { Clock::Full });
    }
}

impl Board<SENSORS> for F4Hardware {
    const WIDTHS: [CounterWidth; SENSORS] = encoders::WIDTHS;
    const GIVES_PULSES: bool = GIVES_PULSES;
    /// See [`MemoryCheck`].
    const CHECKS_TABLES: bool = true;

    fn image_is_damaged(&self) -> bool {
        self.image_is_damaged
    }

    fn inputs(&mut self) -> Inputs<SENSORS> {
        pins::show_tick(true);
        let mut raw_counts = encoders::raw_counts();
        let mut is_late = false;
        if let ([steps], [pulses, ..]) = (self.steps.as_mut_slice(), raw_counts.as_mut_slice()) {
            (*pulses, is_late) = (steps.given(), steps.was_late());
        }
        let (mut bad, mut wiper) =
            (self.angles.first_mut().map_or(0, |angles| angles.read(&mut raw_counts)), 0);
        // Clears the flag of the current tick.
        let _ = tick_is_due();
        let [limit_low, limit_high] = pins::limits();
        let [was_low, was_high] = self.limits;
        let mut inputs = Inputs {
            raw_counts,
            supply_v: self.supply.volts(&mut wiper),
            contacts: Contacts {
                // A contact counts only if it was open at the end of the previous tick, too: a spike that a wire picks
                // up from the switching bridge must not trip.
                limit_low: limit_low & was_low,
                limit_high: limit_high & was_high,
                emergency_stop: self.motor.was_stopped() | pins::emergency_stop(),
                driver_fault: pins::driver_fault_was_reported(&self.exti) | pins::driver_fault(),
                overrun: self.overrun,
                clock_fault: self.clock_fault | is_late,
                board_fault: self.wrong_chip
                    | self.motor.has_failed()
                    | guard::supply_was_low(&self.power, &self.exti),
            },
        };
        if let (true, [_, count, ..]) = (WIPER_WIRE.is_some(), inputs.raw_counts.as_mut_slice()) {
            // In its dead band, with an open wire or with a short circuit.
            bad |= u32::from(is_at_end(wiper, WIPER_BITS)) << 1;
            *count = wiper;
        }
        if let [samples] = self.bad.as_mut_slice() {
            samples.now = bad;
        }
        inputs
    }

    fn bad_samples(&mut self) -> Option<&mut BadSamples<SENSORS>> {
        self.bad.first_mut()
    }

    fn tick_s(&self) -> f32 {
        self.tick_s
    }

    fn drive(&mut self, output: &Output) {
        match self.steps.as_mut_slice() {
            [steps] => steps.drive(&mut self.motor, output),
            _ => self.motor.drive(output),
        }
    }

    fn end_tick(&mut self) {
        self.limits = pins::limits();
        self.overrun = tick_is_due();
        pins::show_tick(false);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}

/// Starts the tick: an interrupt every `cycles` of the core clock.
pub(crate) fn start_ticks(mut timer: SYST, cycles: u32) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(cycles - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

/// Waits for an interrupt.
pub(crate) fn sleep() {
    cortex_m::asm::wfi();
}

/// Whether the tick timer has wrapped since the last call.
fn tick_is_due() -> bool {
    // SAFETY: after start-up, only the control task reads this register; reading it clears the flag.
    unsafe { (*SYST::PTR).csr.read() & 1 << 16 != 0 }
}

/// Turns the motor off for good. If the watchdog is running, it resets the microcontroller. `frame` is where the
/// processor has saved its registers, or null.
pub(crate) fn stop(frame: *const u32) -> ! {
    // SAFETY: nothing else runs any more.
    let device = unsafe { Peripherals::steal() };
    motor::off(&device.TIM1);
    crash::record(frame);
    pins::set_status_led(false);
    loop {
        cortex_m::asm::nop();
    }
}
