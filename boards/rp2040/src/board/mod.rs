//! The board: the only code that accesses registers, and the only code with `unsafe`. Sections and tables are those of
//! the RP2040 datasheet; the RP2350 has the same registers, but for what is in `chip`.

#![allow(unsafe_code)]

mod angles;
#[cfg(not(rp2350))]
mod arithmetic;
mod chip;
#[cfg(not(rp2350))]
mod copying;
mod crash;
mod encoders;
mod guard;
mod memory;
mod motor;
mod pins;
mod sensors;
mod state_machine;
mod steps;
mod stop;
mod supply;
mod usb;

use crate::gains::SENSORS;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SYST};
use hal::clocks::init_clocks_and_plls;
use hal::fugit::MicrosDurationU32;
use hal::pac::{Interrupt, Peripherals};
use hal::watchdog::Watchdog;
use upright::board::{BadSamples, Board, Contacts, Inputs, Output};
pub(crate) use upright::boards::rp::TICK_US;
use upright::control::encoder::CounterWidth;
use upright::protocol::message::Start;

use angles::Angles;
pub(crate) use chip::CLOCK_HZ;
use encoders::Encoders;
pub(crate) use memory::tables;
use motor::Motor;
use pins::GIVES_PULSES;
use steps::Steps;
use stop::stop;
use supply::Supply;
pub(crate) use usb::{UsbLine as SerialLine, UsbMemory};

/// Crystal of both boards (Hz).
const CRYSTAL_HZ: u32 = 12_000_000;

/// The pins and peripherals of the control task.
pub(crate) struct Hardware {
    encoders: Encoders,
    /// One, if the rig has absolute sensors.
    angles: [Angles; sensors::ARE_THERE as usize],
    bad: [BadSamples<SENSORS>; sensors::ARE_THERE as usize],
    motor: Motor,
    supply: Supply,
    watchdog: Watchdog,
    /// Processor cycles in a tick.
    tick_cycles: u32,
    /// Ticks of the timer that were over before the tick had ended.
    wraps: u32,
    image_is_damaged: bool,
    overrun: bool,
    /// Whether the limit switches were open at the end of the previous tick.
    limits: [bool; 2],
}

/// Sets up all peripherals but the watchdog, for ticks of so many processor cycles, with the motor off. Also returns
/// what the board knows about the start.
pub(crate) fn set_up(
    device: Peripherals,
    memory: &'static mut UsbMemory,
    tick_cycles: u32,
) -> (Hardware, SerialLine, Start) {
    let (start, image_is_damaged) = crash::start(&device.WATCHDOG);
    let mut resets = device.RESETS;
    pins::set_up(&resets, &device.PADS_BANK0, &device.IO_BANK0);
    let mut watchdog = Watchdog::new(device.WATCHDOG);
    let Ok(clocks) = init_clocks_and_plls(
        CRYSTAL_HZ,
        device.XOSC,
        device.CLOCKS,
        device.PLL_SYS,
        device.PLL_USB,
        &mut resets,
        &mut watchdog,
    ) else {
        stop()
    };
    let encoders = Encoders::set_up(&device.PIO0, &device.PIO1);
    let steps = GIVES_PULSES.then(|| Steps::set_up(&device.PIO0, tick_cycles));
    let motor = Motor::set_up(&device.PWM, guard::Guard::set_up(device.PIO1, tick_cycles), steps);
    let supply = Supply::set_up(device.ADC);
    let bus = usb::bus(clocks.usb_clock, &mut resets);
    let Some(line) = SerialLine::set_up(bus, memory) else { stop() };
    let _ = pins::was_reported();
    pins::set_status_led(true);
    let hardware = Hardware {
        encoders,
        angles: core::array::from_fn(|_| Angles::set_up()),
        bad: core::array::from_fn(|_| BadSamples::default()),
        motor,
        supply,
        watchdog,
        tick_cycles,
        wraps: 0,
        image_is_damaged,
        overrun: false,
        limits: [false; 2],
    };
    (hardware, line, start)
}

impl Hardware {
    /// Starts the watchdog: three ticks and a tenth of a millisecond. Everything has to be ready for the first tick.
    pub(crate) fn start_watchdog(&mut self) {
        let tick_us = self.tick_cycles / (CLOCK_HZ / 1_000_000);
        self.watchdog.start(MicrosDurationU32::micros(3 * tick_us + 100));
    }
}

impl Board<SENSORS> for Hardware {
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32; SENSORS];
    const GIVES_PULSES: bool = GIVES_PULSES;

    fn image_is_damaged(&self) -> bool {
        self.image_is_damaged
    }

    fn inputs(&mut self) -> Inputs<SENSORS> {
        // Clears the flag of the current tick.
        let _ = tick_is_due();
        let mut raw_counts = self.encoders.raw_counts();
        if let ([angles], [bad]) = (self.angles.as_mut_slice(), self.bad.as_mut_slice()) {
            bad.now = angles.read(&mut raw_counts);
        }
        if let Some(pulses) = self.motor.pulses() {
            raw_counts[0] = pulses;
        }
        let [limit_low, limit_high] = pins::limits();
        let [was_low, was_high] = self.limits;
        let [was_stopped, was_faulty] = pins::was_reported();
        Inputs {
            raw_counts,
            supply_v: self.supply.volts(),
            contacts: Contacts {
                // A contact counts only if it was open at the end of the previous tick, too: a spike that a wire picks
                // up from the switching bridge must not trip.
                limit_low: limit_low & was_low,
                limit_high: limit_high & was_high,
                emergency_stop: was_stopped,
                driver_fault: was_faulty,
                overrun: self.overrun,
                clock_fault: false,
                board_fault: self.encoders.have_stopped() | self.motor.has_failed(),
            },
        }
    }

    fn bad_samples(&mut self) -> Option<&mut BadSamples<SENSORS>> {
        self.bad.first_mut()
    }

    fn tick_s(&self) -> f32 {
        self.tick_cycles as f32 / CLOCK_HZ as f32
    }

    fn drive(&mut self, output: &Output) {
        self.motor.drive(output);
    }

    fn end_tick(&mut self) {
        self.limits = pins::limits();
        self.overrun = tick_is_due();
        self.wraps = self.wraps.wrapping_add(self.overrun.into());
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    /// From the tick's timer, which counts down.
    fn cycles(&self) -> u32 {
        let elapsed = self.tick_cycles.wrapping_sub(SYST::get_current());
        self.wraps.wrapping_mul(self.tick_cycles).wrapping_add(elapsed)
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

/// Whether the tick timer has wrapped since the last call.
fn tick_is_due() -> bool {
    // SAFETY: after start-up, only the control task reads this register; reading it clears the flag.
    unsafe { (*SYST::PTR).csr.read() & 1 << 16 != 0 }
}

/// Keeps the bus from interrupting again before it has been served.
pub(crate) fn mask_bus() {
    NVIC::mask(Interrupt::USBCTRL_IRQ);
}

/// Waits for the next interrupt. An interrupt that comes before the wait ends it at once.
pub(crate) fn wait_for_interrupt() {
    cortex_m::interrupt::disable();
    // SAFETY: interrupts are enabled again below; the bus's handler only masks itself.
    unsafe {
        NVIC::unmask(Interrupt::USBCTRL_IRQ);
        cortex_m::asm::wfi();
        cortex_m::interrupt::enable();
    }
}
