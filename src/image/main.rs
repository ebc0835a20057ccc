//! The firmware image: tasks and their priorities.
//!
//! | task | started by | priority | does |
//! |---|---|---|---|
//! | `tick` | SysTick, at the table's period | highest | inputs → supervisor → controller → motor, then the prediction |
//! | `idle` | every interrupt | lowest | bytes → commands, telemetry → bytes; checks memory |
//!
//! The tasks share no locked resource, only single-producer, single-consumer queues. So no task below `tick` can delay
//! it by more than an interrupt entry.

#![no_std]
#![no_main]

mod board;

// The registers of the chip.
#[cfg(feature = "stm32f405")]
use stm32f4::stm32f405 as pac;
#[cfg(feature = "stm32f446")]
use stm32f4::stm32f446 as pac;

use upright::gains::{self, SENSORS, STATES};
use upright::table::{MOST_TRANSITIONS, SwingUp};

#[cfg(not(any(feature = "stm32f405", feature = "stm32f446")))]
compile_error!(
    "the image has no chip: build it with `cargo upright firmware build --board BOARD`, or choose one of the features \
     stm32f405, stm32f446"
);
#[cfg(all(feature = "stm32f405", feature = "stm32f446"))]
compile_error!("the image has two chips: choose only one of the features stm32f405, stm32f446");

/// Room for transitions between equilibria, if the image has motions.
const TRANSITIONS: usize =
    if <gains::SwingUp as SwingUp<STATES, SENSORS>>::IS_POSSIBLE { MOST_TRANSITIONS } else { 0 };

#[rtic::app(device = crate::pac, peripherals = true)]
mod app {
    use upright::board::Board;
    use upright::boards::cycles_per_tick;
    use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
    use upright::firmware::{Firmware, hot_path};
    use upright::gains::{SENSORS, STATES, SwingUp};
    use upright::heapless::spsc::Queue;
    use upright::protocol::message::{Command, Message};
    use upright::protocol::serial_link::SerialLink;
    use upright::table::{Fill, GainTable, TransitionTable};

    use crate::board::{
        Buffer, CLOCK_HZ, Hardware, MemoryCheck, SerialLine, TICK_US, set_up, start_ticks, tables,
    };

    #[shared]
    struct Shared {}

    #[local]
    struct TaskState {
        control: ControlTask<'static, 'static, Hardware, STATES, SENSORS, SwingUp>,
        link: SerialLink<'static, STATES, SENSORS>,
        line: SerialLine,
        memory: MemoryCheck,
    }

    #[init(local = [
        commands: Queue<Command, COMMANDS> = Queue::new(),
        messages: Queue<Message<STATES, SENSORS>, MESSAGES> = Queue::new(),
        buffer: Buffer = Buffer::new(),
        // In RAM, which is read without wait states: in flash, many words cost five.
        table: GainTable<STATES, SENSORS> = Fill::EMPTY,
        // Both are compared all the time.
        copy: GainTable<STATES, SENSORS> = Fill::EMPTY,
        swing_up: SwingUp = Fill::EMPTY,
        transitions: [TransitionTable<'static>; crate::TRANSITIONS] = Fill::EMPTY,
    ])]
    fn init(cx: init::Context) -> (Shared, TaskState) {
        let tables = tables();
        tables.fill_gains(cx.local.table);
        tables.fill_gains(cx.local.copy);
        tables.fill_swing_up(cx.local.swing_up, cx.local.transitions);
        let (table, copy) = (&*cx.local.table, &*cx.local.copy);
        let cycles = cycles_per_tick(table.tick_s, CLOCK_HZ, TICK_US);
        let (hardware, line, memory, start) = set_up(cx.device, cx.local.buffer, [table, copy], cycles);
        let (to_control, commands) = cx.local.commands.split();
        let (messages, to_link) = cx.local.messages.split();
        let firmware = Firmware::new(table, cx.local.swing_up, Hardware::WIDTHS, start);
        let mut control = ControlTask::new(firmware, hardware, commands, messages);
        control.board().start_watchdog();
        start_ticks(cx.core.SYST, cycles);
        (Shared {}, TaskState { control, link: SerialLink::new(to_control, to_link), line, memory })
    }

    #[task(binds = SysTick, priority = 3, local = [control])]
    fn tick(cx: tick::Context) {
        cx.local.control.tick_with(hot_path::act, hot_path::predict);
    }

    #[idle(local = [link, line, memory])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            while let Some(byte) = cx.local.line.read() {
                cx.local.link.receive(byte);
            }
            while cx.local.line.is_free()
                && let Some(frame) = cx.local.link.transmit()
            {
                cx.local.line.write(frame);
            }
            if let Some(address) = cx.local.memory.advance() {
                crate::board::stop_for_memory(address);
            }
            crate::board::wait_for_interrupt();
        }
    }
}
