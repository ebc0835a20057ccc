//! Bytes from a serial line: whatever message is read from them is read again, unchanged, from a frame of its own.

use crate::gains::{SENSORS, STATES};
use serde::Serialize;
use serde::de::DeserializeOwned;
use upright::protocol::frame::{Receiver, encode};
use upright::protocol::message::{Command, Message};
use upright::protocol::serial_link::{MAX_COMMAND, MAX_MESSAGE};

/// Reads `bytes` as a stream of frames, and also as a message without a frame, which needs no checksum.
///
/// # Panics
/// If a message changes on its way through a frame.
pub fn check(bytes: &[u8]) {
    both::<Command, MAX_COMMAND>(bytes);
    both::<Message<STATES, SENSORS>, MAX_MESSAGE>(bytes);
}

fn both<T: Serialize + DeserializeOwned, const N: usize>(bytes: &[u8]) {
    let mut receiver = Receiver::<N>::new();
    for message in bytes.iter().filter_map(|&byte| receiver.push::<T>(byte)).flatten() {
        comes_back::<T, N>(&message);
    }
    if let Ok((message, _)) = postcard::take_from_bytes::<T>(bytes) {
        comes_back::<T, N>(&message);
    }
}

/// Compares frames, not messages: NaN is not equal to itself.
fn comes_back<T: Serialize + DeserializeOwned, const N: usize>(message: &T) {
    let (mut scratch, mut out) = ([0; N], [0; N]);
    let frame = encode(message, &mut scratch, &mut out).expect("a message fits into its frame");
    let mut receiver = Receiver::<N>::new();
    let mut received = frame.iter().filter_map(|&byte| receiver.push::<T>(byte));
    let again = received.next().expect("a frame is complete").expect("a frame is read");
    assert!(received.next().is_none(), "one frame, one message");
    let (mut scratch, mut out) = ([0; N], [0; N]);
    assert_eq!(encode(&again, &mut scratch, &mut out), Ok(frame));
}
