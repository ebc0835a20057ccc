//! The image that is flashed, on the virtual board, connected by encoder edges, pin levels, volts and serial bytes.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use upright::board::{Contacts, Output};
use upright::control::actuator::Drive;
use upright::protocol::simulated_pins::InjectedFault;
use upright::protocol::{BAUD, telemetry_ticks};
use upright_board::{
    BoardWiring, CodePlace, Conditions, ExternalLevel, Image, Input, Meter, PowerStage, Rules,
    SimulatedBoard, Stopped, TickCost, Time, UNITS_PER_MICROSECOND, UNITS_PER_SECOND, seconds,
};
use upright_closed_loop::harness::{HarnessError, Pace, Pins, Target};
use upright_design::simulate::Bench;
use upright_design::table::TableValues;

use super::absolute::AbsoluteAtPins;
use super::pulse_count::{PulseCount, PulseWatch};

/// Inputs change this long before a tick.
const LEAD: Time = 2 * UNITS_PER_MICROSECOND;
/// Events inside a tick happen this long after its beginning.
const INSIDE: Time = 3 * UNITS_PER_MICROSECOND;
/// The serial line is quiet for this long before each tick, so that a byte belongs to one tick and no other.
const QUIET: Time = 60 * UNITS_PER_MICROSECOND;
/// Ticks of an image that reads sensors on two wires are so much longer, and the line is quiet for them, too.
const READING: Time = 250 * UNITS_PER_MICROSECOND;
/// Longest time from power-up to the first tick (s): an image without a crystal waits for it first.
const START_S: f64 = 1.0;
/// An unmapped address: executing it is a processor fault.
const NOWHERE: u32 = 0x3000_0000;
/// Lowest address of the stack (memory.x).
const STACK_END: u32 = 0x2000_0000;
/// Exception number of SysTick.
const SYS_TICK: u16 = 15;

/// Rules for the firmware's image: what makes the processor fault raises that fault; everything else that the manuals
/// do not allow ends the run.
pub const RULES: Rules = Rules { faults_are_taken: true, ..Rules::STRICT };

/// An event at the board in its next tick.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// An input changes, or a fault is injected.
    Input {
        /// Time after the beginning of the tick.
        after: Time,
        /// The input.
        input: Input,
    },
    /// Bytes arrive over the serial line.
    Bytes {
        /// The bytes.
        bytes: Vec<u8>,
        /// Their baud rate.
        baud: u32,
    },
    /// From now on no byte from the host arrives.
    CutLine,
    /// The emergency stop opens between two ticks, and closes again.
    Stop {
        /// Time after the beginning of the tick.
        after: Time,
        /// Time for which it stays open.
        open: Time,
    },
}

/// Queue of the events for the next tick, shared with whoever runs the board.
pub type Events = Rc<RefCell<Vec<Event>>>;

/// A board that runs the image in lock step with its caller, tick by tick.
pub struct VirtualBoard {
    board: SimulatedBoard,
    wiring: &'static BoardWiring,
    /// Force at full duty (N); `None` for a rig with motor data.
    pub(super) force_limit_n: Option<f32>,
    /// The pulses of a drive that takes them.
    pulses: Option<PulseCount>,
    tick_s: f64,
    /// How long the image reads sensors on two wires.
    reading: Time,
    /// Position of each encoder (edges).
    positions: Vec<i64>,
    counters: Option<Vec<u32>>,
    absolute: Vec<Option<AbsoluteAtPins>>,
    contacts: Option<Contacts>,
    supply_v: Option<f32>,
    outgoing: VecDeque<u8>,
    /// Bytes that were on the line in this tick.
    pub(super) received: Vec<u8>,
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
    /// Switches power on and runs the image until just before its first tick.
    ///
    /// # Errors
    /// [`HarnessError::Board`] if it does something that the hardware does not allow, or never starts its tick.
    pub fn start(image: &Image, conditions: &Conditions, table: &TableValues) -> Result<Self, HarnessError> {
        Self::start_with(image, conditions, table, &[])
    }

    /// As [`VirtualBoard::start`], with these inputs applied at power-up.
    ///
    /// # Errors
    /// As for [`VirtualBoard::start`].
    pub fn start_with(
        image: &Image,
        conditions: &Conditions,
        table: &TableValues,
        at_power_up: &[Input],
    ) -> Result<Self, HarnessError> {
        let mut board =
            SimulatedBoard::power_on(image, conditions, RULES).map_err(|error| stopped(image, error))?;
        let stage = board.power_stage();
        let pulses = table.drive.pulses().map(|_| PulseCount::default());
        if pulses.is_some() {
            board.record_pulses();
        }
        let mut target = Self {
            board,
            wiring: conditions.wiring,
            force_limit_n: table.drive.supply_v().is_none().then_some(table.drive.largest_force_n()),
            pulses,
            tick_s: f64::from(table.tick_s),
            reading: if AbsoluteAtPins::are_on_two_wires(table) { READING } else { 0 },
            positions: vec![0; table.sensors()],
            counters: None,
            absolute: (0..table.sensors()).map(|sensor| AbsoluteAtPins::of(table, sensor)).collect(),
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
        // Sensors that read 0, until the first tick.
        target.turn(&vec![0; table.sensors()]);
        target.counters = None;
        target.connect(&Contacts::default());
        target.supply(table.drive.supply_v().unwrap_or(24.0));
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

    /// The board itself, without the harness.
    pub fn board(&mut self) -> &mut SimulatedBoard {
        &mut self.board
    }

    /// Queue for events of the next tick.
    pub fn events(&self) -> Events {
        Rc::clone(&self.events)
    }

    /// State of the power stage's inputs at the end of the last tick.
    pub fn stage(&self) -> PowerStage {
        self.stage
    }

    /// Shows all pulses from now on to `watch`, tick by tick, if the drive takes pulses.
    pub fn watch_pulses(&mut self, watch: PulseWatch) {
        if let Some(pulses) = &mut self.pulses {
            pulses.watch = Some(watch);
        }
    }

    /// Measures every tick from now on, with these places of the half-words: slower, but with the same results.
    pub(super) fn measure_ticks(&mut self, places: Vec<CodePlace>) {
        self.meter = Some(Meter::new(places));
    }

    /// The ticks that were measured.
    pub(super) fn ticks(&self) -> &[TickCost] {
        self.meter.as_ref().map_or(&[], Meter::ticks)
    }

    /// Longest time from an edge of the emergency stop to an output that is off; `None` if it never opened between
    /// ticks, or the output was never off before the next tick.
    pub fn stop_to_off(&self) -> Option<Time> {
        self.stop_to_off
    }

    /// The inputs that the image latched in the last tick, for a firmware that has to do the same. `received` arrived
    /// with the tick before: the image looks for bytes after each tick.
    pub(super) fn latched(&self, pins: &Pins, received: &[u8]) -> Pins {
        let counts = (0..).zip(&self.positions).map(|(sensor, &position)| {
            let pulses = self.pulses.as_ref().filter(|_| sensor == 0);
            let count = pulses.map_or(position as u32, |pulses| pulses.before);
            let mark = self.absolute[sensor].as_ref().map_or(0, |absolute| absolute.mark(position));
            Bench::reading(sensor, count) | mark
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

    /// Executes one instruction.
    fn step(&mut self) -> Result<(), HarnessError> {
        self.run(self.board.now() + 1)
    }

    /// Applies contacts as levels: emergency stop and limit switches are normally closed to ground; the driver pulls
    /// its line low when it has a fault.
    fn connect(&mut self, contacts: &Contacts) {
        let level = |low: bool| if low { ExternalLevel::Low } else { ExternalLevel::High };
        let closed = |open: bool| if open { ExternalLevel::Open } else { ExternalLevel::Low };
        let BoardWiring { emergency_stop, limits: [low, high], driver_fault, .. } = *self.wiring;
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

    /// Turns the shafts to the positions of the counters, at once, since the image reads them only in a tick.
    fn turn(&mut self, counts: &[u32]) {
        let before = self.counters.replace(counts.to_vec()).unwrap_or_else(|| counts.to_vec());
        let end = self.board.now();
        for (encoder, ((&count, &before), position)) in
            counts.iter().zip(&before).zip(&mut self.positions).enumerate()
        {
            if let Some(Some(absolute)) = self.absolute.get_mut(encoder) {
                *position = absolute.show(&mut self.board, encoder, count);
                continue;
            }
            let moved = count.wrapping_sub(before);
            *position += Bench::signed(encoder, moved);
            if moved != 0 {
                self.board.apply(Input::Encoder { encoder, position: *position, end });
            }
        }
    }

    /// Sends as many of the waiting bytes as fit between the quiet times around a tick.
    fn send(&mut self, span: Time) {
        let byte = 10 * UNITS_PER_SECOND / Time::from(BAUD);
        let room = (span.saturating_sub(QUIET + LEAD) / byte) as usize;
        let bytes: Vec<u8> = self.outgoing.drain(..room.min(self.outgoing.len())).collect();
        self.board.send(&bytes, BAUD);
        self.received = bytes;
    }

    /// Schedules the events of the tick that begins soon after `now`; returns when the emergency stop opens, and for
    /// how long.
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

    /// Opens the emergency stop between two ticks, and measures how long it takes until the output is off.
    fn press_stop(&mut self, edge: Time, open: Time) -> Result<(), HarnessError> {
        self.run(edge)?;
        let edge = self.board.now();
        self.board.apply(Input::Level(self.wiring.emergency_stop, ExternalLevel::Open));
        self.board.at(edge + open, Input::Level(self.wiring.emergency_stop, ExternalLevel::Low));
        let end = self.board.next_tick().map_or(edge, |next| next.saturating_sub(LEAD));
        while self.board.power_stage().main_output && self.board.now() < end {
            self.step()?;
        }
        if !self.board.power_stage().main_output {
            self.stop_to_off = self.stop_to_off.max(Some(self.board.now() - edge));
        }
        Ok(())
    }

    /// Makes the next tick end after the following one is due: the core is stalled once it has driven the motor.
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

    /// Injects a defect inside the microcontroller into the next tick.
    fn injected_fault(&mut self, injected_fault: InjectedFault) -> Result<(), HarnessError> {
        let begin = self.board.next_tick().unwrap_or(self.board.now());
        match injected_fault {
            // A panic that cannot be reported is an undefined instruction, which is a processor fault.
            InjectedFault::Panic | InjectedFault::HardFault => {
                self.run(begin + INSIDE)?;
                assert!(self.board.exception() == SYS_TICK || self.board.resets() > 0);
                self.board.apply(Input::Jump(NOWHERE));
                Ok(())
            }
            InjectedFault::StackOverflow => self.fill_stack(begin),
        }
    }

    /// Leaves two words of stack free when the tick comes. If that does not stop the program, it continues with the
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
        if self.reading == 0 {
            self.send(period);
        }
        if pins.contacts.overrun {
            self.make_late(period)?;
        }
        if let Some((edge, open)) = stop {
            self.press_stop(edge, open)?;
        }
        if let Some(injected_fault) = pins.injected_fault {
            self.injected_fault(injected_fault)?;
        }
        // Runs until the tick after this one, or until it would be due if none comes.
        self.run(begin + 2 * LEAD)?;
        if self.reading > 0 {
            self.run((begin + self.reading).max(self.board.now()))?;
            self.send(period.saturating_sub(self.reading));
        }
        let end = self.board.next_tick().map_or(begin + period, |next| next.saturating_sub(LEAD));
        self.run(end.max(begin + 3 * LEAD))?;
        let after = self.board.driven();
        for byte in self.board.sent() {
            if self.is_read {
                serial.push(byte.value);
            }
        }
        self.stage = self.board.power_stage();
        let is_on = self.stage.enable && self.stage.main_output;
        if let Some(pulses) = &mut self.pulses {
            return Ok(pulses.take(begin + LEAD, &self.board.pulses(), is_on));
        }
        let net = (after.along - before.along) as f64 - (after.against - before.against) as f64;
        let share = (net / (self.board.now() - begin) as f64) as f32;
        Ok(Output {
            duty: share,
            drive: match self.force_limit_n {
                Some(limit_n) => Drive::Force(share * limit_n),
                None => Drive::Duty(share),
            },
            enable: is_on && self.stage.runs,
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
