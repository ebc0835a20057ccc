//! The image that is flashed, on the virtual board: its pins are edges, levels, volts and bytes at their baud rate.

mod compared;
mod cycles;
mod places;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use upright::board::{Contacts, Output};
use upright::control::actuator::Drive;
use upright::protocol::simulated_pins::Sabotage;
use upright::protocol::{BAUD, telemetry_ticks};
use upright_board::{
    Board, Conditions, Image, Input, Meter, Place, PowerStage, Rules, Stopped, TickCost, Time,
    UNITS_PER_MICROSECOND, UNITS_PER_SECOND, Wire, Wiring, seconds,
};
use upright_design::harness::{HarnessError, Pace, Pins, Target};
use upright_design::simulate::Bench;
use upright_design::table::TableValues;

pub use compared::Compared;
pub use cycles::{Cycles, Figures, Span, TooLong, measure};

/// Inputs change so long before a tick.
const LEAD: Time = 2 * UNITS_PER_MICROSECOND;
/// What happens inside a tick happens so long after its beginning.
const INSIDE: Time = 3 * UNITS_PER_MICROSECOND;
/// The serial line is quiet for so long before each tick, so that a byte belongs to one tick and no other.
const QUIET: Time = 60 * UNITS_PER_MICROSECOND;
/// Longest time from power-up to the first tick (s): an image without a crystal waits for it first.
const START_S: f64 = 1.0;
/// Where nothing is, for a processor fault.
const NOWHERE: u32 = 0x3000_0000;
/// The stack ends here (memory.x).
const STACK_END: u32 = 0x2000_0000;
/// Number of SysTick among the exceptions.
const SYS_TICK: u16 = 15;

/// What the firmware's image may do: what the processor faults at, it does; everything else that the manuals do not
/// allow ends the run.
pub const RULES: Rules = Rules { faults_are_taken: true, ..Rules::STRICT };

/// What happens to the board in the next tick.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// So long after the beginning of the tick.
    Input {
        /// How long.
        after: Time,
        /// What.
        input: Input,
    },
    /// Bytes come over the serial line.
    Bytes {
        /// Which.
        bytes: Vec<u8>,
        /// How fast.
        baud: u32,
    },
    /// From now on no byte of the host arrives.
    CutLine,
    /// The emergency stop opens so long after the beginning of the tick, and closes again.
    Stop {
        /// How long.
        after: Time,
        /// How long it stays open.
        open: Time,
    },
}

/// The way to let something happen to a board that someone else runs.
pub type Events = Rc<RefCell<Vec<Event>>>;

/// A board with the image, in lock step.
pub struct VirtualBoard {
    board: Board,
    wiring: &'static Wiring,
    /// Force that full duty stands for (N); none for a rig with motor data.
    force_limit_n: Option<f32>,
    tick_s: f64,
    /// Edges that each encoder has been turned by.
    positions: Vec<i64>,
    counters: Option<Vec<u32>>,
    contacts: Option<Contacts>,
    supply_v: Option<f32>,
    outgoing: VecDeque<u8>,
    /// Bytes that were on the line in this tick.
    received: Vec<u8>,
    is_read: bool,
    is_cut: bool,
    events: Events,
    stage: PowerStage,
    /// Longest time from an edge of the emergency stop to an output that is off, if it was off before the next tick.
    stop_to_off: Option<Time>,
    image: Image,
    meter: Option<Meter>,
}

impl VirtualBoard {
    /// Switches power on and lets the image run until just before its first tick.
    ///
    /// # Errors
    /// [`HarnessError::Board`] if it does what the hardware does not allow, or no tick comes.
    pub fn start(image: &Image, conditions: &Conditions, table: &TableValues) -> Result<Self, HarnessError> {
        Self::start_with(image, conditions, table, &[])
    }

    /// As [`VirtualBoard::start`], and with this happening at power-up.
    ///
    /// # Errors
    /// As of [`VirtualBoard::start`].
    pub fn start_with(
        image: &Image,
        conditions: &Conditions,
        table: &TableValues,
        at_power_up: &[Input],
    ) -> Result<Self, HarnessError> {
        let mut board = Board::power_on(image, conditions, RULES).map_err(|error| stopped(image, error))?;
        let stage = board.power_stage();
        let mut target = Self {
            board,
            wiring: conditions.wiring,
            force_limit_n: table.motor.is_none().then_some(table.force_limit_n),
            tick_s: f64::from(table.tick_s),
            positions: vec![0; table.sensors()],
            counters: None,
            contacts: None,
            supply_v: None,
            outgoing: VecDeque::new(),
            received: Vec::new(),
            is_read: true,
            is_cut: false,
            events: Events::default(),
            stage,
            stop_to_off: None,
            image: image.clone(),
            meter: None,
        };
        target.connect(&Contacts::default());
        target.supply(table.motor.map_or(24.0, |motor| motor.supply_v));
        at_power_up.iter().for_each(|&input| target.board.apply(input));
        while target.board.next_tick().is_none() {
            target.run(target.board.now() + 100 * UNITS_PER_MICROSECOND)?;
            if target.board.now() > seconds(START_S) {
                return Err(HarnessError::Board("has no tick: the image waits for something".to_owned()));
            }
        }
        let first = target.board.next_tick().unwrap_or(0);
        target.run(first.saturating_sub(LEAD))?;
        Ok(target)
    }

    /// The board itself.
    pub fn board(&mut self) -> &mut Board {
        &mut self.board
    }

    /// Where to put what shall happen in the next tick.
    pub fn events(&self) -> Events {
        Rc::clone(&self.events)
    }

    /// What the power stage saw at the end of the last tick.
    pub fn stage(&self) -> PowerStage {
        self.stage
    }

    /// From now on measures every tick, with the places of its half-words: slower, and otherwise the same.
    fn measure_ticks(&mut self, places: Vec<Place>) {
        self.meter = Some(Meter::new(places));
    }

    /// The ticks that were measured.
    fn ticks(&self) -> &[TickCost] {
        self.meter.as_ref().map_or(&[], Meter::ticks)
    }

    /// Longest time from an edge of the emergency stop to an output that is off; none if it never opened between
    /// ticks, or nothing was off before the next tick.
    pub fn stop_to_off(&self) -> Option<Time> {
        self.stop_to_off
    }

    /// What the image has latched in the last tick, for a firmware that shall do the same. `received` came with the
    /// tick before: the image looks for bytes after each tick.
    fn latched(&self, pins: &Pins, received: &[u8]) -> Pins {
        let counts = (0..).zip(&self.positions).map(|(sensor, &position)| {
            let count = position as u32;
            Bench::reading(sensor, count)
        });
        Pins {
            raw_counts: counts.collect(),
            received: heapless::Vec::from_slice(received).unwrap_or_default(),
            ..pins.clone()
        }
    }

    fn run(&mut self, end: Time) -> Result<(), HarnessError> {
        let run = match &mut self.meter {
            Some(meter) => meter.run(&mut self.board, end),
            None => self.board.run_until(end),
        };
        run.map_err(|error| stopped(&self.image, error))
    }

    /// One instruction.
    fn step(&mut self) -> Result<(), HarnessError> {
        self.run(self.board.now() + 1)
    }

    /// Contacts as levels: those of the emergency stop and the limits are closed to ground while all is well, the
    /// driver pulls its line low when it has a fault.
    fn connect(&mut self, contacts: &Contacts) {
        let level = |low: bool| if low { Wire::Low } else { Wire::High };
        let closed = |open: bool| if open { Wire::Open } else { Wire::Low };
        let Wiring { emergency_stop, limits: [low, high], driver_fault, .. } = *self.wiring;
        for (at, wire) in [
            (emergency_stop, closed(contacts.emergency_stop)),
            (low, closed(contacts.limit_low)),
            (high, closed(contacts.limit_high)),
            (driver_fault, level(contacts.driver_fault)),
        ] {
            self.board.apply(Input::Level(at, wire));
        }
        self.contacts = Some(*contacts);
    }

    fn supply(&mut self, volts: f32) {
        self.board.apply(Input::Supply(volts));
        self.supply_v = Some(volts);
    }

    /// The shafts turn to where the counters say, at once: the image reads them in between.
    fn turn(&mut self, counts: &[u32]) {
        let before = self.counters.replace(counts.to_vec()).unwrap_or_else(|| counts.to_vec());
        let end = self.board.now();
        for (encoder, ((&count, &before), position)) in
            counts.iter().zip(&before).zip(&mut self.positions).enumerate()
        {
            let moved = count.wrapping_sub(before);
            *position += Bench::signed(encoder, moved);
            if moved != 0 {
                self.board.apply(Input::Encoder { encoder, position: *position, end });
            }
        }
    }

    /// As many of the waiting bytes as fit between the quiet times around a tick.
    fn send(&mut self, span: Time) {
        let byte = 10 * UNITS_PER_SECOND / Time::from(BAUD);
        let room = (span.saturating_sub(QUIET + LEAD) / byte) as usize;
        let bytes: Vec<u8> = self.outgoing.drain(..room.min(self.outgoing.len())).collect();
        self.board.send(&bytes, BAUD);
        self.received = bytes;
    }

    /// What shall happen in the tick that begins soon after `now`; gives when the emergency stop opens, and for how
    /// long.
    fn happen(&mut self, now: Time) -> Option<(Time, Time)> {
        let begin = self.board.next_tick().unwrap_or(now);
        let mut stop = None;
        for event in self.events.take() {
            match event {
                Event::Input { after, input } => self.board.at(begin + after, input),
                Event::Bytes { bytes, baud } => drop(self.board.send(&bytes, baud)),
                Event::CutLine => self.is_cut = true,
                Event::Stop { after, open } => stop = Some((begin + after, open)),
            }
        }
        stop
    }

    /// The emergency stop opens between two ticks: how long until the output is off?
    fn press_stop(&mut self, edge: Time, open: Time) -> Result<(), HarnessError> {
        self.run(edge)?;
        let edge = self.board.now();
        self.board.apply(Input::Level(self.wiring.emergency_stop, Wire::Open));
        self.board.at(edge + open, Input::Level(self.wiring.emergency_stop, Wire::Low));
        let end = self.board.next_tick().map_or(edge, |next| next.saturating_sub(LEAD));
        while self.board.power_stage().main_output && self.board.now() < end {
            self.step()?;
        }
        if !self.board.power_stage().main_output {
            self.stop_to_off = self.stop_to_off.max(Some(self.board.now() - edge));
        }
        Ok(())
    }

    /// The tick that comes next ends after the one after it is due: it stands still once it has driven the motor.
    fn make_late(&mut self, period: Time) -> Result<(), HarnessError> {
        let due = self.board.next_tick().unwrap_or(self.board.now());
        self.run(due)?;
        // If the tick before is late itself, this one begins when that has ended.
        for begun in [false, true] {
            while self.board.output(self.wiring.tick) != begun && self.board.now() < due + period / 2 {
                self.step()?;
            }
        }
        let begin = self.board.now();
        while self.board.power_stage().started_at < begin && self.board.output(self.wiring.tick) {
            self.step()?;
        }
        self.board.apply(Input::Stall(due + period + INSIDE));
        Ok(())
    }

    /// A defect inside the microcontroller, in the tick that comes next.
    fn sabotage(&mut self, sabotage: Sabotage) -> Result<(), HarnessError> {
        let begin = self.board.next_tick().unwrap_or(self.board.now());
        match sabotage {
            // A panic that cannot be reported is an undefined instruction, which is a processor fault.
            Sabotage::Panic | Sabotage::HardFault => {
                self.run(begin + INSIDE)?;
                debug_assert!(self.board.exception() == SYS_TICK || self.board.resets() > 0);
                self.board.apply(Input::Jump(NOWHERE));
                Ok(())
            }
            Sabotage::StackOverflow => self.fill_stack(begin),
        }
    }

    /// The stack is full but for two words when the tick comes. If that does not stop the program, it goes on with the
    /// stack that it had.
    fn fill_stack(&mut self, begin: Time) -> Result<(), HarnessError> {
        self.run(begin - 1)?;
        let (stack, below) = (self.board.registers()[13], self.board.exception());
        self.board.apply(Input::StackPointer(STACK_END + 8));
        while self.board.exception() == below && self.board.now() < begin + INSIDE {
            self.step()?;
        }
        while self.board.exception() == SYS_TICK && self.board.now() < begin + seconds(self.tick_s) / 2 {
            self.step()?;
        }
        if self.board.exception() == below {
            self.board.apply(Input::StackPointer(stack));
        }
        Ok(())
    }
}

impl Target for VirtualBoard {
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError> {
        let begin = self.board.now();
        let period = seconds(self.tick_s);
        if self.contacts != Some(pins.contacts) {
            self.connect(&pins.contacts);
        }
        if self.supply_v != Some(pins.supply_v) {
            self.supply(pins.supply_v);
        }
        self.turn(&pins.raw_counts);
        self.outgoing.extend(&pins.received);
        let before = self.board.driven();
        let stop = self.happen(begin);
        if self.is_cut {
            self.outgoing.clear();
        }
        self.send(period);
        if pins.contacts.overrun {
            self.make_late(period)?;
        }
        if let Some((edge, open)) = stop {
            self.press_stop(edge, open)?;
        }
        if let Some(sabotage) = pins.sabotage {
            self.sabotage(sabotage)?;
        }
        // The tick after this one, or its time if none comes.
        self.run(begin + 2 * LEAD)?;
        let end = self.board.next_tick().map_or(begin + period, |next| next.saturating_sub(LEAD));
        self.run(end.max(begin + 3 * LEAD))?;
        let after = self.board.driven();
        for byte in self.board.sent() {
            if self.is_read {
                serial.push(byte.value);
            }
        }
        self.stage = self.board.power_stage();
        let net = (after.along - before.along) as f64 - (after.against - before.against) as f64;
        let share = (net / (self.board.now() - begin) as f64) as f32;
        Ok(Output {
            drive: match self.force_limit_n {
                Some(limit_n) => Drive::Force(share * limit_n),
                None => Drive::Duty(share),
            },
            enable: self.stage.enable && self.stage.main_output && self.stage.runs,
        })
    }

    fn pace(&self) -> Pace {
        // An answer may wait for two telemetry messages, each of some 150 bytes.
        let byte_s = 10.0 / f64::from(BAUD);
        let answer_ticks = 10 + (600.0 * byte_s / self.tick_s).ceil() as usize;
        Pace { answer_ticks, telemetry_ticks: telemetry_ticks(self.tick_s as f32), command_ticks: 4 }
    }

    fn stop_reading(&mut self) -> Result<(), HarnessError> {
        self.is_read = false;
        Ok(())
    }
}

fn stopped(image: &Image, stopped: Stopped) -> HarnessError {
    let line = image.source_line(stopped.program_counter).map_or(String::new(), |line| format!(" ({line})"));
    HarnessError::Board(format!("has stopped {stopped}{line}"))
}
