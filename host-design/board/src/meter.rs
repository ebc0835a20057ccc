//! Measures where each tick spends its time, instruction by instruction.

use crate::board::SimulatedBoard;
use crate::clock::Time;
use crate::error::Stopped;
use crate::machine::FLASH;
use crate::processor::nvic;

/// Exception number of SysTick, the tick's interrupt.
const SYS_TICK: u16 = nvic::SYS_TICK as u16;

/// A part of the tick, in order of execution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TickPart {
    /// From the time at which the tick is due to the first input: exception entry.
    Entry,
    /// Reading of all inputs.
    Inputs,
    /// Supervisor and controller.
    Control,
    /// Output to the motor.
    Output,
    /// After the output: a command, telemetry, the prediction, checks of the table, exception return.
    Rest,
}

/// Number of [`TickPart`]s.
const PARTS: usize = 5;

/// What an instruction is counted as, by its source; `None`: the same as the code that called it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CodePlace {
    /// Part of the tick it is counted in.
    pub part: Option<TickPart>,
    /// Whether it is counted as controller code.
    pub controller: Option<bool>,
}

/// Times measured in one tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TickCost {
    /// From the time at which the tick is due to the restart of the motor's timer with its new duty; `None` with the
    /// motor off.
    pub latency: Option<Time>,
    /// Time in each [`TickPart`], in their order.
    pub parts: [Time; PARTS],
    /// Share of these times spent in the controller: control law with estimate, and prediction.
    pub controller: Time,
    /// From the time at which the tick is due to its end.
    pub whole: Time,
}

/// Runs a board and measures its ticks.
#[derive(Debug)]
pub struct Meter {
    /// One per half-word of flash.
    places: Vec<CodePlace>,
    running: Option<Running>,
    ticks: Vec<TickCost>,
}

#[derive(Debug, Clone, Copy)]
struct Running {
    due: Time,
    part: TickPart,
    in_controller: bool,
    cost: TickCost,
}

impl Meter {
    /// A meter with one place per half-word of flash; code beyond the list is counted as its caller.
    pub fn new(places: Vec<CodePlace>) -> Self {
        Self { places, running: None, ticks: Vec::new() }
    }

    /// All ticks that have ended.
    pub fn ticks(&self) -> &[TickCost] {
        &self.ticks
    }

    /// Runs the board until `end`; ticks are single-stepped.
    ///
    /// # Errors
    /// [`Stopped`] at the first violation that ends the run.
    pub fn run(&mut self, board: &mut SimulatedBoard, end: Time) -> Result<(), Stopped> {
        while board.now() < end {
            let Some(running) = &mut self.running else {
                let due = board.next_tick().unwrap_or(end);
                board.run_until(due.min(end))?;
                self.running = (due < end).then(|| Running::new(due));
                continue;
            };
            let (begin, pc, exception) = (board.now(), board.program_counter(), board.exception());
            board.step()?;
            let time = board.now() - begin;
            if exception == SYS_TICK {
                running.enter(self.places.get((pc.wrapping_sub(FLASH) / 2) as usize));
            }
            running.spend(time);
            if exception == SYS_TICK && board.exception() != SYS_TICK {
                self.ticks.push(running.end(board));
                self.running = None;
            }
        }
        Ok(())
    }
}

impl Running {
    fn new(due: Time) -> Self {
        Self { due, part: TickPart::Entry, in_controller: false, cost: TickCost::default() }
    }

    fn enter(&mut self, place: Option<&CodePlace>) {
        let CodePlace { part, controller } = place.copied().unwrap_or_default();
        self.part = part.unwrap_or(self.part);
        self.in_controller = controller.unwrap_or(self.in_controller);
    }

    fn spend(&mut self, time: Time) {
        self.cost.parts[self.part as usize] += time;
        if self.in_controller {
            self.cost.controller += time;
        }
    }

    fn end(&self, board: &mut SimulatedBoard) -> TickCost {
        let stage = board.power_stage();
        let drives = stage.main_output && stage.started_at >= self.due;
        let latency = drives.then(|| stage.started_at - self.due);
        TickCost { latency, whole: board.now() - self.due, ..self.cost }
    }
}
