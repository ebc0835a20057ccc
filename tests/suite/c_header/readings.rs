//! Readings that cannot be, and readings that wrap: counters that are cleared, absolute sensors, potentiometers.

use super::program::{Program, is_there};
use super::recorded::{BALANCING, ControllerTick, FAULT, FirmwareRun, recorded, scenario};
use super::{STRICT, differing, first_difference};
use crate::published::{rig, rig_and_table, table};
use upright::supervision::fault::Fault;
use upright::table::Law;
use upright_design::export::c_header;
use upright_design::rig::{LinkEncoder, Rig};

const NOT_HOMED: u32 = 0;
const READY: u32 = 1;
/// What `replay.c` says if something was refused.
const REFUSED: u32 = 99;

/// What is done before a tick: see `replay.c`.
const HOME: u32 = 1;
const ARM: u32 = 4;
const CLEAR: u32 = 16;
const TRIP: u32 = 64;

/// A rig with one link at the controller in C, tick by tick.
struct Link {
    input: Vec<Vec<u32>>,
}

impl Link {
    /// Homed with the link hanging, at this reading.
    fn homed_at(reading: u32) -> Self {
        Self { input: Vec::new() }.then(HOME, reading)
    }

    /// A tick with this reading of the link, before which something is done.
    fn then(mut self, action: u32, reading: u32) -> Self {
        self.input.push(vec![action, 0, 0, reading]);
        self
    }

    /// So many ticks with this reading.
    fn stays(self, ticks: u32, reading: u32) -> Self {
        (0..ticks).fold(self, |link, _| link.then(0, reading))
    }

    /// Turned from the last reading to this one, by at most `step` counts in a tick.
    fn turned(self, to: u32, step: i32) -> Self {
        let mut reading = self.input.last().unwrap()[3];
        let mut link = self;
        while reading != to {
            let left = to.wrapping_sub(reading) as i32;
            reading = reading.wrapping_add(left.clamp(-step, step) as u32);
            link = link.then(0, reading);
        }
        link
    }

    /// State and fault after every tick.
    fn answers(&self, header: &str) -> Vec<ControllerTick> {
        Program::that_replays(header, STRICT).replayed(&self.input)
    }

    /// State and fault after the last tick.
    fn at_the_end(&self, header: &str) -> (u32, u32) {
        self.answers(header).last().map(|tick| (tick.state, tick.fault)).unwrap()
    }
}

const ENCODER: (u32, u32) = (FAULT, Fault::Encoder as u32);

/// The header as it was: whatever a sensor reads is believed.
fn credulous(header: &str) -> String {
    let test = "if (moved > (uint32_t)upright_table.furthest_counts[i] || upright_is_dead(raw, i)) {";
    let changed = header.replace(test, "(void)moved;\n        if (false) {");
    assert_ne!(changed, header);
    changed
}

#[test]
fn a_counter_that_is_cleared_while_the_link_hangs_is_a_fault_and_never_balances() {
    if !is_there("gcc") {
        return;
    }
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let header = c_header(rig, table).unwrap();
    // Seven and a half turns after position 0, where an ESP32's pulse counter is cleared, more or less.
    let cleared = (table.sensors[1].turn_counts / 2 * 15) as u32;
    let hanging = || Link::homed_at(cleared).stays(50, cleared);
    let run = hanging().then(ARM, 0).then(ARM, 0).stays(1, 0).then(CLEAR, 0).stays(1, 0);
    let answers = run.answers(&header);
    let states: Vec<u32> = answers[51..].iter().map(|tick| tick.state).collect();
    assert_eq!(states, [REFUSED, REFUSED, FAULT, NOT_HOMED, NOT_HOMED]);
    assert_eq!(answers[53].fault, ENCODER.1);
    assert!(answers.iter().all(|tick| !tick.is_on && tick.duty == 0));
    // Negative control: with the link hanging, the motor comes on.
    let answers =
        hanging().stays(1, 0).then(ARM, 0).stays(table.limits.arm_ticks, 3).answers(&credulous(&header));
    assert!(
        answers.iter().any(|tick| tick.state == BALANCING && tick.is_on && f32::from_bits(tick.duty) != 0.0)
    );
    // A single glitch is rejected; behind another fault, a jump loses the position all the same.
    assert_eq!(hanging().stays(2, 0).stays(5, cleared).at_the_end(&header), (READY, 0));
    let [glitch, jump] = [2, 3].map(|ticks| hanging().then(TRIP, 0).stays(ticks - 1, 0));
    assert_eq!(glitch.then(0, cleared).then(CLEAR, cleared).at_the_end(&header), (READY, 0));
    assert_eq!(jump.then(CLEAR, 0).at_the_end(&header), (NOT_HOMED, 0));
    // Thrown by hand, at 25 turns a second.
    let fast = (25.0 * f64::from(table.sensors[1].turn_counts) * rig.tick.period_s) as i32;
    assert_eq!(hanging().turned(cleared + 9 * 4096, fast).at_the_end(&header), (READY, 0));
}

#[test]
fn readings_that_wrap_where_the_file_names_an_encoder_are_refused_at_the_seam() {
    if !is_there("gcc") {
        return;
    }
    let (rig, table) = rig_and_table("single-quanser-ip02");
    assert_eq!(table.sensors[1].turn_counts, 4096);
    let header = c_header(rig, table).unwrap();
    let turned_upright =
        |hanging: u32, upright: u32| Link::homed_at(hanging).turned(upright, 50).stays(9, upright);
    // Held at the seam of 12 bits, the reading changes between the highest and 0, as noise will have it.
    let noisy = [0, 4095, 4095, 0, 4095, 0, 0, 0, 4095, 4095, 4095, 0];
    let held =
        |link: Link| noisy.into_iter().cycle().take(3000).fold(link, |link, reading| link.then(0, reading));
    let at_seam = held(turned_upright(2047, 4095).then(ARM, 4095));
    assert_eq!(at_seam.at_the_end(&header), ENCODER);
    let answers = at_seam.answers(&credulous(&header));
    assert!(
        answers.iter().all(|tick| tick.state != FAULT && tick.state != BALANCING),
        "armed for ever, no fault"
    );
    // On the way: a turn too far.
    assert_eq!(turned_upright(1000, 0).stays(3, 4095).at_the_end(&header), ENCODER);
}

/// The readings of a link's absolute sensor of so many bits in a run, with another zero: as they come from the sensor,
/// with the bits that are finer than the firmware's.
fn readings(run: &FirmwareRun, bits: u32, zero: u32) -> Vec<Vec<u32>> {
    let finer = bits.saturating_sub(16);
    let reading = |tick: usize, count: u32| {
        (count.wrapping_add(zero) << finer | tick as u32 & ((1 << finer) - 1)) & ((1 << bits) - 1)
    };
    let rows = run.input.iter().enumerate();
    rows.map(|(tick, row)| row[..3].iter().copied().chain([reading(tick, row[3])]).collect()).collect()
}

fn with_sensor(bits: u8, travel_rad: Option<f64>) -> Rig {
    let mut rig = rig("single-absolute");
    rig.chain_mut().unwrap().links[0].encoder =
        Some(LinkEncoder::Absolute { bits, travel_rad, zero_counts: 2600, noise_rad: 1e-3 });
    rig
}

#[test]
fn an_absolute_sensor_gives_the_bits_of_the_firmware_wherever_its_readings_wrap() {
    if !is_there("gcc") {
        return;
    }
    for bits in [12, 14, 18] {
        let rig = with_sensor(bits, None);
        let values = table(&rig);
        let mut run = recorded(&rig, &values, &scenario(&rig, Law::Lqr, 1500), None);
        // The firmware takes the position from the zero in the file, the controller in C from where it is homed.
        run.input[0][3] = values.sensors[1].kind.reading().unwrap().zero_counts as u32;
        assert_eq!(run.fault, None);
        let program = Program::that_replays(&c_header(&rig, &values).unwrap(), STRICT);
        let upright = run.input[run.first][3];
        // As the firmware counts; then the seam at upright, between two readings, and a quarter turn from it.
        let bits = u32::from(bits);
        let turn = 1 << bits.min(16);
        for zero in [0, upright.wrapping_neg(), upright.wrapping_neg().wrapping_add(1), turn / 4] {
            let mut seen = FirmwareRun { input: readings(&run, bits, zero), ..run.clone() };
            let wraps = |rows: &[Vec<u32>]| {
                rows.windows(2).filter(|rows| rows[0][3].abs_diff(rows[1][3]) > 1 << (bits - 1)).count()
            };
            assert!(zero != upright.wrapping_neg() || wraps(&seen.input[run.first..]) > 10, "{bits}");
            let answers = program.replayed(&seen.input);
            assert_eq!(differing(&run, &answers), 0, "{bits} {zero} {}", first_difference(&run, &answers));
            // Negative control: without the wrap, the controller never balances at the seam.
            if zero == upright.wrapping_neg() && bits == 14 {
                let header = c_header(&rig, &values).unwrap();
                let blind = header.replace("    range &= upright_table.range[i];\n", "");
                assert_ne!(blind, header);
                seen.input.truncate(run.first + 100);
                let answers = Program::that_replays(&blind, STRICT).replayed(&seen.input);
                assert!(answers.iter().all(|tick| tick.state != BALANCING));
            }
        }
    }
}

#[test]
fn a_potentiometer_is_refused_in_its_dead_band_and_read_everywhere_else() {
    if !is_there("gcc") {
        return;
    }
    let rig = with_sensor(12, Some(5.934));
    let header = c_header(&rig, &table(&rig)).unwrap();
    let at_home = |reading| Link::homed_at(reading).at_the_end(&header).0;
    for reading in [0, 63, 4032, 4095] {
        assert_eq!(at_home(reading), REFUSED, "{reading}");
    }
    assert_eq!([64, 2600, 4031].map(at_home), [READY; 3]);
    assert_eq!(Link::homed_at(2600).turned(64, 50).turned(4031, 50).at_the_end(&header), (READY, 0));
    // Three ticks in the dead band, or past it in one tick.
    assert_eq!(Link::homed_at(3900).turned(4030, 50).stays(2, 4040).at_the_end(&header), (READY, 0));
    assert_eq!(Link::homed_at(3900).turned(4030, 50).stays(3, 4040).at_the_end(&header), ENCODER);
    assert_eq!(Link::homed_at(3900).turned(4030, 50).stays(3, 70).at_the_end(&header), ENCODER);
}
