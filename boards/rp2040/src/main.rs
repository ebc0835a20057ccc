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
/// The gain table in the file that UPRIGHT_GAINS names.
#[allow(dead_code, reason = "an image does not need its name")]
mod gains {
    include!(env!("UPRIGHT_GAINS"));
}

/// Processor cycles per tick, at the period for which the gains were designed.
const CYCLES_PER_TICK: u32 = upright::boards::cycles_per_tick(gains::TICK_S, board::CLOCK_HZ, board::TICK_US);

#[rtic::app(device = hal::pac, peripherals = true)]
mod app {
    use crate::gains::{SENSORS, STATES, SWING_UP, SwingUp, TABLE};
    use upright::board::Board;
    use upright::firmware::Firmware;
    use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
    use upright::heapless::spsc::Queue;
    use upright::protocol::message::{Command, Message};
    use upright::protocol::serial_link::SerialLink;

    use crate::board::{Hardware, SerialLine, UsbMemory, set_up, start_ticks};

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
    ])]
    fn init(cx: init::Context) -> (Shared, TaskState) {
        let (hardware, line, start) = set_up(cx.device, cx.local.memory);
        let (to_control, commands) = cx.local.commands.split();
        let (messages, to_link) = cx.local.messages.split();
        let firmware = Firmware::new(&TABLE, &SWING_UP, Hardware::WIDTHS, start);
        let mut control = ControlTask::new(firmware, hardware, commands, messages);
        control.board().start_watchdog();
        start_ticks(cx.core.SYST, crate::CYCLES_PER_TICK);
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
