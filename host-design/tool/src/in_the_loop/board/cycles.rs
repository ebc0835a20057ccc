//! Execution time of the ticks on the board, measured in a run of the image that is flashed.

use serde::Serialize;
use upright::supervision::fault::Fault;
use upright_board::{Conditions, Image, TickCost, TickPart, Time, UNITS_PER_MICROSECOND};
use upright_closed_loop::harness::{HarnessError, World, record};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_plan::up_and_down;

use super::VirtualBoard;
use super::places::places;
use crate::in_the_loop::RunError;

/// A duration, in cycles of the core, which are approximate, and in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Span {
    /// Cycles of the core.
    pub cycles: u32,
    /// Microseconds.
    pub us: f64,
}

/// Execution times of some ticks: the largest values, or the medians.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TickFigures {
    /// Number of ticks.
    pub ticks: usize,
    /// From the time at which the tick is due to the motor's new duty; `None` with the motor off.
    pub latency: Option<Span>,
    /// Latency in excess of the shortest one.
    pub jitter: Option<Span>,
    /// From the time at which the tick is due to its end.
    pub whole: Span,
    /// Exception entry, up to the first input.
    pub entry: Span,
    /// Reading of all inputs.
    pub inputs: Span,
    /// Supervisor and controller.
    pub control: Span,
    /// Output to the motor.
    pub output: Span,
    /// After the output: a command, telemetry, the prediction, checks of the table.
    pub rest: Span,
    /// The controller alone, with its prediction; part of the above.
    pub controller: Span,
}

/// Execution times of the ticks of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TickCycles {
    /// Frequency of the core (Hz).
    pub core_hz: u32,
    /// The tick's period.
    pub period: Span,
    /// Ticks without the control law: with the motor off (disarmed, homing, armed), and those of the jog.
    pub off: Option<TickFigures>,
    /// Ticks of balancing.
    pub balancing: Option<TickFigures>,
    /// The medians of balancing.
    pub typical: Option<TickFigures>,
    /// Ticks of raising and lowering, and of balancing in between.
    pub moving: Option<TickFigures>,
    /// The medians of these.
    pub typical_moving: Option<TickFigures>,
    /// All ticks since the reset.
    pub all: TickFigures,
    /// Why the run ended early, if it did.
    pub ended: Option<String>,
}

/// A tick that takes more than a quarter of its period.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the longest tick takes {whole_us:.1} µs ({cycles} cycles, by ARM's table), more than a quarter of its period, {quarter_us:.1} µs: \
     set `[tick] period_s` to at least {least_s:.2e}, or use a rig with fewer states"
)]
pub struct TooLong {
    whole_us: f64,
    cycles: u32,
    quarter_us: f64,
    least_s: f64,
}

impl TickCycles {
    /// No tick may take longer than a quarter of its period: the rest is a margin for what the model does not cover.
    ///
    /// # Errors
    /// [`TooLong`]
    pub fn check(&self) -> Result<(), TooLong> {
        let (whole, quarter_us) = (self.all.whole, self.period.us / 4.0);
        if whole.us <= quarter_us {
            return Ok(());
        }
        let (whole_us, cycles) = (whole.us, whole.cycles);
        // Rounded up to two digits.
        let exact_s = 4e-6 * whole_us;
        let digit = 10f64.powf(exact_s.log10().floor() - 1.0);
        Err(TooLong { whole_us, cycles, quarter_us, least_s: (exact_s / digit).ceil() * digit })
    }

    /// The times of a run that balances and of one that moves; `None` without ticks.
    fn of(balances: MeasuredRun, moves: MeasuredRun, period_s: f64) -> Option<Self> {
        let all = [balances.ticks.as_slice(), &moves.ticks].concat();
        let select = |ticks: &[TickCost], drives: bool| -> Vec<TickCost> {
            ticks.iter().copied().filter(|tick| tick.latency.is_some() == drives).collect()
        };
        let (off, balancing) = (select(&all, false), select(&balances.ticks, true));
        let (moving, core_hz) = (select(&moves.ticks, true), balances.core_hz);
        let period = Span { cycles: (period_s * f64::from(core_hz)).round() as u32, us: 1e6 * period_s };
        Some(Self {
            core_hz,
            period,
            off: TickFigures::from_ticks(&off, core_hz, largest),
            balancing: TickFigures::from_ticks(&balancing, core_hz, largest),
            typical: TickFigures::from_ticks(&balancing, core_hz, median),
            moving: TickFigures::from_ticks(&moving, core_hz, largest),
            typical_moving: TickFigures::from_ticks(&moving, core_hz, median),
            all: TickFigures::from_ticks(&all, core_hz, largest)?,
            ended: balances.ended.or(moves.ended),
        })
    }
}

fn largest(times: &mut [Time]) -> Option<Time> {
    times.iter().copied().max()
}

fn median(times: &mut [Time]) -> Option<Time> {
    times.sort_unstable();
    times.get(times.len() / 2).copied()
}

impl TickFigures {
    /// The figures of these ticks; `choose` picks each from its values in all ticks.
    fn from_ticks(ticks: &[TickCost], core_hz: u32, choose: fn(&mut [Time]) -> Option<Time>) -> Option<Self> {
        let span = |time: Time| {
            let us = time as f64 / UNITS_PER_MICROSECOND as f64;
            Span { cycles: (us * 1e-6 * f64::from(core_hz)).round() as u32, us }
        };
        let chosen = |of: &dyn Fn(&TickCost) -> Option<Time>| {
            choose(&mut ticks.iter().filter_map(of).collect::<Vec<_>>()).map(span)
        };
        let part = |part: TickPart| chosen(&|tick| Some(tick.parts[part as usize]));
        let quickest = ticks.iter().filter_map(|tick| tick.latency).min().unwrap_or(0);
        Some(Self {
            ticks: ticks.len(),
            latency: chosen(&|tick| tick.latency),
            jitter: chosen(&|tick| tick.latency.map(|latency| latency - quickest)),
            whole: chosen(&|tick| Some(tick.whole))?,
            entry: part(TickPart::Entry)?,
            inputs: part(TickPart::Inputs)?,
            control: part(TickPart::Control)?,
            output: part(TickPart::Output)?,
            rest: part(TickPart::Rest)?,
            controller: chosen(&|tick| Some(tick.controller))?,
        })
    }
}

/// Time of balancing between raising and lowering (s).
const UPRIGHT_S: f64 = 0.1;

/// What a board does in a run: returns the fault that ended it, and counts the ticks in which the law drives.
type TickAction<'a> = dyn Fn(&mut VirtualBoard, &mut usize) -> Result<Option<Fault>, HarnessError> + 'a;

/// The measured ticks of a run.
#[derive(Default)]
struct MeasuredRun {
    ticks: Vec<TickCost>,
    core_hz: u32,
    ended: Option<String>,
}

/// Runs the image from power-up through homing, sign check and arming to balancing, for the duration of `scenario`,
/// and measures every tick. If the table has a swing-up, does the same from power-up through raising and lowering.
///
/// # Errors
/// [`RunError`] if the image does something that the hardware does not allow, or has no tick. A rig that does not
/// begin to balance is no error: see [`TickCycles::ended`].
pub fn measure(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    image: &Image,
    conditions: &Conditions,
) -> Result<TickCycles, RunError> {
    let places = places(image);
    let run = |action: &TickAction<'_>| {
        let mut board = VirtualBoard::start(image, conditions, table)?;
        board.measure_ticks(places.clone());
        let mut driven = 0;
        let ended = match action(&mut board, &mut driven) {
            Ok(fault) => fault.map(|fault| format!("it ends with fault {fault}")),
            Err(error @ HarnessError::Board(_)) => return Err(error),
            Err(error) => Some(error.to_string()),
        };
        let mut ticks = board.ticks().to_vec();
        // The jog has an output too, before the law drives.
        let before = ticks.len().saturating_sub(driven);
        ticks.iter_mut().take(before).for_each(|tick| tick.latency = None);
        Ok(MeasuredRun { core_hz: board.board().core_hz(), ticks, ended })
    };
    let balances = run(&|board, driven| balance(rig, table, scenario, board, driven))?;
    let moves = match up_and_down(rig, table, UPRIGHT_S) {
        Ok(motion) => run(&|board, driven| {
            *driven = (motion.duration_s / rig.tick.period_s) as usize;
            Ok(record(rig, table, &motion, board)?.fault)
        })?,
        Err(_) => MeasuredRun::default(),
    };
    let cycles = TickCycles::of(balances, moves, rig.tick.period_s);
    cycles.ok_or_else(|| HarnessError::Board("has no tick".to_owned()).into())
}

/// Balances for the duration of `scenario`, and counts its ticks in `balanced`; returns the fault that ended it.
fn balance(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    board: &mut VirtualBoard,
    balanced: &mut usize,
) -> Result<Option<Fault>, HarnessError> {
    let mut world = World::new(rig, table, scenario, board)?;
    if table.observer.is_none() {
        // It never balances.
        let inputs = world.inputs();
        (0..1000).try_for_each(|_| world.session.tick(&inputs).map(drop))?;
        return Err(HarnessError::FullState);
    }
    world.raise(None)?;
    let ticks = (scenario.duration_s / rig.tick.period_s) as usize;
    world.run(ticks, &mut [])?;
    *balanced = 1 + world.ticks();
    Ok(world.session.fault())
}
