//! The emulated chip: `boards/rp2040/harness/replay.mjs`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use super::recorded::{Recorded, steps};
use crate::equipment::if_possible;
use upright::boards::named;
use upright::boards::parts::PartInterface;
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::table::SensorRow;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_test_support::equipment::{is_required, not_exercised};
use upright_test_support::limits::{Lines, Running};
use upright_test_support::repository;
use upright_tool::image::{Prebuilt, build_for};

/// The outputs of the chip after a tick, and what it has sent since the tick before.
pub(super) struct Answer {
    pub(super) level: u32,
    pub(super) positive: bool,
    pub(super) enabled: bool,
    pub(super) cycles: u32,
    /// The most stack in use so far (bytes).
    pub(super) stack: u32,
    pub(super) sent: Vec<u8>,
    pub(super) trains: Vec<Train>,
}

/// The pulses that the chip has given in a tick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Train {
    pub(super) tick: usize,
    /// Their sum, by direction.
    pub(super) pulses: i32,
    /// Cycles to the first one, of the shortest and of the longest interval.
    pub(super) first: u32,
    pub(super) shortest: u32,
    pub(super) longest: u32,
    /// Cycles of the shortest pulse, and from a change of the direction to a pulse, at least.
    pub(super) width: u32,
    pub(super) setup: u32,
}

/// The emulator with an image.
pub(super) struct Chip {
    process: Running,
    answers: Lines,
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

fn harness() -> PathBuf {
    repository().join("boards/rp2040/harness")
}

/// The image for this rig, if the compiler and the emulator are there, as a tool without a compiler writes it.
pub(super) fn uf2_with_motions(rig: &Rig, table: &TableValues) -> Option<PathBuf> {
    let has_emulator = harness().join("node_modules/rp2040js").is_dir();
    assert!(has_emulator || !is_required("UPRIGHT_REQUIRE_PICO"), "run `npm ci` in boards/rp2040/harness");
    if !has_emulator {
        not_exercised("the image for a Pico: run `npm ci` in boards/rp2040/harness");
        return None;
    }
    let pico = named("pico").unwrap();
    let compiled = if_possible(build_for(pico, rig, table), "the image for a Pico")?;
    let mut prebuilt = Prebuilt::none_by("of this test");
    prebuilt.take_in(pico, table, &compiled.ticks).unwrap();
    prebuilt.build_for(pico, rig, table).unwrap()?.uf2
}

impl Chip {
    pub(super) fn start(uf2: &Path, encoders: usize) -> Self {
        let mut node = Command::new("node");
        node.current_dir(harness()).arg("replay.mjs").arg(uf2).arg(encoders.to_string());
        let mut process = Running(node.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap());
        let answers = Lines::from_pipe(process.stdout.take().unwrap());
        Self { process, answers }
    }

    /// Sends a line and takes the answer.
    fn ask(&mut self, line: &Value) -> Value {
        writeln!(self.process.stdin.as_mut().unwrap(), "{line}").unwrap();
        let answer = self.answers.next("the emulator's answer");
        serde_json::from_str(&answer).unwrap_or_else(|error| panic!("{error}: {answer}"))
    }

    /// Runs the ticks of a recorded run.
    pub(super) fn replay(&mut self, run: &Recorded) -> Vec<Answer> {
        self.replay_and(run, run.pins.len(), |_| ())
    }

    /// The same; acts before one of the ticks.
    pub(super) fn replay_and(
        &mut self,
        run: &Recorded,
        at: usize,
        mut act: impl FnMut(&mut Self),
    ) -> Vec<Answer> {
        // The host's counters have 32 and 16 bits, the chip's have 32.
        let mut counts: Vec<i64> = Vec::new();
        let mut last: Vec<u32> = Vec::new();
        let ticks = run.pins.iter().map(|pins| {
            if last.is_empty() {
                (counts, last) = (vec![0; pins.raw_counts.len()], pins.raw_counts.to_vec());
            }
            for (place, (&now, before)) in pins.raw_counts.iter().zip(&mut last).enumerate() {
                let moved = now.wrapping_sub(*before);
                counts[place] +=
                    if place == 0 { i64::from(moved as i32) } else { i64::from(moved as u16 as i16) };
                *before = now;
            }
            json!({
                "counts": counts,
                "registers": registers(run, &pins.raw_counts),
                "limitLow": pins.contacts.limit_low,
                "limitHigh": pins.contacts.limit_high,
                "stop": pins.contacts.emergency_stop,
                "fault": pins.contacts.driver_fault,
                "supply": steps(pins.supply_v),
                "received": hexadecimal(&pins.received),
            })
        });
        let ticks: Vec<Value> = ticks.collect();
        let answers = ticks.iter().enumerate().map(|(number, tick)| {
            if number == at {
                act(self);
            }
            answer(&self.ask(tick))
        });
        answers.collect()
    }

    /// Opens the emergency stop; returns the cycles until the power stage is disabled.
    pub(super) fn open_stop(&mut self, limit: u32) -> u32 {
        let opened = self.ask(&json!({ "openStop": limit }));
        opened["disabled"].as_u64().unwrap_or_else(|| panic!("{opened}")) as u32
    }

    /// Calls a function of the image with each pair of numbers; returns its results and its most cycles.
    pub(super) fn call(&mut self, address: u32, pairs: &[(f32, f32)]) -> (Vec<f32>, u32) {
        let words: Vec<u8> = pairs
            .iter()
            .flat_map(|(first, second)| [first, second])
            .flat_map(|word| word.to_le_bytes())
            .collect();
        let called = self.ask(&json!({ "call": address, "pairs": hexadecimal(&words) }));
        let results = bytes(&called["results"]);
        let results = results.chunks(4).map(|word| f32::from_le_bytes(word.try_into().unwrap())).collect();
        (results, called["cycles"].as_u64().unwrap() as u32)
    }

    /// Replaces the first such instruction of a function.
    pub(super) fn replace(&mut self, function: u32, old: u16, new: u16) {
        self.ask(&json!({ "replace": [function, old, new] }));
    }

    /// Stops the chip's ticks; returns the cycles until the power stage is disabled, and until the watchdog resets the
    /// chip; and until the last step pulse.
    pub(super) fn stop_ticks(&mut self, limit: u32) -> ([u32; 2], i64) {
        let stopped = self.ask(&json!({ "stopTicks": limit }));
        let cycles = |name| stopped[name].as_u64().unwrap_or_else(|| panic!("{stopped}")) as u32;
        (["disabled", "reset"].map(cycles), stopped["pulse"].as_i64().unwrap())
    }
}

/// Registers of the sensors on two wires with these readings; null for an encoder. A `run` may spoil one.
fn registers(run: &Recorded, raw_counts: &[u32]) -> Vec<Value> {
    let of = |(row, &count): (&SensorRow, &u32)| match (row.kind.interface(), row.kind.reading()) {
        (Some(PartInterface::TwoWires(part)), Some(reading)) => {
            let is_bad = count & BAD_SAMPLE != 0;
            let angle = (count & ((1 << reading.bits) - 1)) as u16;
            let values = part.registers(if is_bad { None } else { Some(angle) });
            json!({ "address": part.address, "first": part.register, "values": values.as_slice() })
        }
        _ => Value::Null,
    };
    run.sensors.iter().zip(raw_counts).map(of).collect()
}

fn bytes(digits: &Value) -> Vec<u8> {
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.as_str().unwrap().as_bytes().chunks(2).map(byte).collect()
}

fn train(object: &Value) -> Train {
    let number = |name: &str| object[name].as_i64().unwrap();
    Train {
        tick: number("tick") as usize,
        pulses: number("pulses") as i32,
        first: number("first") as u32,
        shortest: number("shortest") as u32,
        longest: number("longest") as u32,
        width: number("width") as u32,
        setup: number("setup") as u32,
    }
}

fn answer(object: &Value) -> Answer {
    let number = |name: &str| object[name].as_u64().unwrap() as u32;
    let flag = |name: &str| object[name].as_bool().unwrap();
    Answer {
        level: number("level"),
        positive: flag("positive"),
        enabled: flag("enabled"),
        cycles: number("cycles"),
        stack: number("stack"),
        sent: bytes(&object["sent"]),
        trains: object["trains"].as_array().unwrap().iter().map(train).collect(),
    }
}
