//! Runs of the firmware on the host, recorded as what an image is given and has to answer.

use super::image::SINGLE;
use crate::in_the_loop::scenarios;
use crate::published::rig_and_table_with_motions;
use upright::board::Output;
use upright::protocol::frame;
use upright::protocol::message::Request;
use upright::protocol::simulated_pins::{MAX_PINS_IN, MAX_PINS_OUT, PinsOut};
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{HarnessError, Pace, Pins, Target, World, record, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_plan::{hangs, up_and_down};

/// A recorded run.
pub(super) struct Replay {
    pub(super) name: &'static str,
    /// The rig, for the first byte that the image reads.
    pub(super) selection: u8,
    /// A frame for the pins of each tick.
    pub(super) input: Vec<u8>,
    /// For each tick, what was sent after the one before, and a frame for the output.
    pub(super) wanted: Vec<u8>,
    /// Where each tick ends in `wanted`.
    pub(super) ends: Vec<usize>,
}

impl Replay {
    /// The same with another byte in the middle of the input.
    pub(super) fn with_another_count(&self) -> Self {
        let (mut input, wanted, ends) = (self.input.clone(), self.wanted.clone(), self.ends.clone());
        // The first counter is at the beginning of a frame, after its length.
        let begin =
            input.len() / 2 + input[input.len() / 2..].iter().position(|&byte| byte == 0).unwrap() + 1;
        input[begin + 2] ^= 1;
        Self { name: self.name, selection: self.selection, input, wanted, ends }
    }
}

/// The firmware, with its wires tapped.
struct Tap<'a> {
    target: &'a mut dyn Target,
    sent: u32,
    replay: Replay,
}

impl Target for Tap<'_> {
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError> {
        let (mut scratch, mut out) = ([0; MAX_PINS_IN], [0; MAX_PINS_IN]);
        self.replay.input.extend_from_slice(frame::encode(pins, &mut scratch, &mut out)?);
        let begin = serial.len();
        let output = self.target.tick(pins, serial)?;
        self.replay.wanted.extend_from_slice(&serial[begin..]);
        self.sent += (serial.len() - begin) as u32;
        let (mut scratch, mut out) = ([0; MAX_PINS_OUT], [0; MAX_PINS_OUT]);
        let message = PinsOut { output, sent: self.sent };
        self.replay.wanted.extend_from_slice(frame::encode(&message, &mut scratch, &mut out)?);
        self.replay.ends.push(self.replay.wanted.len());
        Ok(output)
    }

    fn pace(&self) -> Pace {
        self.target.pace()
    }
}

/// Records what `run` does with the firmware.
fn recorded(name: &'static str, table: &TableValues, run: impl FnOnce(&mut dyn Target)) -> Replay {
    let selection = if table.sensors() == 2 { SINGLE } else { 0 };
    let replay = Replay { name, selection, input: Vec::new(), wanted: Vec::new(), ends: Vec::new() };
    with_firmware(table, |target| {
        let mut tap = Tap { target, sent: 0, replay };
        run(&mut tap);
        tap.replay
    })
    .unwrap()
}

/// The golden traces with one law, both motions of two rigs, and those rigs at rest. Each begins with power-up.
pub(super) fn runs() -> Vec<Replay> {
    let (rig, table) = rig_and_table_with_motions("quadruple-paper");
    let golden = scenarios(rig, false).into_iter().map(|(name, scenario)| {
        let name = ["lqr-step", "lqr-tilt", "pole-placement-step", "pole-placement-tilt"]
            .into_iter()
            .find(|known| *known == name)
            .unwrap();
        let scenario = Scenario { duration_s: 0.5, ..scenario };
        recorded(name, table, |tap| assert_eq!(record(rig, table, &scenario, tap).unwrap().fault, None))
    });
    let motions = ["quadruple-paper", "single-quanser-ip02"].into_iter().map(|name| {
        let (rig, table) = rig_and_table_with_motions(name);
        let named = if name == "quadruple-paper" { "four links up and down" } else { "one link up and down" };
        let scenario = up_and_down(rig, table, 0.5).unwrap();
        recorded(named, table, |tap| assert!(hangs(&record(rig, table, &scenario, tap).unwrap())))
    });
    let rest = ["quadruple-paper", "single-quanser-ip02"].map(at_rest);
    golden.chain(motions).chain(rest).collect()
}

/// Ticks of a rig at rest.
const REST_TICKS: usize = 10_000;
/// The tick in which a counter is a count off.
const KICK: usize = 5;

/// The firmware balances, a link's counter is one count off in one tick, and then all counters stand still: estimates
/// and outputs decay until they are subnormal.
fn at_rest(rig: &'static str) -> Replay {
    let (rig, table) = rig_and_table_with_motions(rig);
    let name = if table.sensors() == 2 { "one link at rest" } else { "four links at rest" };
    recorded(name, table, |tap| stand_still(rig, table, tap))
}

/// Balances, and then nothing moves any more.
pub(crate) fn stand_still(rig: &Rig, table: &TableValues, target: &mut dyn Target) {
    let mut world = World::new(rig, table, &Scenario::at_rest(rig, Law::Lqr), target).unwrap();
    world.raise(Some(0.0)).unwrap();
    let still = world.inputs();
    for tick in 0..REST_TICKS {
        let mut pins = still.clone();
        if tick == KICK {
            pins.raw_counts[1] = pins.raw_counts[1].wrapping_add(1) & 0xffff;
        }
        if tick.is_multiple_of(50) {
            world.session.send(Request::KeepAlive);
        }
        world.session.tick(&pins).unwrap();
    }
    assert_eq!((world.session.status().state, world.session.fault()), (State::Balancing, None));
}
