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

#[cfg(not(any(feature = "stm32f405", feature = "stm32f446")))]
compile_error!(
    "the image has no chip: build it with `cargo upright firmware build --board BOARD`, or choose one of the features \
     stm32f405, stm32f446"
);
#[cfg(all(feature = "stm32f405", feature = "stm32f446"))]
compile_error!("the image has two chips: choose only one of the features stm32f405, stm32f446");

use upright::gains;

/// Processor cycles per tick, at the period for which the gains were designed.
const CYCLES_PER_TICK: u32 = upright::boards::cycles_per_tick(gains::TICK_S, board::CLOCK_HZ, board::TICK_US);

#[rtic::app(device = crate::pac, peripherals = true)]
mod app {
    use upright::board::Board;
    use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
    use upright::firmware::{Firmware, hot_path};
    use upright::gains::{SENSORS, STATES, SWING_UP, SwingUp, TABLE};
    use upright::heapless::spsc::Queue;
    use upright::protocol::message::{Command, Message};
    use upright::protocol::serial_link::SerialLink;
    use upright::table::GainTable;

    use crate::board::{Buffer, Hardware, MemoryCheck, SerialLine, set_up, start_ticks};

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
        table: GainTable<STATES, SENSORS> = TABLE,
    ])]
    fn init(cx: init::Context) -> (Shared, TaskState) {
        let table = &*cx.local.table;
        let (hardware, line, memory, start) = set_up(cx.device, cx.local.buffer, table);
        let (to_control, commands) = cx.local.commands.split();
        let (messages, to_link) = cx.local.messages.split();
        let firmware = Firmware::new(table, &SWING_UP, Hardware::WIDTHS, start);
        let mut control = ControlTask::new(firmware, hardware, commands, messages);
        control.board().start_watchdog();
        start_ticks(cx.core.SYST, crate::CYCLES_PER_TICK);
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
