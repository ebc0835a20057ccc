//! Frames on a serial line: postcard, then a CRC-32, then COBS, then a zero byte.
//!
//! One definition for host and firmware and for every type of message. A receiver that has lost synchronisation finds
//! the start of the next frame after the next zero byte.

use cobs::{DecodeResult, DecoderState};
use serde::{Deserialize, Serialize};

use crate::table::checksum::crc32;

const CRC_BYTES: usize = 4;
/// Frame delimiter: follows every frame and occurs in none.
pub const DELIMITER: u8 = 0;

/// Why bytes cannot be decoded, or a message cannot be encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// The frame is longer than the buffer.
    Long,
    /// The bytes are not COBS, or too short to hold a checksum.
    Coding,
    /// The checksum is wrong.
    Crc,
    /// The contents are not a message of the expected type.
    Message,
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            FrameError::Long => "the frame is too long",
            FrameError::Coding => "the frame is not coded with COBS, or too short",
            FrameError::Crc => "the frame's checksum is wrong",
            FrameError::Message => "the frame does not hold a message of the expected type",
        })
    }
}

impl core::error::Error for FrameError {}

/// Encodes `message` as a frame, delimiter included, into `out`, and returns the part of `out` that it fills.
/// `scratch` holds the message before COBS.
///
/// # Errors
/// [`FrameError::Long`] if either buffer is too small, [`FrameError::Message`] if the message cannot be encoded.
pub fn encode<'a, T: Serialize>(
    message: &T,
    scratch: &mut [u8],
    out: &'a mut [u8],
) -> Result<&'a [u8], FrameError> {
    let length = match postcard::to_slice(message, scratch) {
        Ok(body) => body.len(),
        Err(postcard::Error::SerializeBufferFull) => return Err(FrameError::Long),
        Err(_) => return Err(FrameError::Message),
    };
    let (body, rest) = scratch.split_at_mut_checked(length).ok_or(FrameError::Long)?;
    let crc = crc32(0, body).to_le_bytes();
    rest.get_mut(..CRC_BYTES).ok_or(FrameError::Long)?.copy_from_slice(&crc);
    let checked = scratch.get(..length + CRC_BYTES).ok_or(FrameError::Long)?;
    let length = cobs::try_encode(checked, out).map_err(|_| FrameError::Long)?;
    *out.get_mut(length).ok_or(FrameError::Long)? = DELIMITER;
    out.get(..=length).ok_or(FrameError::Long)
}

/// Decodes a frame, given without its delimiter. `frame` is overwritten.
///
/// # Errors
/// [`FrameError`]; nothing of a damaged frame is used.
pub fn decode<T: for<'de> Deserialize<'de>>(frame: &mut [u8]) -> Result<T, FrameError> {
    let length = unstuff(frame).ok_or(FrameError::Coding)?;
    let checked = frame.get(..length).ok_or(FrameError::Coding)?;
    let (body, crc) = checked.split_last_chunk::<CRC_BYTES>().ok_or(FrameError::Coding)?;
    if crc32(0, body) != u32::from_le_bytes(*crc) {
        return Err(FrameError::Crc);
    }
    match postcard::take_from_bytes(body) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Message),
    }
}

/// Decodes COBS in place; returns the length of the result.
fn unstuff(frame: &mut [u8]) -> Option<usize> {
    let (mut decoder, mut length) = (DecoderState::Idle, 0);
    for i in 0..frame.len() {
        match decoder.feed(*frame.get(i)?).ok()? {
            DecodeResult::NoData => {}
            DecodeResult::DataContinue(byte) => {
                *frame.get_mut(length)? = byte;
                length += 1;
            }
            DecodeResult::DataComplete => return None,
        }
    }
    matches!(decoder.feed(DELIMITER), Ok(DecodeResult::DataComplete)).then_some(length)
}

/// Splits a stream of bytes into frames of up to `N` bytes and decodes them.
#[derive(Debug, Clone)]
pub struct Receiver<const N: usize> {
    buffer: [u8; N],
    length: usize,
}

impl<const N: usize> Default for Receiver<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Receiver<N> {
    /// A receiver at the start of a frame.
    pub const fn new() -> Self {
        Self { buffer: [0; N], length: 0 }
    }

    /// Takes the next byte. If it completes a frame, returns its message, or why it cannot be decoded. Empty frames
    /// are ignored.
    pub fn push<T: for<'de> Deserialize<'de>>(&mut self, byte: u8) -> Option<Result<T, FrameError>> {
        if self.completes_frame(byte) { Some(self.decoded()) } else { None }
    }

    /// Takes the next byte. Whether it completes a frame, which is to be [`decoded`](Self::decoded) before the next
    /// byte.
    pub fn completes_frame(&mut self, byte: u8) -> bool {
        if byte == DELIMITER {
            return self.length > 0;
        }
        // Bytes that do not fit are only counted: a frame longer than the buffer is then dropped as a whole.
        if let Some(place) = self.buffer.get_mut(self.length) {
            *place = byte;
        }
        self.length = self.length.saturating_add(1);
        false
    }

    /// Decodes the frame that is complete, and drops it.
    ///
    /// # Errors
    /// [`FrameError`]; nothing of a damaged frame is used.
    pub fn decoded<T: for<'de> Deserialize<'de>>(&mut self) -> Result<T, FrameError> {
        let length = core::mem::take(&mut self.length);
        self.buffer.get_mut(..length).ok_or(FrameError::Long).and_then(|frame| decode(frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame<T: Serialize>(message: &T) -> heapless::Vec<u8, 64> {
        let (mut scratch, mut out) = ([0; 64], [0; 64]);
        heapless::Vec::from_slice(encode(message, &mut scratch, &mut out).unwrap()).unwrap()
    }

    fn receive(receiver: &mut Receiver<64>, bytes: &[u8]) -> heapless::Vec<Result<(u8, u32), FrameError>, 8> {
        bytes.iter().filter_map(|&byte| receiver.push(byte)).collect()
    }

    proptest! {
        #[test]
        fn a_message_is_decoded_as_it_was_encoded(message: (u8, u32)) {
            let received = receive(&mut Receiver::new(), &frame(&message));
            prop_assert_eq!(received.as_slice(), &[Ok(message)]);
        }

        #[test]
        fn one_wrong_bit_never_gives_a_message(message: (u8, u32), bit in 0usize..64) {
            let mut bytes = frame(&message);
            let bit = bit % (8 * (bytes.len() - 1));
            bytes[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(receive(&mut Receiver::new(), &bytes).iter().all(Result::is_err));
        }

        #[test]
        fn after_any_garbage_the_next_frame_is_read(garbage: std::vec::Vec<u8>, message: (u8, u32)) {
            let mut receiver = Receiver::<64>::new();
            receive(&mut receiver, &garbage.into_iter().take(7).collect::<std::vec::Vec<_>>());
            receive(&mut receiver, &[DELIMITER]);
            let received = receive(&mut receiver, &frame(&message));
            prop_assert_eq!(received.as_slice(), &[Ok(message)]);
        }
    }

    #[test]
    fn a_frame_that_is_too_long_is_dropped_as_a_whole() {
        let mut receiver = Receiver::<8>::new();
        for _ in 0..100 {
            assert_eq!(receiver.push::<u8>(1), None);
        }
        assert_eq!(receiver.push::<u8>(DELIMITER), Some(Err(FrameError::Long)));
        let last = frame(&7u8).iter().filter_map(|&byte| receiver.push::<u8>(byte)).last();
        assert_eq!(last, Some(Ok(7)));
    }

    #[test]
    fn a_message_that_does_not_fit_is_not_sent() {
        let (mut scratch, mut out) = ([0; 64], [0; 5]);
        assert_eq!(encode(&(1u8, 2u32), &mut scratch, &mut out), Err(FrameError::Long));
    }
}
