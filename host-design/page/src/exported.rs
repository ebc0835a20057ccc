//! The functions that a browser calls: it writes a question into a buffer, and reads the answer from there.
//!
//! Their names are fixed, so that no other program is needed to connect them with the page.

#![expect(unsafe_code, reason = "a function with a fixed name could have the name of another one")]

use std::cell::RefCell;

use crate::question::Desk;
use crate::twin::InPage;

thread_local! {
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static DESK: RefCell<Desk> = RefCell::default();
    static TWIN: RefCell<InPage> = RefCell::default();
}

/// Address of the buffer, which then has room for `length` bytes.
#[unsafe(no_mangle)]
extern "C" fn buffer(length: usize) -> *mut u8 {
    BUFFER.with_borrow_mut(|buffer| {
        buffer.resize(length, 0);
        buffer.as_mut_ptr()
    })
}

/// Answers the question about a rig in the buffer; returns the length of the answer, which replaces it.
#[unsafe(no_mangle)]
extern "C" fn answer() -> usize {
    replaced(|question| DESK.with_borrow_mut(|desk| desk.answer(question)))
}

/// The same for a question to the twin.
#[unsafe(no_mangle)]
extern "C" fn twin() -> usize {
    replaced(|question| TWIN.with_borrow_mut(|twin| twin.answer(question)))
}

fn replaced(answer: impl FnOnce(&str) -> String) -> usize {
    let question = BUFFER.take();
    let answer = answer(&String::from_utf8_lossy(&question)).into_bytes();
    let length = answer.len();
    BUFFER.set(answer);
    length
}
