//! Where the time of each tick goes, instruction by instruction.

use rustc_demangle::demangle;
use upright_board::{Board, Image, Stopped, Time};

use super::SYS_TICK;

/// A part of the tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// From the time at which the tick is due to the first input: the interrupt's entry.
    Entry,
    /// All inputs are read.
    Inputs,
    /// Supervisor and controller.
    Control,
    /// The motor is driven.
    Output,
    /// After the output: a command, telemetry, the prediction, checks of the table, the return.
    Rest,
}

/// Number of parts.
pub(super) const PARTS: usize = 5;

/// What the source says of an instruction; nothing if it belongs to whatever has called it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Place {
    part: Option<Part>,
    controller: Option<bool>,
}

/// One tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct TickCost {
    /// From the time at which it is due to the restart of the motor's timer with its new duty; none with the motor
    /// off.
    pub(super) latency: Option<Time>,
    /// By part.
    pub(super) parts: [Time; PARTS],
    /// Of this, the controller: the control law with its estimate, and the prediction.
    pub(super) controller: Time,
    /// From the time at which it is due to its end.
    pub(super) whole: Time,
}

/// Runs a board and measures its ticks.
#[derive(Debug)]
pub(super) struct Meter {
    /// By half-words of flash.
    places: Vec<Place>,
    running: Option<Running>,
    /// All ticks that have ended.
    pub(super) ticks: Vec<TickCost>,
}

#[derive(Debug, Clone, Copy)]
struct Running {
    due: Time,
    part: Part,
    in_controller: bool,
    cost: TickCost,
}

impl Meter {
    /// With the image's debug information; without it, all is [`Part::Entry`].
    pub(super) fn new(image: &Image) -> Self {
        let lines = image.lines();
        let place = |half_word: usize| {
            let names =
                lines.as_ref().map_or(Vec::new(), |lines| lines.functions(FLASH + 2 * half_word as u32));
            Place::of(&names)
        };
        Self { places: (0..image.end() / 2).map(place).collect(), running: None, ticks: Vec::new() }
    }

    /// Runs until `end`; ticks are executed one instruction after the other.
    pub(super) fn run(&mut self, board: &mut Board, end: Time) -> Result<(), Stopped> {
        while board.now() < end {
            let Some(mut running) = self.running.take() else {
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
            } else {
                self.running = Some(running);
            }
        }
        Ok(())
    }
}

/// Where code is.
const FLASH: u32 = 0x0800_0000;

impl Running {
    fn new(due: Time) -> Self {
        Self { due, part: Part::Entry, in_controller: false, cost: TickCost::default() }
    }

    fn enter(&mut self, place: Option<&Place>) {
        let Place { part, controller } = place.copied().unwrap_or_default();
        self.part = part.unwrap_or(self.part);
        self.in_controller = controller.unwrap_or(self.in_controller);
    }

    fn spend(&mut self, time: Time) {
        self.cost.parts[self.part as usize] += time;
        if self.in_controller {
            self.cost.controller += time;
        }
    }

    fn end(self, board: &mut Board) -> TickCost {
        let stage = board.power_stage();
        let drives = stage.main_output && stage.started_at >= self.due;
        let latency = drives.then(|| stage.started_at - self.due);
        TickCost { latency, whole: board.now() - self.due, ..self.cost }
    }
}

impl Place {
    /// By the functions that an instruction is in, the innermost first.
    fn of(names: &[String]) -> Self {
        let paths: Vec<String> = names.iter().map(|name| format!("{:#}", demangle(name))).collect();
        let part = paths.iter().find_map(|path| part_of(path));
        let controller = paths.iter().find_map(|path| is_controller(path));
        Self { part, controller }
    }
}

/// The part of the tick that a function is, by its path.
fn part_of(path: &str) -> Option<Part> {
    let is =
        |owner: &str, names: &[&str]| path.contains(owner) && names.iter().any(|name| path.ends_with(name));
    if is("Hardware", &["::inputs"]) {
        Some(Part::Inputs)
    } else if is("Hardware", &["::drive"]) {
        Some(Part::Output)
    } else if is("firmware::Firmware", &["::accept", "::drive"]) {
        Some(Part::Control)
    } else if is("firmware::Firmware", &["::report", "::predict", "::complete"])
        || path.contains("protocol::queue")
        || is("Hardware", &["::feed_watchdog"])
    {
        Some(Part::Rest)
    } else {
        None
    }
}

/// Whether a function belongs to the controller; nothing if its caller says so.
fn is_controller(path: &str) -> Option<bool> {
    if path.contains("control::controller::Controller") {
        Some(true)
    } else if ["firmware::", "supervision::", "Hardware"].iter().any(|other| path.contains(other)) {
        Some(false)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::{Part, Place};

    #[test]
    fn the_innermost_function_with_a_part_decides() {
        let names =
            ["core::f32::abs", "upright::control::controller::Controller::predict"].map(str::to_owned);
        let mut chain = names.to_vec();
        assert_eq!(Place::of(&chain), Place { part: None, controller: Some(true) });
        chain.push("upright::firmware::Firmware<_,_,_>::complete".to_owned());
        assert_eq!(Place::of(&chain), Place { part: Some(Part::Rest), controller: Some(true) });
        assert_eq!(Place::of(&[]), Place::default());
    }
}
