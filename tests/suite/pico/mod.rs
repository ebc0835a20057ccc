//! The very UF2 file for a Raspberry Pi Pico, in the emulator rp2040js: all outputs and telemetry are the host's.
//!
//! It needs node and the emulator (`npm ci` in `boards/rp2040/harness`), and takes a minute: it runs with `--ignored`.

mod arithmetic;
mod chip;
pub(crate) mod recorded;
mod stepper;
mod two_wires;

use self::chip::{Answer, Chip, uf2_with_motions};
use self::recorded::{PERIOD, Recorded, WARM_UP_TICKS, recorded, recorded_while};
use crate::chips::recorded::stand_still;
use crate::equipment::if_possible;
use crate::published::{rig_and_table, rig_and_table_with_motions};
use upright::board::Output;
use upright::boards::named;
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::Pins;
use upright_design::simulate::Scenario;
use upright_plan::up_and_down;
use upright_tool::image::{PICO_BALANCING_CYCLES, PICO_MOTION_CYCLES, build_for};

/// Stack of the image (bytes), as `boards/rp2040/image.x` has it.
const STACK: u32 = 8192;

/// The first tick in which the chip's outputs are not those of the host; `None` if all are.
fn first_difference(run: &Recorded, answers: &[Answer]) -> Option<usize> {
    run.outputs.iter().zip(answers).position(|(output, answer)| {
        let level = (output.duty.abs() * PERIOD as f32 + 0.5) as u32;
        let wanted_level = if output.enable { level.min(PERIOD - PERIOD / 50) } else { 0 };
        let is_direction = !output.enable || answer.positive == (output.duty > 0.0);
        (answer.level, answer.enabled) != (wanted_level, output.enable) || !is_direction
    })
}

/// Checks outputs and telemetry; returns the largest number of cycles of a tick with the motor on.
fn assert_equal(run: &Recorded, answers: &[Answer]) -> u32 {
    assert_eq!(answers.len(), run.outputs.len());
    assert_eq!(first_difference(run, answers), None, "first tick with other outputs");
    let sent: Vec<u8> = answers.iter().flat_map(|answer| answer.sent.iter().copied()).collect();
    let (mut host, chip) = (recorded::telemetry(&run.sent.concat()), recorded::telemetry(&sent));
    // What the chip sends before it is made known to the bus is lost.
    host.retain(|message| message.tick >= chip[0].tick);
    assert!((chip[0].tick as usize) < WARM_UP_TICKS);
    assert!(chip.len() + 2 >= host.len(), "{} of {} messages", chip.len(), host.len());
    assert!(2 * host.len() > answers.len(), "{} messages in {} ticks", host.len(), answers.len());
    let different = host.iter().zip(&chip).position(|(host, chip)| host != chip);
    if let Some(at) = different {
        panic!("first different telemetry: {:?}, the host's: {:?}", chip[at], host[at]);
    }
    let on: Vec<u32> = run
        .outputs
        .iter()
        .zip(answers)
        .filter(|(output, _)| output.enable)
        .map(|(_, answer)| answer.cycles)
        .collect();
    let mean = on.iter().map(|&cycles| f64::from(cycles)).sum::<f64>() / on.len() as f64;
    let most = on.iter().copied().max().unwrap();
    let stack = answers.last().unwrap().stack;
    println!(
        "{} ticks, {} with the motor on: {mean:.0} cycles, at most {most}; {stack} bytes of stack",
        answers.len(),
        on.len()
    );
    // The bound from the code is in docs/results/pico.md.
    assert!(stack < STACK / 8 * 5, "{stack} bytes of stack");
    most
}

/// What changes the pins, and when: from that many ticks after the first one in a state.
type Defect = (State, usize, fn(&mut Pins));

fn no_defect() -> Option<Defect> {
    None
}

/// Balances from a small lean, after homing, sign check and motor test.
fn by_hand(rig: &upright_design::rig::Rig, duration_s: f64) -> Scenario {
    let mut scenario = Scenario { duration_s, ..Scenario::at_rest(rig, Law::Lqr) };
    scenario.start[2] = 0.002;
    scenario
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn one_link_is_raised_and_balanced_until_the_emergency_stop() {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let scenario = up_and_down(rig, table, 0.5).unwrap();
    let press = |pins: &mut Pins| pins.contacts.emergency_stop = true;
    let mut run = recorded(rig, table, &scenario, Some((State::Balancing, 100, press)));
    run.cut_after_stop();
    let mut chip = Chip::start(&uf2, table.sensors());
    let answers = chip.replay(&run);
    let most = assert_equal(&run, &answers);
    assert!(most <= PICO_MOTION_CYCLES[0], "{most} cycles");
    // Negative control: the comparison notices one step of the duty.
    let changed = run.outputs.iter_mut().rev().find(|output| output.enable).unwrap();
    *changed = Output { duty: changed.duty + 1.0 / PERIOD as f32, ..*changed };
    assert!(first_difference(&run, &answers).is_some());
}

/// Fills the line with noise.
fn flood() -> impl FnMut(&mut Pins) {
    let mut number = 1_u8;
    move |pins| {
        while pins.received.len() < 60 {
            number = number.wrapping_mul(5).wrapping_add(3);
            let _ = pins.received.push(number | 1);
        }
        // The next command begins after the end of a frame.
        let _ = pins.received.push(0);
    }
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn the_emergency_stop_turns_the_motor_off_in_a_flood_on_the_bus() {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let scenario = by_hand(rig, 0.2);
    let plain = recorded(rig, table, &scenario, Some((State::Jogging, 0, flood())));
    let first = plain.pins.iter().position(|pins| pins.received.len() > 60).unwrap();
    let pressed = plain.last_on() - 10;
    let (mut flood, mut left) = (flood(), pressed - first);
    let flood_and_stop = move |pins: &mut Pins| {
        flood(pins);
        pins.contacts.emergency_stop |= left == 0;
        left = left.saturating_sub(1);
    };
    let mut run = recorded(rig, table, &scenario, Some((State::Jogging, 0, flood_and_stop)));
    run.truncate(pressed + 10);
    let is_on = |tick: usize| run.outputs[tick].enable;
    assert!(
        is_on(pressed - 1) && !is_on(pressed),
        "the firmware does not stop in the tick in which it is told to"
    );
    let (mut chip, mut cycles) = (Chip::start(&uf2, table.sensors()), 0);
    // It opens after a tick, long before the next one: no code turns the motor off.
    let answers = chip.replay_and(&run, pressed, |chip| cycles = chip.open_stop(10_000));
    assert_equal(&run, &answers);
    println!("emergency stop: disabled after {cycles} cycles");
    assert!((1..=250).contains(&cycles), "{cycles} cycles");
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn a_flood_on_the_bus_disturbs_nothing_and_the_motor_goes_off_when_ticks_stop() {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let mut run = recorded(rig, table, &by_hand(rig, 0.4), Some((State::Jogging, 0, flood())));
    run.truncate(run.last_on() - 10);
    assert_eq!(run.last_state(), State::Balancing, "no command got through");
    let mut chip = Chip::start(&uf2, table.sensors());
    let most = assert_equal(&run, &chip.replay(&run));
    assert!(most <= PICO_BALANCING_CYCLES[0], "{most} cycles");
    let tick = (rig.tick.period_s * 125e6) as u32;
    let ([disabled, reset], _) = chip.stop_ticks(5 * tick);
    println!("ticks stopped: disabled after {disabled} cycles, reset after {reset}");
    assert!((tick..=3 * tick).contains(&disabled) && (2 * tick..=4 * tick).contains(&reset));
}

/// The longest tick of four links is within what the page states, and within 55 % of a millisecond.
fn assert_in_time(most: u32) {
    assert!(
        most <= PICO_BALANCING_CYCLES[3] && most < 68_750,
        "{most} cycles: at most 55 % of a millisecond"
    );
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn four_links_balance_in_half_of_the_period_until_an_encoder_wire_breaks() {
    let (rig, table) = rig_and_table("quadruple-paper");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let mut last = None;
    let freeze = move |pins: &mut Pins| pins.raw_counts[1] = *last.get_or_insert(pins.raw_counts[1]);
    let mut run = recorded(rig, table, &by_hand(rig, 1.0), Some((State::Balancing, 300, freeze)));
    run.cut_after_stop();
    let answers = Chip::start(&uf2, table.sensors()).replay(&run);
    let most = assert_equal(&run, &answers);
    assert!(run.outputs.last().is_some_and(|output| !output.enable), "the broken wire was not noticed");
    assert_in_time(most);
}

/// Estimates become subnormal, which makes arithmetic slower.
#[test]
#[ignore = "runs an emulator of the chip"]
fn four_links_at_rest_take_no_longer() {
    let (rig, table) = rig_and_table_with_motions("quadruple-paper");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let run = recorded_while(table, no_defect(), |target| stand_still(rig, table, target));
    let most = assert_equal(&run, &Chip::start(&uf2, table.sensors()).replay(&run));
    assert_in_time(most);
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn four_links_are_raised_at_1_khz() {
    let (rig, table) = rig_and_table_with_motions("quadruple-paper");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let scenario = up_and_down(rig, table, 0.5).unwrap();
    let run = recorded(rig, table, &scenario, no_defect());
    let most = assert_equal(&run, &Chip::start(&uf2, table.sensors()).replay(&run));
    assert!(most <= PICO_MOTION_CYCLES[3], "{most} cycles");
}

#[test]
#[ignore = "runs an emulator of the chip"]
fn a_table_or_code_that_is_damaged_before_power_comes_keeps_the_motor_off() {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let mut run = recorded(rig, table, &by_hand(rig, 0.1), no_defect());
    run.truncate(WARM_UP_TICKS + 200);
    let sound = std::fs::read(&uf2).unwrap();
    let gain = table.laws.lqr.as_ref().unwrap().k[0].to_le_bytes();
    let gain = sound.windows(4).position(|window| window == gain).unwrap();
    // The image from power-up on; its faults.
    let faults = |bytes: &[u8]| {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("changed.uf2");
        std::fs::write(&file, bytes).unwrap();
        let answers = Chip::start(&file, table.sensors()).replay(&run);
        let sent: Vec<u8> = answers.iter().flat_map(|answer| answer.sent.iter().copied()).collect();
        let telemetry = recorded::telemetry(&sent);
        assert!(!telemetry.is_empty() && answers.iter().all(|answer| !answer.enabled));
        telemetry.iter().map(|at| at.fault).collect::<Vec<_>>()
    };
    // A gain; and a word that ARM reserves in the vector table, with which the second page and its block of 512 begin.
    for (at, fault) in [(gain, Fault::Table), (512 + 32 + 4 * 10, Fault::Image)] {
        let mut bytes = sound.clone();
        bytes[at] ^= 1;
        let found = faults(&bytes);
        assert!(found.iter().all(|found| *found == Some(fault)), "{at}: {found:?}");
    }
    // Negative control.
    assert!(faults(&sound).iter().all(Option::is_none));
}

#[test]
#[ignore = "builds the image"]
fn the_image_for_a_pico_2_has_what_its_boot_rom_looks_for() {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let built = |board| if_possible(build_for(named(board).unwrap(), rig, table), "the image for a Pico 2");
    let Some(image) = built("pico2") else { return };
    // The blocks of the UF2 file, each with a page of the flash.
    let uf2 = std::fs::read(image.uf2.unwrap()).unwrap();
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert!(uf2.chunks(512).all(|block| word(block, 28) == 0xe48b_ff59));
    let flash: Vec<u8> = uf2.chunks(512).flat_map(|block| block[32..288].iter().copied()).collect();
    assert_eq!(word(&uf2, 12), 0x1000_0000);
    assert_eq!(word(&flash, 0), 0x2000_0000 + STACK);
    // RP2350 datasheet, 5.9: a secure program for the Arm cores, and the only block of its loop.
    let definition = [0xffff_ded3, 0x1021_0142, 0x0000_01ff, 0, 0xab12_3579];
    let says_what_it_is = |flash: &[u8]| {
        let words: Vec<u32> = flash[..4096].chunks(4).map(|bytes| word(bytes, 0)).collect();
        words.windows(5).any(|words| words == definition)
    };
    assert!(says_what_it_is(&flash));
    // Negative control: what another chip looks for.
    let Some(pico) = built("pico") else { return };
    assert!(!says_what_it_is(&std::fs::read(pico.uf2.unwrap()).unwrap()));
}
