//! The firmware image for the Raspberry Pi Pico and the Pico 2: tasks and their priorities.
//!
//! | task | started by | priority | does |
//! |---|---|---|---|
//! | `tick` | SysTick, at the table's period | highest | inputs → supervisor → controller → motor or pulses, then the prediction |
//! | `idle` | every interrupt | lowest | bytes → commands, telemetry → bytes |
//!
//! The tasks share no locked resource, only single-producer, single-consumer queues.

#![no_std]
#![no_main]

mod board;
/// The kind of rig in the file that UPRIGHT_GAINS names.
#[allow(dead_code, reason = "of a gain table, only the kinds of drive and sensors count")]
mod gains {
    include!(env!("UPRIGHT_GAINS"));
}

use gains::{SENSORS, STATES};
use upright::table::{MOST_TRANSITIONS, SwingUp};

/// Room for transitions between equilibria, if the image has motions.
const TRANSITIONS: usize =
    if <gains::SwingUp as SwingUp<STATES, SENSORS>>::IS_POSSIBLE { MOST_TRANSITIONS } else { 0 };

#[rtic::app(device = hal::pac, peripherals = true)]
mod app {
    use crate::gains::{SENSORS, STATES, SwingUp};
    use upright::board::Board;
    use upright::boards::cycles_per_tick;
    use upright::firmware::Firmware;
    use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
    use upright::heapless::spsc::Queue;
    use upright::protocol::message::{Command, Message};
    use upright::protocol::serial_link::SerialLink;
    use upright::table::{Fill, GainTable, TransitionTable};

    use crate::board::{CLOCK_HZ, Hardware, SerialLine, TICK_US, UsbMemory, set_up, start_ticks, tables};

    #[shared]
    struct Shared {}

    #[local]
    struct TaskState {
        control: ControlTask<'static, 'static, Hardware, STATES, SENSORS, SwingUp>,
        link: SerialLink<'static, STATES, SENSORS>,
        line: SerialLine,
    }

    #[init(local = [
        commands: Queue<Command, COMMANDS> = Queue::new(),
        messages: Queue<Message<STATES, SENSORS>, MESSAGES> = Queue::new(),
        memory: UsbMemory = UsbMemory::new(),
        table: GainTable<STATES, SENSORS> = Fill::EMPTY,
        swing_up: SwingUp = Fill::EMPTY,
        transitions: [TransitionTable<'static>; crate::TRANSITIONS] = Fill::EMPTY,
    ])]
    fn init(cx: init::Context) -> (Shared, TaskState) {
        let tables = tables();
        tables.fill_gains(cx.local.table);
        tables.fill_swing_up(cx.local.swing_up, cx.local.transitions);
        let cycles = cycles_per_tick(cx.local.table.tick_s, CLOCK_HZ, TICK_US);
        let (hardware, line, start) = set_up(cx.device, cx.local.memory, cycles);
        let (to_control, commands) = cx.local.commands.split();
        let (messages, to_link) = cx.local.messages.split();
        let firmware = Firmware::new(cx.local.table, cx.local.swing_up, Hardware::WIDTHS, start);
        let mut control = ControlTask::new(firmware, hardware, commands, messages);
        control.board().start_watchdog();
        start_ticks(cx.core.SYST, cycles);
        (Shared {}, TaskState { control, link: SerialLink::new(to_control, to_link), line })
    }

    #[task(binds = SysTick, priority = 3, local = [control])]
    fn tick(cx: tick::Context) {
        cx.local.control.tick();
    }

    /// Only wakes the background task, which then serves the bus.
    #[task(binds = USBCTRL_IRQ, priority = 1)]
    fn bus(_: bus::Context) {
        crate::board::mask_bus();
    }

    #[idle(local = [link, line])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            cx.local.line.serve();
            while let Some(byte) = cx.local.line.read() {
                cx.local.link.receive(byte);
            }
            while cx.local.line.is_free()
                && let Some(frame) = cx.local.link.transmit()
            {
                cx.local.line.write(frame);
            }
            crate::board::wait_for_interrupt();
        }
    }
}
