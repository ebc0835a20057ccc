//! The board as a host drives it.

use std::collections::BTreeMap;

use crate::bus::{Bus, Conditions, Driven};
use crate::chip::Chip;
use crate::clock::{NEVER, Time, UNITS_PER_MICROSECOND, UNITS_PER_SECOND};
use crate::error::{Note, Rules, Stopped, Violation};
use crate::image::Image;
use crate::instruction::Unit;
use crate::machine::Machine;
use crate::peripherals::gpio::Wire;
use crate::peripherals::power::{BrownOut, POWER_DOWN_V};
use crate::peripherals::rcc::{BROWN_OUT_FLAG, Crystal, PIN_FLAG, POWER_FLAG, SOFTWARE_FLAG};
use crate::peripherals::usart::LineByte;
use crate::wiring::{Pin, Wiring};

/// Reserved space below the SRAM that the firmware's MPU region covers.
const BELOW_SRAM_BYTES: usize = 64 << 10;

/// What can happen to a board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input {
    /// A pin is connected to something else.
    Level(Pin, Wire),
    /// Supply of the motor (V).
    Supply(f32),
    /// Supply of the chip (V).
    ChipSupply(f32),
    /// An encoder turns to `position` (edges) until `end`.
    Encoder {
        /// Number among [`Wiring::encoders`].
        encoder: usize,
        /// Where to.
        position: i64,
        /// When it is there.
        end: Time,
    },
    /// The crystal stops swinging.
    StopCrystal,
    /// The reset pin is held low, or let go.
    Reset(bool),
    /// A debugger halts the core, or lets it go on.
    Halt(bool),
    /// A debugger resets the chip (SYSRESETREQ).
    DebuggerReset,
    /// The next write to this register is lost.
    LoseWrite(u32),
    /// As [`Input::LoseWrite`], but reading gives what was written: for negative controls.
    LoseWriteUnseen(u32),
    /// The core stands still until this time, and everything else goes on.
    Stall(Time),
    /// The program counter changes, as by a defect inside the core.
    Jump(u32),
    /// The stack pointer changes, as after calls without end.
    StackPointer(u32),
    /// A bit of memory (flash, SRAM) changes.
    FlipBit {
        /// Address of the byte.
        address: u32,
        /// 0 to 7.
        bit: u8,
    },
    /// The watchdog counts, but no longer resets: for negative controls.
    IgnoreWatchdog,
    /// The break input is disconnected: for negative controls.
    IgnoreBreak,
    /// The memory protection unit allows everything, and the 64 KiB below the SRAM answer like memory, as reserved
    /// space may: for negative controls.
    IgnoreMpu,
}

/// What the power stage sees at its inputs now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PowerStage {
    /// Enable.
    pub enable: bool,
    /// Direction; high drives along +x.
    pub along: bool,
    /// PWM.
    pub pwm: bool,
    /// Whether the timer may drive PWM (MOE).
    pub main_output: bool,
    /// Whether the PWM timer counts.
    pub runs: bool,
    /// PWM period in timer clocks, as it is active now.
    pub period_clocks: u32,
    /// Timer clocks of each period for which PWM is high, as they are active now.
    pub high_clocks: u32,
    /// When the PWM timer was started the last time.
    pub started_at: Time,
}

/// A board with power.
#[derive(Debug, Clone)]
pub struct Board {
    machine: Machine,
    /// By time, and by order within a time.
    scheduled: BTreeMap<(Time, u64), Input>,
    order: u64,
    line_free_at: Time,
    /// The chip's supply was below the power-down threshold.
    power_lost: bool,
}

impl Conditions {
    /// An STM32F405 with a crystal of 8 MHz and the standard wiring, everything as it typically is.
    pub fn f405(seed: u64) -> Self {
        Self::typical(Chip::F405, seed)
    }

    /// A chip with a crystal of 8 MHz and the standard wiring, everything as it typically is.
    pub fn typical(chip: Chip, seed: u64) -> Self {
        Self {
            chip,
            wiring: Wiring::upright(),
            crystal: Crystal { hz: 8_000_000, start: 2_000 * UNITS_PER_MICROSECOND, is_clock_input: false },
            hsi_hz: 16_000_000,
            lsi_hz: 32_000,
            seed,
            chip_v: 3.3,
            brown_out: BrownOut::Off,
            is_calibrated: true,
        }
    }
}

impl Board {
    /// Switches power on: memory is random, the processor begins at the reset vector.
    ///
    /// # Errors
    /// [`Stopped`] if the image has no usable vectors.
    pub fn power_on(image: &Image, conditions: &Conditions, rules: Rules) -> Result<Self, Stopped> {
        let mut bus = Bus::new(conditions, rules, &image.segments);
        bus.rcc.status = POWER_FLAG | PIN_FLAG | BROWN_OUT_FLAG;
        // The internal reference of 1.21 V.
        bus.adc.inputs[17] = 1.21 / conditions.chip_v;
        let mut machine = Machine::new(bus, image.end());
        let started = machine.reset();
        machine.resets = 0;
        let stopped = |violation| Stopped { violation, program_counter: 0, time: 0 };
        started.map_err(stopped)?;
        Ok(Self { machine, scheduled: BTreeMap::new(), order: 0, line_free_at: 0, power_lost: false })
    }

    /// Time since power-on.
    pub fn now(&self) -> Time {
        self.machine.bus.now
    }

    /// Runs until `end`, or until what the image does is not allowed.
    ///
    /// # Errors
    /// [`Stopped`]
    pub fn run_until(&mut self, end: Time) -> Result<(), Stopped> {
        while let Some((&(time, order), &input)) = self.scheduled.first_key_value() {
            if time > end {
                break;
            }
            self.machine.run_until(time)?;
            self.scheduled.remove(&(time, order));
            self.apply(input);
        }
        self.machine.run_until(end)
    }

    /// Lets something happen at a time to come.
    pub fn at(&mut self, time: Time, input: Input) {
        self.order += 1;
        self.scheduled.insert((time, self.order), input);
    }

    /// Lets something happen now.
    pub fn apply(&mut self, input: Input) {
        let machine = &mut self.machine;
        machine.watch.forget();
        let bus = &mut machine.bus;
        match input {
            Input::Level(pin, wire) => bus.connect(pin, wire),
            Input::Supply(volts) => {
                let fraction = volts / bus.wiring.supply_divider / bus.power.volts;
                if let Some(place) = bus.adc.inputs.get_mut(bus.wiring.supply_channel) {
                    *place = fraction;
                }
            }
            Input::ChipSupply(volts) => self.set_chip_supply(volts),
            Input::Encoder { encoder, position, end } => bus.turn_encoder(encoder, position, end),
            Input::StopCrystal => bus.stop_crystal(),
            Input::Reset(low) => self.hold(low, 0),
            Input::Halt(halted) => bus.halt(halted),
            Input::DebuggerReset => self.hold(false, SOFTWARE_FLAG),
            Input::LoseWrite(register) | Input::LoseWriteUnseen(register) => {
                bus.lost_write = Some(register);
                bus.lost_write_is_hidden = matches!(input, Input::LoseWriteUnseen(_));
            }
            Input::Stall(until) => machine.stalled_until = until,
            Input::Jump(address) => {
                machine.registers.pc = address & !1;
                machine.asleep = false;
            }
            Input::StackPointer(address) => machine.registers.r[13] = address & !3,
            Input::FlipBit { address, bit } => self.flip(address, bit),
            Input::IgnoreWatchdog => bus.iwdg.ignored = true,
            Input::IgnoreBreak => bus.pwm.break_ignored = true,
            Input::IgnoreMpu => {
                bus.system.mpu.ignored = true;
                bus.below_sram = vec![0; BELOW_SRAM_BYTES];
            }
        }
        self.machine.bus.system.nvic.changed = true;
    }

    fn set_chip_supply(&mut self, volts: f32) {
        self.power_lost |= volts < POWER_DOWN_V;
        let bus = &mut self.machine.bus;
        bus.power.volts = volts;
        bus.adc.inputs[17] = 1.21 / volts.max(0.1);
        bus.supply_changed();
        bus.refresh();
        let (down_v, up_v) = bus.power.brown_out.thresholds_v();
        if volts < down_v && !self.machine.held {
            self.hold(true, 0);
        } else if volts > up_v && self.machine.held {
            let power = if std::mem::take(&mut self.power_lost) { POWER_FLAG } else { 0 };
            self.hold(false, power | BROWN_OUT_FLAG);
        }
    }

    /// Holds the chip in reset, its outputs floating, or lets it go.
    fn hold(&mut self, low: bool, flags: u32) {
        self.machine.held = low;
        self.machine.bus.reset(flags);
        if !low {
            // A bad vector ends the run at the first instruction.
            let _ = self.machine.reset();
        }
    }

    fn flip(&mut self, address: u32, bit: u8) {
        let bus = &mut self.machine.bus;
        let offset = (address & 0x00ff_ffff) as usize;
        let memory = match address >> 24 {
            0x08 => &mut bus.flash,
            _ => &mut bus.sram,
        };
        if let Some(byte) = memory.get_mut(offset) {
            *byte ^= 1 << (bit & 7);
        }
        if address >> 24 == 8 {
            self.machine.forget(address);
        }
    }

    /// Sends bytes to the board, one after the other, at a baud rate; gives the time of the end of the last one.
    pub fn send(&mut self, bytes: &[u8], baud: u32) -> Time {
        let bit = UNITS_PER_SECOND / Time::from(baud.max(1));
        let bus = &mut self.machine.bus;
        for &value in bytes {
            let end = self.line_free_at.max(bus.now) + 10 * bit;
            self.line_free_at = end;
            bus.usart.incoming.push_back(LineByte { value, end, bit });
        }
        bus.refresh();
        self.line_free_at
    }

    /// Bytes that the board has sent since the last call.
    pub fn sent(&mut self) -> Vec<LineByte> {
        self.machine.bus.usart.sent.drain(..).collect()
    }

    /// What the motor's pins have done since power-on.
    pub fn driven(&mut self) -> Driven {
        self.machine.bus.settle_output();
        self.machine.bus.driven
    }

    /// What the power stage sees now.
    pub fn power_stage(&mut self) -> PowerStage {
        let bus = &mut self.machine.bus;
        bus.settle_output();
        PowerStage {
            enable: bus.output_level(bus.wiring.enable),
            along: bus.output_level(bus.wiring.direction),
            pwm: bus.pwm.level(),
            main_output: bus.pwm.main_output(),
            runs: bus.pwm.runs(),
            period_clocks: bus.pwm.period_clocks(),
            high_clocks: bus.pwm.active_clocks(),
            started_at: bus.pwm.started_at,
        }
    }

    /// Level of an output pin, such as a status LED's.
    pub fn output(&self, pin: Pin) -> bool {
        self.machine.bus.output_level(pin)
    }

    /// An aligned word of flash or SRAM.
    pub fn word(&self, address: u32) -> Option<u32> {
        self.machine.bus.read_memory(address, Unit::Word)
    }

    /// Violations that the rules have let pass.
    pub fn notes(&self) -> &[Note] {
        &self.machine.bus.notes
    }

    /// Instructions executed, and how many of them were skipped in waiting loops.
    pub fn instructions(&self) -> (u64, u64) {
        (self.machine.executed, self.machine.skipped)
    }

    /// Resets since power-on.
    pub fn resets(&self) -> u64 {
        self.machine.resets
    }

    /// Whether the processor is locked up (a fault in a fault handler).
    pub fn locked_up(&self) -> bool {
        self.machine.locked_up
    }

    /// Address of the next instruction.
    pub fn program_counter(&self) -> u32 {
        self.machine.registers.pc
    }

    /// Number of the exception that is handled; 0 for none.
    pub fn exception(&self) -> u16 {
        self.machine.registers.ipsr
    }

    /// R0 to R12, SP, LR, PC and XPSR.
    pub fn registers(&self) -> [u32; 17] {
        let registers = &self.machine.registers;
        std::array::from_fn(|i| match i {
            15 => registers.pc,
            16 => registers.xpsr(),
            _ => registers.r[i],
        })
    }

    /// When SysTick interrupts the next time; `None` if it does not run.
    pub fn next_tick(&self) -> Option<Time> {
        self.machine.bus.system.next_tick()
    }

    /// Frequency of the core (Hz).
    pub fn core_hz(&self) -> u32 {
        crate::clock::frequency(self.machine.bus.hclk)
    }

    /// Runs one instruction, or takes an exception; time passes at least by one unit.
    ///
    /// # Errors
    /// [`Stopped`]
    pub fn step(&mut self) -> Result<(), Stopped> {
        self.run_until(self.now() + 1)
    }

    /// Runs single instructions until the program counter has a value, or until `end`; gives whether it has.
    ///
    /// # Errors
    /// [`Stopped`]
    pub fn run_to(&mut self, program_counter: u32, end: Time) -> Result<bool, Stopped> {
        while self.now() < end {
            self.step()?;
            if self.machine.registers.pc == program_counter & !1 {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Bytes that came while the one before was not yet fetched, edges that filters have swallowed.
    pub fn lost(&self) -> (u64, u64) {
        let bus = &self.machine.bus;
        (bus.usart.overruns, bus.encoders.iter().map(|encoder| encoder.lost).sum())
    }

    /// Whether waiting loops are skipped ahead (they are, unless told otherwise); it makes no difference but speed.
    pub fn skip_waiting(&mut self, skip: bool) {
        self.machine.skips = skip;
    }

    /// Whether anything is still scheduled.
    pub fn next_input(&self) -> Option<Time> {
        self.scheduled.first_key_value().map(|(&(time, _), _)| time).filter(|&time| time != NEVER)
    }
}

/// A violation at no address.
impl From<Violation> for Stopped {
    fn from(violation: Violation) -> Self {
        Stopped { violation, program_counter: 0, time: 0 }
    }
}
