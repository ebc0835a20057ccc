//! The bus: everything that the core addresses (memory and peripherals), and the time.

mod memory;
mod registers;
mod signals;

use crate::angle_sensor::AngleSensor;
use crate::chip::Chip;
use crate::clock::{NEVER, Time};
use crate::error::{Note, Rules, Stopped, Strictness, Trap, Violation};
use crate::peripherals::adc::Adc;
use crate::peripherals::capture_timer::CaptureTimer;
use crate::peripherals::dma::Dma;
use crate::peripherals::encoder_timer::{EncoderTimer, Shaft};
use crate::peripherals::exti::Exti;
use crate::peripherals::gpio::Port;
use crate::peripherals::iwdg::Iwdg;
use crate::peripherals::power::{BrownOut, Power};
use crate::peripherals::pwm_timer::PwmTimer;
use crate::peripherals::rcc::{Crystal, Rcc};
use crate::peripherals::usart::Usart;
use crate::processor::flash_cache::FlashCache;
use crate::processor::system::System;
use crate::register_sensor::RegisterSensor;
use crate::timing::CoreTiming;
use crate::wiring::{BoardWiring, Pin};

/// Number of ports, A to I.
pub(crate) const PORTS: usize = 9;

/// Times for which the motor's outputs have been high since power-on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Driven {
    /// Time with PWM high, enable high and direction high.
    pub along: Time,
    /// Time with PWM high, enable high and direction low.
    pub against: Time,
    /// Time with PWM high, whatever enable says.
    pub pwm_high: Time,
    /// Time with enable high.
    pub enabled: Time,
}

/// A pulse of the motor timer's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pulse {
    /// When it begins.
    pub at: Time,
    /// How long it is; `None` while it lasts.
    pub width: Option<Time>,
    /// Level of the direction pin; high is along +x.
    pub along: bool,
    /// When the direction pin got this level.
    pub turned_at: Time,
    /// Level of the enable pin.
    pub enabled: bool,
}

/// What differs from board to board and from power-on to power-on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// The chip.
    pub chip: Chip,
    /// What is connected to it.
    pub wiring: &'static BoardWiring,
    /// Clock source at HSE.
    pub crystal: Crystal,
    /// Actual frequency of HSI, the internal oscillator of nominally 16 MHz (Hz).
    pub hsi_hz: u32,
    /// Actual frequency of LSI, the watchdog's oscillator (Hz): 17 000 to 47 000.
    pub lsi_hz: u32,
    /// Seed of everything random: contents of memory and registers at power-on, levels of floating pins.
    pub seed: u64,
    /// Supply voltage of the chip at power-on (V).
    pub chip_v: f32,
    /// The brown-out level in the option bytes.
    pub brown_out: BrownOut,
    /// How long instructions take.
    pub timing: CoreTiming,
    /// Whether the chip holds the factory's calibration of the reference (VREFIN_CAL); for negative controls.
    pub is_calibrated: bool,
}

/// The debugger's halt, and what freezes with it (DBGMCU; RM0090, 38.16).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct DebugFreeze {
    /// CR, APB1_FZ and APB2_FZ.
    registers: [u32; 3],
    /// The debugger has halted the core.
    pub(crate) halted: bool,
}

/// DBG_IWDG_STOP
const FREEZES_WATCHDOG: u32 = 1 << 12;

/// Memory, peripherals and time.
#[derive(Debug, Clone)]
pub(crate) struct Bus {
    pub(crate) now: Time,
    /// Period of the core's clock.
    pub(crate) hclk: Time,
    /// Time of the next event in a peripheral.
    pub(crate) deadline: Time,
    /// A register was read whose value can change at any time, such as a counter.
    pub(crate) unstable: bool,
    /// A register was changed: by a write, by a read with side effects, or by an event in a peripheral.
    pub(crate) touched: bool,
    pub(crate) pc: u32,
    pub(crate) rules: Rules,
    pub(crate) notes: Vec<Note>,
    pub(crate) chip: Chip,
    is_calibrated: bool,
    pub(crate) wiring: &'static BoardWiring,
    pub(crate) noise: u64,
    pub(crate) flash: Vec<u8>,
    pub(crate) sram: Vec<u8>,
    core_coupled: Vec<u8>,
    /// Contents of the reserved space that ends at the SRAM; empty unless it behaves as memory.
    pub(crate) below_sram: Vec<u8>,
    pub(crate) timing: CoreTiming,
    pub(crate) cache: FlashCache,
    pub(crate) system: System,
    pub(crate) rcc: Rcc,
    flash_control: u32,
    pub(crate) debug_freeze: DebugFreeze,
    pub(crate) ports: Vec<Port>,
    pub(crate) exti: Exti,
    pub(crate) pwm: PwmTimer,
    pub(crate) encoders: [EncoderTimer; 5],
    pub(crate) shafts: Vec<Shaft>,
    angle_sensors: Vec<AngleSensor>,
    /// Those on two wires, by their data wires.
    register_sensors: Vec<(Pin, RegisterSensor)>,
    capture: CaptureTimer,
    pub(crate) adc: Adc,
    pub(crate) usart: Usart,
    pub(crate) dma: Dma,
    pub(crate) iwdg: Iwdg,
    pub(crate) power: Power,
    pub(crate) driven: Driven,
    driven_until: Time,
    /// Level of the direction pin, and when it got it.
    direction: (bool, Time),
    /// Recorded pulses, if there are to be any.
    pub(crate) pulses: Vec<Pulse>,
    /// The watchdog has requested a reset.
    pub(crate) watchdog_reset: bool,
    /// Address of a register whose next write is lost.
    pub(crate) lost_write: Option<u32>,
    /// Whether reads of that register then return the lost value: for negative controls.
    pub(crate) lost_write_is_hidden: bool,
    /// Address and value of a lost write that reads return.
    hidden: Option<(u32, u32)>,
}

impl Bus {
    pub(crate) fn new(conditions: &Conditions, rules: Rules, image: &[(u32, Vec<u8>)]) -> Self {
        let Conditions { chip, wiring, .. } = *conditions;
        let mut noise = conditions.seed | 1;
        let mut random = |bytes: usize| (0..bytes).map(|_| next_noise(&mut noise) as u8).collect::<Vec<_>>();
        let (sram, core_coupled) = (random(128 << 10), random(chip.core_coupled_bytes()));
        let mut flash = vec![0xff; chip.flash_bytes()];
        for (address, bytes) in image {
            let begin = (address & 0x07ff_ffff) as usize;
            if let Some(place) = flash.get_mut(begin..begin + bytes.len()) {
                place.copy_from_slice(bytes);
            }
        }
        let rcc = Rcc::new(chip, conditions.crystal, conditions.hsi_hz);
        let shafts = vec![Shaft::default(); wiring.encoders.len()];
        Self {
            now: 0,
            hclk: rcc.hclk(),
            deadline: 0,
            unstable: false,
            touched: true,
            pc: 0,
            rules,
            notes: Vec::new(),
            chip,
            wiring,
            noise,
            flash,
            sram,
            core_coupled,
            below_sram: Vec::new(),
            timing: conditions.timing,
            cache: FlashCache::new(conditions.timing),
            system: System::new(),
            rcc,
            flash_control: 0,
            debug_freeze: DebugFreeze::default(),
            ports: (0..PORTS as u8).map(|i| Port::new(b'A' + i)).collect(),
            exti: Exti::default(),
            pwm: PwmTimer::new(wiring.is_complementary()),
            encoders: [true, false, false, true, false].map(EncoderTimer::new),
            shafts,
            angle_sensors: Vec::new(),
            register_sensors: Vec::new(),
            capture: CaptureTimer::new(),
            adc: Adc::default(),
            usart: Usart::new(),
            dma: Dma::of_usart(wiring.usart),
            iwdg: Iwdg::new(conditions.lsi_hz),
            power: Power::new(chip, conditions.chip_v, conditions.brown_out),
            is_calibrated: conditions.is_calibrated,
            driven: Driven::default(),
            driven_until: 0,
            direction: (false, 0),
            pulses: Vec::new(),
            watchdog_reset: false,
            lost_write: None,
            lost_write_is_hidden: false,
            hidden: None,
        }
    }

    /// A system reset: registers take their reset values, memory is kept; `flags` are the reset flags to set.
    pub(crate) fn reset(&mut self, flags: u32) {
        self.settle_output();
        let mpu_is_ignored = self.system.mpu.ignored;
        self.system = System::new();
        self.system.mpu.ignored = mpu_is_ignored;
        self.rcc.reset(flags | crate::peripherals::rcc::PIN_FLAG);
        self.cache = FlashCache::new(self.timing);
        self.flash_control = 0;
        for (i, port) in self.ports.iter_mut().enumerate() {
            port.reset(b'A' + i as u8);
        }
        self.exti = Exti::default();
        self.pwm.reset(self.now);
        self.encoders = [true, false, false, true, false].map(EncoderTimer::new);
        self.capture = CaptureTimer::new();
        self.adc.reset();
        self.usart.reset();
        self.dma = Dma::of_usart(self.wiring.usart);
        self.iwdg.reset();
        self.power.reset();
        self.debug_freeze = DebugFreeze { halted: self.debug_freeze.halted, ..DebugFreeze::default() };
        self.watchdog_reset = false;
        self.hclk = self.rcc.hclk();
        self.levels_changed();
        self.refresh();
    }

    /// Cycles for which a branch to `target` waits for the flash.
    #[inline]
    pub(crate) fn instruction_wait(&mut self, target: u32) -> u32 {
        if target >> 24 == 8 { self.cache.jump(target) } else { 0 }
    }

    /// Cycles for which the instruction whose last byte is at `address` waits for the flash, by [`CoreTiming::Slow`].
    #[inline]
    pub(crate) fn go_on_to(&mut self, address: u32) -> u32 {
        if address >> 24 == 8 { self.cache.go_on_to(address) } else { 0 }
    }

    /// DSB: writes to the clock-enable registers have taken effect.
    pub(crate) fn writes_are_through(&mut self) {
        self.rcc.writes_are_through(self.now);
    }

    /// Treats a violation that hardware tolerates as `rule` says.
    pub(crate) fn tolerate(&mut self, rule: Strictness, violation: Violation) -> Result<(), Trap> {
        match rule {
            Strictness::Stop => return Err(violation.into()),
            Strictness::Allow => return Ok(()),
            Strictness::Note => {}
        }
        let stopped = Stopped { violation, program_counter: self.pc, time: self.now };
        let known = self.notes.iter_mut().find(|note| {
            note.stopped.program_counter == stopped.program_counter && note.stopped.violation == violation
        });
        match known {
            Some(note) => note.count += 1,
            None => self.notes.push(Note { stopped, count: 1 }),
        }
        Ok(())
    }

    /// The debugger halts the core or resumes it. SysTick stops with the core, the watchdog only with DBG_IWDG_STOP.
    pub(crate) fn halt(&mut self, halted: bool) {
        self.debug_freeze.halted = halted;
        self.system.systick.freeze(halted, self.now);
        self.iwdg.freeze(halted && self.debug_freeze.registers[1] & FREEZES_WATCHDOG != 0, self.now);
        self.refresh();
    }

    /// The vector of an exception; that of number 0 is the initial stack pointer.
    pub(crate) fn vector(&mut self, exception: usize) -> Result<u32, Violation> {
        let address = self.system.vtor + 4 * exception as u32;
        self.peek(address).ok_or(Violation::Unmapped(address))
    }

    /// Processes all events that are due.
    pub(crate) fn advance(&mut self) {
        let now = self.now;
        self.touched = true;
        self.system.advance(now, self.hclk);
        self.rcc.advance(now);
        let apb1 = self.rcc.pclk(crate::peripherals::rcc::Domain::Apb1);
        let connected = self.serial_connected();
        self.usart.advance(now, apb1, connected);
        let ports = &self.ports;
        let channels = |channel: usize| match crate::wiring::analog_pin(channel) {
            Some(pin) => ports[pin.port].mode_of(pin.number) == 3,
            None => true,
        };
        self.adc.advance(now, channels);
        let tick = self.rcc.timer_clock(crate::peripherals::rcc::Domain::Apb2);
        self.capture.advance(now, tick, self.rcc.hse_for_rtc());
        if self.iwdg.advance(now) {
            self.watchdog_reset = true;
        }
        self.move_by_dma();
        self.refresh();
    }

    /// Updates the interrupt lines and the next deadline after a change.
    pub(crate) fn refresh(&mut self) {
        self.system.nvic.line(36 + usize::from(self.wiring.usart), self.usart.interrupt());
        for (interrupt, high) in self.dma.interrupts() {
            self.system.nvic.line(interrupt, high);
        }
        for (interrupt, high) in self.exti.interrupts() {
            self.system.nvic.line(interrupt, high);
        }
        if self.rcc.security_pending() {
            self.system.nvic.pend(crate::processor::nvic::NMI);
        }
        self.deadline = self
            .system
            .systick
            .deadline()
            .min(self.rcc.deadline())
            .min(self.usart.deadline())
            .min(self.adc.deadline())
            .min(self.capture.deadline(self.now, self.rcc.hse_for_rtc()))
            .min(if self.watchdog_reset { NEVER } else { self.iwdg.deadline() });
    }

    fn move_by_dma(&mut self) {
        let (receive, transmit) = self.dma.serial();
        if let Some(address) = self.dma.next(receive).filter(|_| self.usart.wants_fetch()) {
            let byte = self.usart.fetch();
            self.poke(address, byte);
            self.dma.moved(receive);
        }
        while self.usart.wants_byte() {
            let Some(address) = self.dma.next(transmit) else { break };
            let byte = self.peek(address & !3).unwrap_or(0).to_le_bytes()[address as usize & 3];
            let apb1 = self.rcc.pclk(crate::peripherals::rcc::Domain::Apb1);
            self.usart.transmit(byte, self.now, apb1);
            self.dma.moved(transmit);
        }
    }

    /// A pseudo-random number of 32 bits.
    pub(crate) fn random(&mut self) -> u64 {
        next_noise(&mut self.noise)
    }
}

/// Xorshift: good enough for values that no program should rely on.
fn next_noise(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32
}
