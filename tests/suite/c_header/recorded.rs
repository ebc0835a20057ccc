//! Runs of the whole firmware in closed loop, recorded as what the controller in C is given and has to answer.

use upright::board::Output;
use upright::control::actuator::Drive;
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{HarnessError, Pace, Pins, Recording, Target, record, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;

/// A defect: it changes what is on the wires in a tick.
pub(crate) type Defect = fn(&mut Pins, &mut Output);

/// One tick as the controller in C reports it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ControllerTick {
    pub(crate) state: u32,
    pub(crate) fault: u32,
    /// Bits of the duty, or pulses.
    pub(crate) duty: u32,
    /// Whether the motor is on.
    pub(crate) is_on: bool,
    /// Bits of requested force, applied force, governed set-point, estimate and innovation.
    pub(crate) values: Vec<u32>,
}

impl ControllerTick {
    /// From the words of a tick that `replay.c` writes.
    pub(crate) fn of(words: &[u32]) -> Self {
        Self {
            state: words[0],
            fault: words[1],
            duty: words[2],
            is_on: words[3] != 0,
            values: words[4..].to_vec(),
        }
    }
}

/// `UPRIGHT_BALANCING` and `UPRIGHT_FAULT`.
pub(crate) const BALANCING: u32 = 3;
pub(crate) const FAULT: u32 = 4;

/// A run of the firmware.
#[derive(Debug, Clone)]
pub(crate) struct FirmwareRun {
    /// What the controller in C is given, from power-up on.
    pub(crate) input: Vec<Vec<u32>>,
    /// What it has to answer from the first tick of balancing on, up to the tick of a fault.
    pub(crate) wanted: Vec<ControllerTick>,
    /// The firmware's output in every tick.
    pub(crate) outputs: Vec<Output>,
    /// The first tick of balancing.
    pub(crate) first: usize,
    pub(crate) fault: Option<Fault>,
}

/// The firmware, with its wires tapped.
struct Tap<'a> {
    target: &'a mut dyn Target,
    defect: Option<(usize, Defect)>,
    counters: Vec<Vec<u32>>,
    outputs: Vec<Output>,
}

impl Target for Tap<'_> {
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError> {
        let defect = self.defect.filter(|(from, _)| self.counters.len() >= *from);
        let mut pins = pins.clone();
        if let Some((_, change)) = defect {
            let mut unchanged = Output::OFF;
            change(&mut pins, &mut unchanged);
        }
        let mut output = self.target.tick(&pins, serial)?;
        self.counters.push(pins.raw_counts.to_vec());
        self.outputs.push(output);
        if let Some((_, change)) = defect {
            change(&mut pins, &mut output);
        }
        Ok(output)
    }

    fn pace(&self) -> Pace {
        self.target.pace()
    }
}

/// A run of `ticks` ticks of balancing with a small lean at the start, a step of the set-point and back, and noise.
pub(crate) fn scenario(rig: &Rig, law: Law, ticks: u32) -> Scenario {
    let period_s = rig.tick.period_s;
    let at = |share: f64| (share * f64::from(ticks)).round() * period_s;
    let mut scenario = Scenario::at_rest(rig, law);
    scenario.start[2] = 0.002;
    Scenario {
        duration_s: f64::from(ticks) * period_s,
        step_m: 0.05,
        step_at_s: at(0.2),
        step_until_s: at(0.6),
        force_noise_n: 0.05,
        seed: 7,
        counter_start: u32::MAX - 3,
        ..scenario
    }
}

/// Runs the firmware, with a defect from a tick of balancing on.
pub(crate) fn recorded(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    defect: Option<(usize, Defect)>,
) -> FirmwareRun {
    let run = |defect| {
        with_firmware(table, |target| {
            let mut tap = Tap { target, defect, counters: Vec::new(), outputs: Vec::new() };
            let recording = record(rig, table, scenario, &mut tap).unwrap();
            // The last tick only fetches the telemetry of the one before.
            let first = tap.counters.len() - 1 - recording.ticks.len();
            (recording, tap.counters, tap.outputs, first)
        })
        .unwrap()
    };
    let (mut recording, mut counters, mut outputs, mut first) = run(None);
    if let Some((after, change)) = defect {
        (recording, counters, outputs, first) = run(Some((first + after, change)));
    }
    let wanted = wanted(&recording, &outputs[first..]);
    let arm = first - table.limits.arm_ticks as usize + 1;
    let law_index = table.laws.present().position(|(law, _)| law == scenario.law).unwrap() as u32;
    let period_s = rig.tick.period_s;
    let input = counters.iter().enumerate().map(|(tick, counters)| {
        let (mut action, mut setpoint) = (0, 0.0);
        if tick == 0 {
            action |= 1 | 2 | law_index << 8;
        }
        if tick == arm {
            action |= 4;
        }
        if tick >= arm {
            action |= 8;
            setpoint = scenario.target_m(tick.saturating_sub(first) as f64 * period_s) as f32;
        }
        [action, setpoint.to_bits()].into_iter().chain(counters.iter().copied()).collect()
    });
    FirmwareRun { input: input.collect(), wanted, outputs, first, fault: recording.fault }
}

/// The command of an output: bits of the duty, or pulses.
pub(crate) fn command(output: &Output) -> u32 {
    match output.drive {
        Drive::Steps(pulses) => pulses as u32,
        Drive::Force(_) | Drive::Duty(_) => output.duty.to_bits(),
    }
}

/// What the controller in C has to answer while the firmware balances, and in the tick in which it turns the motor off.
fn wanted(recording: &Recording, outputs: &[Output]) -> Vec<ControllerTick> {
    let balances = |state| state == State::Balancing;
    let balanced = recording.ticks.iter().take_while(|tick| balances(tick.state)).count();
    let until = recording.ticks.len().min(balanced + 1);
    let ticks = recording.ticks[..until].iter().zip(outputs);
    ticks
        .map(|(tick, output)| {
            let [estimates @ .., setpoint, requested, applied] = tick.bits.as_slice() else { panic!("bits") };
            let values = [requested, applied, setpoint].into_iter().chain(estimates).copied().collect();
            let fault = recording.fault.filter(|_| !balances(tick.state)).map_or(0, |fault| fault.code());
            let state = if balances(tick.state) { BALANCING } else { FAULT };
            ControllerTick { state, fault: fault.into(), duty: command(output), is_on: output.enable, values }
        })
        .collect()
}
