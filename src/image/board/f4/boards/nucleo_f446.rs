//! ST NUCLEO-F446RE, all revisions.

use super::super::wiring::{STANDARD, Signal, output};
use super::data::{BoardData, ChipFamily, HseSource};

pub(crate) const BOARD: BoardData = BoardData {
    name: "nucleo-f446",
    title: "NUCLEO-F446RE",
    chip: ChipFamily::F446,
    crystal_hz: 8_000_000,
    sources: &[HseSource::Clock, HseSource::Crystal],
    wiring: &STANDARD,
    status_led: output(Signal::StatusLed, b'A', 5),
    status_led_is_low: false,
    supply_divider: 23.0,
    reference_v: 3.3,
    special: "the debugger supplies the clock and the serial line (USB); MB1136 C-02 and later come like this; C-01 comes without a \
              clock, which is fault *clock*: open SB55, close SB16 and SB50, or fit the crystal X3; PB3 is also the \
              debugger's SWO input",
};
