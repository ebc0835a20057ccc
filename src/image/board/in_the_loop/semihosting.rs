//! Channels to the host as files of the emulator (semihosting): fast, and identical in every run.

use core::sync::atomic::{AtomicUsize, Ordering};

use crate::pac::{USART1, USART2};
use cortex_m_semihosting::{debug, syscall};

const READ_BINARY: usize = 1;
const WRITE_BINARY: usize = 5;

/// The channel that carries the simulated pins.
pub(super) struct PinFiles {
    input: usize,
    output: usize,
    buffer: [u8; 256],
    next: usize,
    filled: usize,
}

/// The channel that carries the serial line's output.
pub(super) struct SerialFile {
    output: usize,
}

/// Opens the files `pins.in`, `pins.out` and `serial.out` in the emulator's directory, in this order.
pub(super) fn open(_: USART1, _: USART2) -> (PinFiles, SerialFile) {
    let input = open_file("pins.in\0", READ_BINARY);
    let output = open_file("pins.out\0", WRITE_BINARY);
    PINS_OUT.store(output, Ordering::Relaxed);
    let serial = open_file("serial.out\0", WRITE_BINARY);
    (PinFiles { input, output, buffer: [0; 256], next: 0, filled: 0 }, SerialFile { output: serial })
}

/// Handle of the open `pins.out`.
static PINS_OUT: AtomicUsize = AtomicUsize::new(usize::MAX);

impl PinFiles {
    /// A second handle on the channel, for writing.
    ///
    /// # Safety
    /// The owner of the channel must no longer run.
    pub(super) unsafe fn steal() -> Self {
        let output = PINS_OUT.load(Ordering::Relaxed);
        PinFiles { input: usize::MAX, output, buffer: [0; 256], next: 0, filled: 0 }
    }

    /// Waits for the next byte. Ends the run if the host has closed the file.
    pub(super) fn read(&mut self) -> u8 {
        loop {
            if let Some(&byte) = self.buffer.get(self.next).filter(|_| self.next < self.filled) {
                self.next += 1;
                return byte;
            }
            let room = self.buffer.len();
            // SAFETY: the buffer is at least `room` bytes long.
            let left = unsafe { syscall!(READ, self.input, self.buffer.as_mut_ptr(), room) };
            if left >= room {
                exit(Ok(()));
            }
            (self.next, self.filled) = (0, room - left);
        }
    }

    /// Sends bytes to the host.
    pub(super) fn write(&mut self, bytes: &[u8]) {
        write(self.output, bytes);
    }
}

impl SerialFile {
    /// Sends bytes to the host.
    pub(super) fn write(&mut self, bytes: &[u8]) {
        write(self.output, bytes);
    }
}

/// Ends the emulator with exit status 0 or 1.
pub(super) fn exit(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}

fn open_file(name: &str, mode: usize) -> usize {
    // SAFETY: the name ends with a zero byte, which its length does not include.
    let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, name.len() - 1) };
    if handle == usize::MAX {
        exit(Err(()));
    }
    handle
}

fn write(handle: usize, bytes: &[u8]) {
    // SAFETY: pointer and length are those of the slice.
    let left = unsafe { syscall!(WRITE, handle, bytes.as_ptr(), bytes.len()) };
    if left != 0 {
        exit(Err(()));
    }
}
