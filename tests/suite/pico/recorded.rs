//! Runs of the firmware on the host, recorded as what the wires of a Pico carry.

use std::time::Duration;

use upright::board::Output;
use upright::supervision::supervisor::State;
use upright::table::SensorRow;
use upright_closed_loop::client::{AnyTelemetry, Client, Received};
use upright_closed_loop::harness::{HarnessError, Pace, Pins, Target, healthy, record, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;

/// Clocks of a PWM period of the chip.
pub(crate) const PERIOD: u32 = 6250;
/// Ticks before the host sends anything: the chip is made known to the bus.
pub(crate) const WARM_UP_TICKS: usize = 60;
/// Volts of the supply per step of the chip's converter.
const VOLTS_PER_STEP: f32 = 3.3 * 11.0 / 4096.0;

/// A recorded run.
pub(crate) struct Recorded {
    /// How the sensors are read.
    pub(crate) sensors: Vec<SensorRow>,
    pub(crate) pins: Vec<Pins>,
    pub(crate) outputs: Vec<Output>,
    /// What the firmware has sent, by the tick in which it had been sent.
    pub(crate) sent: Vec<Vec<u8>>,
}

impl Recorded {
    /// Leaves out what comes 50 ticks after the motor has gone off for good.
    pub(crate) fn cut_after_stop(&mut self) {
        self.truncate(self.last_on() + 50);
    }

    /// The last tick with the motor on.
    pub(crate) fn last_on(&self) -> usize {
        self.outputs.iter().rposition(|output| output.enable).unwrap()
    }

    /// Leaves out everything from a tick on.
    pub(crate) fn truncate(&mut self, ticks: usize) {
        self.pins.truncate(ticks);
        self.outputs.truncate(ticks);
        self.sent.truncate(ticks);
    }

    /// The state in the last telemetry.
    pub(crate) fn last_state(&self) -> State {
        telemetry(&self.sent.concat()).last().unwrap().state
    }
}

/// The firmware, with its wires tapped. A defect changes what is on them, from that many ticks after the first one in
/// its state.
struct Tap<'a, D> {
    target: &'a mut dyn Target,
    defect: Option<(State, usize, D)>,
    client: Client,
    since: Option<usize>,
    /// All pulses so far, for a drive that takes them: what the board counts, whatever a hand does with the cart.
    pulses: Option<u32>,
    run: Recorded,
}

impl<D: FnMut(&mut Pins)> Target for Tap<'_, D> {
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError> {
        let mut pins = pins.clone();
        pins.supply_v = steps(pins.supply_v) as f32 * VOLTS_PER_STEP;
        if let Some(pulses) = self.pulses {
            pins.raw_counts[0] = pulses;
        }
        self.since = self.since.map(|ticks| ticks + 1);
        if let Some((_, from, change)) = &mut self.defect
            && self.since >= Some(*from)
        {
            change(&mut pins);
        }
        let begin = serial.len();
        let output = self.target.tick(&pins, serial)?;
        self.pulses = self.pulses.map(|pulses| pulses.wrapping_add_signed(output.pulses()));
        for &byte in &serial[begin..] {
            if let Some(Received::Telemetry(telemetry)) = self.client.receive(byte, Duration::ZERO)
                && self.defect.as_ref().is_some_and(|defect| defect.0 == telemetry.state)
            {
                self.since = self.since.or(Some(0));
            }
        }
        self.run.sent.push(serial[begin..].to_vec());
        self.run.pins.push(pins);
        self.run.outputs.push(output);
        Ok(output)
    }

    fn pace(&self) -> Pace {
        self.target.pace()
    }
}

/// What the chip's converter reads at this voltage.
pub(crate) fn steps(supply_v: f32) -> u32 {
    (supply_v / VOLTS_PER_STEP).round() as u32
}

/// Records a scenario; the defect begins that many ticks after the first one in a state.
pub(crate) fn recorded<D: FnMut(&mut Pins)>(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    defect: Option<(State, usize, D)>,
) -> Recorded {
    // Ends early if the defect ends it.
    recorded_while(table, defect, |target| drop(record(rig, table, scenario, target)))
}

/// Records what is done with the firmware, after a while in which the host sends nothing.
pub(crate) fn recorded_while<D: FnMut(&mut Pins)>(
    table: &TableValues,
    defect: Option<(State, usize, D)>,
    act: impl FnOnce(&mut dyn Target),
) -> Recorded {
    let sensors = table.rows().to_vec();
    let run = Recorded { sensors, pins: Vec::new(), outputs: Vec::new(), sent: Vec::new() };
    with_firmware(table, |target| {
        let mut tap = Tap {
            target,
            defect,
            client: Client::default(),
            since: None,
            pulses: table.drive.pulses().map(|_| 0),
            run,
        };
        let supply_v = table.drive.supply_v().unwrap_or_default();
        let hanging = healthy(&vec![0; table.sensors()], supply_v);
        for _ in 0..WARM_UP_TICKS {
            tap.tick(&hanging, &mut Vec::new()).unwrap();
        }
        act(&mut tap);
        tap.run
    })
    .unwrap()
}

/// The telemetry in what was sent, without the cycles, which the host does not count.
pub(crate) fn telemetry(sent: &[u8]) -> Vec<AnyTelemetry> {
    let mut client = Client::default();
    let messages = sent.iter().filter_map(|&byte| client.receive(byte, Duration::ZERO));
    let telemetry = messages.filter_map(|message| match message {
        Received::Telemetry(telemetry) => Some(AnyTelemetry { cycles: 0, worst_cycles: 0, ..telemetry }),
        _ => None,
    });
    telemetry.collect()
}
