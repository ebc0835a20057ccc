//! An absolute sensor on two wires, whose times are checked by the emulated sensor.

use super::chip::{Chip, uf2_with_motions};
use super::recorded::recorded;
use super::{assert_equal, by_hand, no_defect};
use crate::published::rig_and_table;
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::supervision::supervisor::State;
use upright_closed_loop::harness::Pins;
use upright_tool::image::{PICO_BALANCING_CYCLES, PICO_READING_CYCLES};

#[test]
#[ignore = "runs an emulator of the chip"]
fn an_as5600_is_read_with_the_bits_of_the_host_until_its_magnet_is_gone() {
    let (rig, table) = rig_and_table("single-as5600");
    let Some(uf2) = uf2_with_motions(rig, table) else { return };
    let gone = |pins: &mut Pins| pins.raw_counts[1] |= BAD_SAMPLE;
    let mut run = recorded(rig, table, &by_hand(rig, 1.0), Some((State::Balancing, 300, gone)));
    run.cut_after_stop();
    let answers = Chip::start(&uf2, table.sensors()).replay(&run);
    let most = assert_equal(&run, &answers);
    assert!(run.outputs.last().is_some_and(|output| !output.enable), "the missing magnet was not noticed");
    assert!(most <= PICO_BALANCING_CYCLES[0] + PICO_READING_CYCLES, "{most} cycles");
    // Negative control: the comparison notices a sensor that reads one step less.
    let mut other = recorded(rig, table, &by_hand(rig, 0.3), no_defect());
    for pins in &mut other.pins {
        pins.raw_counts[1] = pins.raw_counts[1].wrapping_sub(1) & 0xffff;
    }
    let answers = Chip::start(&uf2, table.sensors()).replay(&other);
    assert!(super::first_difference(&other, &answers).is_some());
}
