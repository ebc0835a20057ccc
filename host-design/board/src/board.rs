//! The board's interface to the host program: inputs, running, outputs.

use std::collections::BTreeMap;

use crate::angle_sensor::SensorDefect;
use crate::bus::{Bus, Conditions, Driven, Pulse};
use crate::chip::Chip;
use crate::clock::{Time, UNITS_PER_MICROSECOND, UNITS_PER_SECOND};
use crate::error::{Note, Rules, Stopped, Violation};
use crate::image::Image;
use crate::instruction::Unit;
use crate::machine::Microcontroller;
use crate::peripherals::gpio::ExternalLevel;
use crate::peripherals::power::{BrownOut, POWER_DOWN_V};
use crate::peripherals::rcc::{BROWN_OUT_FLAG, Crystal, PIN_FLAG, POWER_FLAG, SOFTWARE_FLAG};
use crate::peripherals::usart::LineByte;
use crate::register_sensor::RegisterDefect;
use crate::timing::CoreTiming;
use crate::wiring::{BoardWiring, Pin};

/// Size of the reserved space below the SRAM that the firmware's MPU region covers.
const BELOW_SRAM_BYTES: usize = 64 << 10;

/// A change outside the chip, or an injected fault: applied by [`SimulatedBoard::apply`] or scheduled by
/// [`SimulatedBoard::at`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input {
    /// An external level is applied to a pin, or removed from it.
    Level(Pin, ExternalLevel),
    /// Supply voltage of the motor (V), which the converter measures through the divider.
    Supply(f32),
    /// Supply voltage of the chip (V).
    ChipSupply(f32),
    /// An encoder turns at constant speed so that it reaches `position` at `end`.
    Encoder {
        /// Index into [`BoardWiring::encoders`].
        encoder: usize,
        /// Target position (edges).
        position: i64,
        /// Time at which the target position is reached.
        end: Time,
    },
    /// The reading of an absolute sensor (14 bits) in the place of an encoder, which it takes with the first reading.
    Angle {
        /// Index into [`BoardWiring::encoders`].
        encoder: usize,
        /// The reading.
        reading: u16,
    },
    /// Voltage at the wiper of a potentiometer, as a share of the converter's reference: 0 if its wire is open, which a
    /// resistor then pulls down.
    Wiper(f32),
    /// A defect of such a sensor.
    AngleDefect {
        /// Index into [`BoardWiring::encoders`].
        encoder: usize,
        /// The defect.
        defect: SensorDefect,
    },
    /// The registers of a sensor on two wires in the place of an encoder, which it takes with the first ones.
    Registers {
        /// Index into [`BoardWiring::encoders`].
        encoder: usize,
        /// Its address, 7 bits.
        address: u8,
        /// The first of these registers.
        first: u8,
        /// Their values.
        values: [u8; 5],
    },
    /// A defect of such a sensor.
    RegisterDefect {
        /// Index into [`BoardWiring::encoders`].
        encoder: usize,
        /// The defect.
        defect: RegisterDefect,
    },
    /// The crystal stops oscillating.
    StopCrystal,
    /// The reset pin is held low (true) or released (false).
    Reset(bool),
    /// A debugger halts the core (true) or resumes it (false).
    Halt(bool),
    /// A debugger resets the chip (SYSRESETREQ).
    DebuggerReset,
    /// The next write to the register at this address is lost.
    LoseWrite(u32),
    /// As [`Input::LoseWrite`], but reads of the register return the lost value: for negative controls.
    LoseWriteUnseen(u32),
    /// A received byte is not fetched before the next one ends, as after contention on the bus.
    Overrun,
    /// The DMA stream that receives ends with a transfer error.
    ReceiveError,
    /// The core is stalled until this time; peripherals keep running.
    Stall(Time),
    /// The program counter jumps to this address, as a defect inside the core might make it do.
    Jump(u32),
    /// The stack pointer is set to this address, as after unbounded recursion.
    StackPointer(u32),
    /// A bit of memory (flash, SRAM) flips.
    FlipBit {
        /// Address of the byte.
        address: u32,
        /// Number of the bit, 0 to 7.
        bit: u8,
    },
    /// The watchdog runs but no longer resets the chip: for negative controls.
    IgnoreWatchdog,
    /// The break input is disconnected: for negative controls.
    IgnoreBreak,
    /// The memory protection unit allows every access, and the 64 KiB below the SRAM behave as memory, as reserved
    /// space may: for negative controls.
    IgnoreMpu,
}

/// Levels at the power stage's inputs, and the state of the PWM timer behind them, at one time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PowerStage {
    /// Level of the enable pin; high lets the power stage switch.
    pub enable: bool,
    /// Level of the direction pin; high drives along +x.
    pub along: bool,
    /// Level of the timer's PWM output.
    pub pwm: bool,
    /// Whether the timer may drive its PWM output (MOE).
    pub main_output: bool,
    /// Whether the PWM timer counts.
    pub runs: bool,
    /// PWM period in timer clocks: the active value, not the preloaded one.
    pub period_clocks: u32,
    /// Timer clocks per period with PWM high: by the active compare value, not the preloaded one.
    pub high_clocks: u32,
    /// When code last set whether the PWM timer counts.
    pub started_at: Time,
}

/// A virtual board after power-on, with its inputs to come.
///
/// ```
/// use upright_board::{Conditions, Image, Rules, SimulatedBoard, seconds};
///
/// // The vectors (stack pointer, first instruction), then a program: `movs r0, #42`, and a branch to itself.
/// let mut flash = [0x2000_1000_u32, 0x0800_0009].map(u32::to_le_bytes).concat();
/// flash.extend([0x202a_u16, 0xe7fe].map(u16::to_le_bytes).concat());
/// let mut board = SimulatedBoard::power_on(&Image::from_flash(flash), &Conditions::f405(1), Rules::STRICT)?;
/// board.run_until(seconds(0.001))?;
/// assert_eq!(board.registers()[0], 42);
/// assert_eq!(board.program_counter(), 0x0800_000a);
/// # Ok::<(), upright_board::Stopped>(())
/// ```
#[derive(Debug, Clone)]
pub struct SimulatedBoard {
    machine: Microcontroller,
    /// By time and, at equal times, in the order of scheduling.
    scheduled: BTreeMap<(Time, u64), Input>,
    order: u64,
    line_free_at: Time,
    /// The chip's supply has fallen below the power-down threshold: its next release from reset sets the power flag.
    power_lost: bool,
}

impl Conditions {
    /// An STM32F405 with an 8 MHz crystal, the standard wiring and otherwise typical values.
    pub fn f405(seed: u64) -> Self {
        Self::typical(Chip::F405, seed)
    }

    /// A chip with an 8 MHz crystal, the standard wiring and otherwise typical values.
    pub fn typical(chip: Chip, seed: u64) -> Self {
        Self {
            chip,
            wiring: BoardWiring::upright(),
            crystal: Crystal { hz: 8_000_000, start: 2_000 * UNITS_PER_MICROSECOND, is_clock_input: false },
            hsi_hz: 16_000_000,
            lsi_hz: 32_000,
            seed,
            chip_v: 3.3,
            brown_out: BrownOut::Off,
            timing: CoreTiming::Quick,
            is_calibrated: true,
        }
    }
}

impl SimulatedBoard {
    /// Switches power on: the contents of memory are random, and the processor starts at the reset vector.
    ///
    /// # Errors
    /// [`Stopped`] if the image has no usable vectors.
    pub fn power_on(image: &Image, conditions: &Conditions, rules: Rules) -> Result<Self, Stopped> {
        let mut bus = Bus::new(conditions, rules, &image.segments);
        bus.rcc.status = POWER_FLAG | PIN_FLAG | BROWN_OUT_FLAG;
        // The internal reference of 1.21 V.
        bus.adc.inputs[17] = 1.21 / conditions.chip_v;
        let mut machine = Microcontroller::new(bus, image.end());
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

    /// Runs until `end`, and applies scheduled inputs at their times.
    ///
    /// # Errors
    /// [`Stopped`] at the first violation that ends the run.
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

    /// Schedules an input for a later time.
    pub fn at(&mut self, time: Time, input: Input) {
        self.order += 1;
        self.scheduled.insert((time, self.order), input);
    }

    /// Applies an input now.
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
            Input::Wiper(share) => {
                let channel = bus.wiring.wiper_channel;
                if let Some(place) = channel.and_then(|channel| bus.adc.inputs.get_mut(channel)) {
                    *place = share;
                }
            }
            Input::ChipSupply(volts) => self.set_chip_supply(volts),
            Input::Encoder { encoder, position, end } => bus.turn_encoder(encoder, position, end),
            Input::Angle { .. }
            | Input::AngleDefect { .. }
            | Input::Registers { .. }
            | Input::RegisterDefect { .. } => self.apply_to_sensor(input),
            Input::StopCrystal => bus.stop_crystal(),
            Input::Reset(low) => self.hold(low, 0),
            Input::Halt(halted) => bus.halt(halted),
            Input::DebuggerReset => self.hold(false, SOFTWARE_FLAG),
            Input::LoseWrite(register) | Input::LoseWriteUnseen(register) => {
                bus.lost_write = Some(register);
                bus.lost_write_is_hidden = matches!(input, Input::LoseWriteUnseen(_));
            }
            Input::Overrun => bus.usart.overrun(),
            Input::ReceiveError => bus.dma.fail(bus.dma.serial().0),
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

    /// Applies an input of an absolute sensor.
    fn apply_to_sensor(&mut self, input: Input) {
        let bus = &mut self.machine.bus;
        match input {
            Input::Angle { encoder, reading } => {
                if let Some(sensor) = bus.angle_sensor(encoder)
                    && sensor.defect != SensorDefect::Stuck
                {
                    sensor.reading = reading & 0x3fff;
                }
            }
            Input::AngleDefect { encoder, defect } => {
                if let Some(sensor) = bus.angle_sensor(encoder) {
                    sensor.defect = defect;
                }
            }
            Input::Registers { encoder, address, first, values } => {
                bus.register_sensor(encoder, address, first, values)
            }
            Input::RegisterDefect { encoder, defect } => bus.spoil_registers(encoder, defect),
            _ => {}
        }
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

    /// Holds the chip in reset with its outputs floating (`low`), or releases it; `flags` are the reset flags to set.
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

    /// Sends bytes to the board, back to back, at a baud rate; returns the time at which the last one ends.
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

    /// Times for which the motor's outputs have been high since power-on.
    pub fn driven(&mut self) -> Driven {
        self.machine.bus.settle_output();
        self.machine.bus.driven
    }

    /// Records every pulse of the motor timer's output from now on.
    pub fn record_pulses(&mut self) {
        self.machine.bus.settle_output();
        self.machine.bus.pwm.edges.get_or_insert_default();
    }

    /// Pulses since the last call that were recorded.
    pub fn pulses(&mut self) -> Vec<Pulse> {
        self.machine.bus.settle_output();
        std::mem::take(&mut self.machine.bus.pulses)
    }

    /// Present levels at the power stage's inputs.
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

    /// Level of a pin that is configured as an output, such as a status LED's; low if it is not.
    pub fn output(&self, pin: Pin) -> bool {
        self.machine.bus.output_level(pin)
    }

    /// The word at an aligned address in memory (flash, SRAM); `None` elsewhere.
    pub fn word(&self, address: u32) -> Option<u32> {
        self.machine.bus.read_memory(address, Unit::Word)
    }

    /// Violations that were noted instead of ending the run.
    pub fn notes(&self) -> &[Note] {
        &self.machine.bus.notes
    }

    /// Number of instructions since power-on, and how many of them were skipped in waiting loops.
    pub fn instructions(&self) -> (u64, u64) {
        (self.machine.executed, self.machine.skipped)
    }

    /// Number of resets since power-on.
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

    /// Number of the active exception (IPSR); 0 in thread mode.
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

    /// When SysTick next interrupts; `None` if it does not run or its interrupt is off.
    pub fn next_tick(&self) -> Option<Time> {
        self.machine.bus.system.systick.next_tick()
    }

    /// Frequency of the core (Hz).
    pub fn core_hz(&self) -> u32 {
        crate::clock::frequency(self.machine.bus.hclk)
    }

    /// Executes one instruction or takes one exception; time advances by at least one unit.
    ///
    /// # Errors
    /// [`Stopped`] at a violation that ends the run.
    pub fn step(&mut self) -> Result<(), Stopped> {
        self.run_until(self.now() + 1)
    }

    /// Number of bytes lost to receive overruns, and of encoder edges suppressed by the timers' input filters.
    pub fn lost(&self) -> (u64, u64) {
        let bus = &self.machine.bus;
        (bus.usart.overruns, bus.encoders.iter().map(|encoder| encoder.lost).sum())
    }

    /// Sets whether waiting loops are skipped (the default); this affects nothing but speed.
    pub fn skip_waiting(&mut self, skip: bool) {
        self.machine.skips = skip;
    }
}

/// A violation without place and time: both are 0.
impl From<Violation> for Stopped {
    fn from(violation: Violation) -> Self {
        Stopped { violation, program_counter: 0, time: 0 }
    }
}
