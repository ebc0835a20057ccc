//! The files `replay.in` and `replay.out` in the emulator's directory (semihosting).

use core::ffi::CStr;

use crate::processor::call;

const OPEN: usize = 1;
const WRITE: usize = 5;
const READ: usize = 6;
const EXIT: usize = 0x18;

const READ_BINARY: usize = 1;
const WRITE_BINARY: usize = 5;

/// Both files, with buffers: a call of the emulator takes long.
pub(crate) struct Host {
    input: usize,
    received: [u8; 1024],
    next: usize,
    filled: usize,
    output: usize,
    waiting: [u8; 1024],
    length: usize,
}

impl Host {
    /// Opens both files.
    pub(crate) fn new() -> Self {
        let open = |name: &CStr, mode| call(OPEN, &[name.as_ptr() as usize, mode, name.count_bytes()]);
        let (input, output) = (open(c"replay.in", READ_BINARY), open(c"replay.out", WRITE_BINARY));
        Self { input, received: [0; 1024], next: 0, filled: 0, output, waiting: [0; 1024], length: 0 }
    }

    /// The next byte; none at the end of the input.
    pub(crate) fn read(&mut self) -> Option<u8> {
        if self.next == self.filled {
            let room = self.received.len();
            let left = call(READ, &[self.input, self.received.as_mut_ptr() as usize, room]);
            (self.next, self.filled) = (0, room.saturating_sub(left));
        }
        let byte = self.received.get(self.next).filter(|_| self.next < self.filled)?;
        self.next += 1;
        Some(*byte)
    }

    /// Appends bytes to the output.
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if self.length == self.waiting.len() {
                self.flush();
            }
            if let Some(place) = self.waiting.get_mut(self.length) {
                *place = byte;
                self.length += 1;
            }
        }
    }

    /// Writes what waits.
    pub(crate) fn flush(&mut self) {
        if call(WRITE, &[self.output, self.waiting.as_ptr() as usize, self.length]) != 0 {
            exit(false);
        }
        self.length = 0;
    }
}

/// Ends the emulator.
pub(crate) fn exit(is_good: bool) -> ! {
    // ADP_Stopped_ApplicationExit, or ADP_Stopped_RunTimeErrorUnknown: a 32-bit call takes the reason itself.
    let reason = if is_good { 0x20026 } else { 0x20023 };
    loop {
        crate::processor::call_with(EXIT, reason);
    }
}
