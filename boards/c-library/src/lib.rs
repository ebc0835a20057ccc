//! The whole firmware behind the functions of `include/upright.h`, which says who may call them, and when.

#![no_std]

use core::cell::UnsafeCell;
use core::mem::offset_of;
use core::panic::PanicInfo;

use upright::board::{BadSamples, Board, Contacts, Inputs, Output};
use upright::control::encoder::CounterWidth;
use upright::firmware::Firmware;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::heapless::spsc::Queue;
use upright::protocol::message::{Command, Message, Reset};
use upright::protocol::serial_link::SerialLink;

/// The gain table in the file that UPRIGHT_GAINS names.
#[allow(dead_code, reason = "an image does not need its name")]
mod gains {
    include!(env!("UPRIGHT_GAINS"));
}

use gains::{SENSORS, STATES, SWING_UP, SwingUp, TABLE};

/// `upright_inputs` of the header.
#[repr(C)]
struct CInputs {
    raw_counts: [u32; SENSORS],
    supply_v: f32,
    limit_low: u8,
    limit_high: u8,
    emergency_stop: u8,
    driver_fault: u8,
    overrun: u8,
    clock_fault: u8,
    board_fault: u8,
    bad_samples: u8,
}

/// `upright_output` of the header.
#[repr(C)]
struct COutput {
    duty: f32,
    pulses: i32,
    enable: u8,
}

// The header asserts the same.
const _: () =
    assert!(offset_of!(CInputs, supply_v) == 4 * SENSORS && size_of::<CInputs>() == 4 * SENSORS + 12);
const _: () = assert!(offset_of!(COutput, enable) == 8 && size_of::<COutput>() == 12);

unsafe extern "C" {
    fn upright_board_inputs(inputs: *mut CInputs);
    fn upright_board_drive(output: *const COutput);
    fn upright_board_feed_watchdog();
    fn upright_board_cycles() -> u32;
    fn upright_board_tick_s() -> f32;
    fn upright_board_stop() -> !;
}

/// The board of the program in C.
#[derive(Default)]
struct CBoard {
    bad: BadSamples<SENSORS>,
}

impl Board<SENSORS> for CBoard {
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32; SENSORS];
    const GIVES_PULSES: bool = true;

    fn tick_s(&self) -> f32 {
        // SAFETY, here and below: functions of the program, called as the header promises.
        unsafe { upright_board_tick_s() }
    }

    /// What the program leaves as it is counts as a fault.
    fn inputs(&mut self) -> Inputs<SENSORS> {
        let mut inputs = CInputs {
            raw_counts: [0; SENSORS],
            supply_v: 0.0,
            limit_low: 1,
            limit_high: 1,
            emergency_stop: 1,
            driver_fault: 1,
            overrun: 0,
            clock_fault: 0,
            board_fault: 0,
            bad_samples: 0,
        };
        unsafe { upright_board_inputs(&mut inputs) };
        self.bad.now = inputs.bad_samples.into();
        Inputs {
            raw_counts: inputs.raw_counts,
            supply_v: inputs.supply_v,
            contacts: Contacts {
                limit_low: inputs.limit_low != 0,
                limit_high: inputs.limit_high != 0,
                emergency_stop: inputs.emergency_stop != 0,
                driver_fault: inputs.driver_fault != 0,
                overrun: inputs.overrun != 0,
                clock_fault: inputs.clock_fault != 0,
                board_fault: inputs.board_fault != 0,
            },
        }
    }

    fn bad_samples(&mut self) -> Option<&mut BadSamples<SENSORS>> {
        Some(&mut self.bad)
    }

    fn drive(&mut self, output: &Output) {
        let output = COutput { duty: output.duty, pulses: output.pulses(), enable: output.enable.into() };
        unsafe { upright_board_drive(&output) };
    }

    fn feed_watchdog(&mut self) {
        unsafe { upright_board_feed_watchdog() };
    }

    fn cycles(&self) -> u32 {
        unsafe { upright_board_cycles() }
    }
}

/// A variable of one task.
struct OneTask<T>(UnsafeCell<T>);

// SAFETY: `upright_start` runs before the tasks. Then only the tick uses `CONTROL`, and only the link uses `LINK`; they
// share the queues, each with its own end.
unsafe impl<T> Sync for OneTask<T> {}

type Control = ControlTask<'static, 'static, CBoard, STATES, SENSORS, SwingUp>;

static TO_CONTROL: OneTask<Queue<Command, COMMANDS>> = OneTask(UnsafeCell::new(Queue::new()));
static TO_LINK: OneTask<Queue<Message<STATES, SENSORS>, MESSAGES>> = OneTask(UnsafeCell::new(Queue::new()));
static CONTROL: OneTask<Option<Control>> = OneTask(UnsafeCell::new(None));
static LINK: OneTask<Option<SerialLink<'static, STATES, SENSORS>>> = OneTask(UnsafeCell::new(None));

/// `upright_start` of the header, with the number of sensors that the program was compiled for. It is refused the
/// second time, and for another number.
#[unsafe(no_mangle)]
extern "C" fn upright_start_for(sensors: u32, reset: u8) -> bool {
    // SAFETY: nothing else runs yet.
    let (control, link) = unsafe { (&mut *CONTROL.0.get(), &mut *LINK.0.get()) };
    if sensors as usize != SENSORS || control.is_some() {
        return false;
    }
    // SAFETY: only this call, which comes once, splits the queues.
    let (commands, messages) = unsafe { ((*TO_CONTROL.0.get()).split(), (*TO_LINK.0.get()).split()) };
    let reset = match reset {
        0 => Reset::Power,
        1 => Reset::Watchdog,
        _ => Reset::Software,
    };
    let firmware = Firmware::new(&TABLE, &SWING_UP, CBoard::WIDTHS, reset);
    *control = Some(ControlTask::new(firmware, CBoard::default(), commands.1, messages.0));
    *link = Some(SerialLink::new(commands.0, messages.1));
    true
}

/// `upright_tick` of the header.
#[unsafe(no_mangle)]
extern "C" fn upright_tick() {
    // SAFETY: only the tick uses it.
    if let Some(control) = unsafe { &mut *CONTROL.0.get() } {
        control.tick();
    }
}

/// `upright_receive` of the header.
#[unsafe(no_mangle)]
extern "C" fn upright_receive(byte: u8) {
    // SAFETY: only the link uses it.
    if let Some(link) = unsafe { &mut *LINK.0.get() } {
        link.receive(byte);
    }
}

/// `upright_transmit` of the header.
#[unsafe(no_mangle)]
extern "C" fn upright_transmit(length: &mut u32) -> *const u8 {
    // SAFETY: only the link uses it.
    let frame = unsafe { &mut *LINK.0.get() }.as_mut().and_then(SerialLink::transmit).unwrap_or_default();
    *length = frame.len() as u32;
    frame.as_ptr()
}

#[panic_handler]
fn panicked(_: &PanicInfo) -> ! {
    // SAFETY: the program turns the motor off.
    unsafe { upright_board_stop() }
}
