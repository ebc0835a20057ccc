//! Tests of the control task.

use heapless::spsc::Queue;

use super::{COMMANDS, ControlTask, MESSAGES};
use crate::board::{Board, Contacts, Inputs, Output};
use crate::control::encoder::CounterWidth;
use crate::firmware::Firmware;
use crate::gains::{SENSORS, TABLE, TICK_S};
use crate::protocol::message::Reset;
use crate::table::NoSwingUp;

/// A board that feeds its watchdog whenever it is told to, as that of docs/own-board.md.
#[derive(Default)]
struct Obedient {
    is_late: bool,
    /// Ticks that have begun, and that have ended.
    begun: u32,
    ended: u32,
    feeds: u32,
}

impl Board<SENSORS> for Obedient {
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32; SENSORS];

    fn tick_s(&self) -> f32 {
        TICK_S
    }

    fn inputs(&mut self) -> Inputs<SENSORS> {
        self.begun += 1;
        let contacts = Contacts { overrun: self.is_late, ..Contacts::default() };
        Inputs { raw_counts: [0; SENSORS], supply_v: 24.0, contacts }
    }

    fn drive(&mut self, _: &Output) {}

    fn end_tick(&mut self) {
        self.ended += 1;
    }

    fn feed_watchdog(&mut self) {
        assert_eq!(self.ended, self.begun, "at the end of a tick");
        self.feeds += 1;
    }

    fn cycles(&self) -> u32 {
        0
    }
}

#[test]
fn the_watchdog_of_every_board_is_fed_until_three_ticks_in_a_row_were_late() {
    let (mut commands, mut messages) = (Queue::new(), Queue::new());
    let (commands, messages) =
        (Queue::<_, COMMANDS>::split(&mut commands).1, Queue::<_, MESSAGES>::split(&mut messages).0);
    let firmware = Firmware::new(&TABLE, &NoSwingUp, Obedient::WIDTHS, Reset::Power);
    let mut task = ControlTask::new(firmware, Obedient::default(), commands, messages);
    let fed = [false, true, true, false, true, true, true, true, false].map(|is_late| {
        task.board().is_late = is_late;
        let before = task.board().feeds;
        task.tick();
        task.board().feeds > before
    });
    assert_eq!(fed, [true, true, true, true, true, true, false, false, true]);
    assert_eq!(task.board().ended, 9, "a late tick ends, too");
}
