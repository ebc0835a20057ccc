//! The firmware with embassy, `boards/stm32g4/`: it compiles for a rig with one link, and for no rig with more.

use crate::equipment::{build_crate, if_possible};
use crate::published::rig_and_table;
use upright_tool::image::BuildError;

#[test]
#[ignore = "builds embassy for a microcontroller"]
fn the_firmware_with_embassy_compiles_and_refuses_a_rig_with_more_encoders() {
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let what = "the firmware with embassy";
    let Some(built) = if_possible(build_crate("stm32g4", rig, table), what) else { return };
    let image = std::fs::read(built.join("upright-stm32g4")).unwrap();
    // The image contains the control task and the serial link of the library.
    for function in [&b"ControlTask"[..], b"SerialLink"] {
        assert!(image.windows(function.len()).any(|window| window == function));
    }
    let (rig, table) = rig_and_table("quadruple-paper");
    match build_crate("stm32g4", rig, table) {
        Err(BuildError::Compiler(said)) => assert!(said.contains("this board counts two encoders"), "{said}"),
        other => panic!("{other:?}"),
    }
}
