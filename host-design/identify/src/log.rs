//! The log of a machine that is shaken: counters, motor drive, supply and contacts of every tick.
//!
//! A file is a header and frames. All numbers are little-endian; a checksum is the CRC-32 (ISO-HDLC) of the part before
//! it.
//!
//! | part | bytes | what |
//! |---|---|---|
//! | mark | 8 | `UPRTLOG1` |
//! | header | 1 | encoders: cart and joints, y |
//! | | 1 | 0: the drive is a duty; 1: a force; 2: pulses |
//! | | 1 | length of the name |
//! | | | name of the rig, UTF-8 |
//! | | 8 | hash of the rig |
//! | | 4 | control period (ns) |
//! | | 8 | force at full scale (N), or travel per pulse (m), as a 64-bit float; 1 with a duty |
//! | | 2 y | counter values with the cart at 0 and the links hanging, low 16 bits |
//! | | 4 | checksum of the header |
//! | frame | 4 | number of its first tick |
//! | | 1 | ticks k, 1 to 10 |
//! | | 1 | contacts: bit 0 lower limit, 1 upper limit, 2 emergency stop, 3 driver fault |
//! | | 2 | supply (mV), 0 if it is not measured |
//! | | k (2 y + 2) | for each tick the counters, and the drive from -32767 to 32767, or the pulses of the tick; -32768 while the motor is off and coasts |
//! | | 4 | checksum of the frame |

use std::io::{self, Read};
use std::path::Path;

use upright::protocol::tick_log::OFF;
use upright::table::checksum::crc32;
use upright_design::rig::{Actuator, Rig};

use crate::error::LogError;

/// Number of ticks in a full frame.
const FRAME_TICKS: usize = 10;
/// Largest file that is read (bytes): a day of one link, or nine hours of four.
const MOST_BYTES: u64 = 1 << 30;
/// Names of the contacts in a frame, from the lowest bit up.
pub const CONTACTS: [&str; 4] = ["lower limit", "upper limit", "emergency stop", "driver fault"];

/// Meaning of the drive values in a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveScale {
    /// A duty from -1 to 1.
    Duty,
    /// A force: this many newtons at full scale.
    Force(f64),
    /// Pulses, each of which moves the cart by so much (m).
    Steps(f64),
}

impl DriveScale {
    /// That of a rig; `full_n` is the force at full scale of one without motor data (N).
    pub fn of(rig: &Rig, full_n: f64) -> Self {
        match &rig.actuator {
            Actuator::Force(_) => Self::Force(full_n),
            Actuator::Motor(..) => Self::Duty,
            Actuator::Pulses(drive) => Self::Steps(drive.step_m),
        }
    }
}

/// Header of a log: the rig, and how its ticks are to be read.
#[derive(Debug, Clone, PartialEq)]
pub struct LogHeader {
    /// Name of the rig.
    pub rig: String,
    /// Hash of the rig file that the firmware was designed for.
    pub hash: u64,
    /// Control period (ns).
    pub period_ns: u32,
    /// Meaning of the drive values.
    pub drive: DriveScale,
    /// Low bits of each counter (cart, then joints) with the cart at 0 and the links hanging, as homed.
    pub hanging: Vec<u16>,
}

/// One tick of a log, apart from its counters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Number of the tick.
    pub number: u32,
    /// Applied duty or force, 32767 at full scale, or the pulses of the tick; [`OFF`] while the motor is off and turns
    /// freely.
    pub drive: i16,
    /// Supply (mV); 0 if it is not measured.
    pub supply_mv: u16,
    /// Contacts, one bit each, in the order of [`CONTACTS`].
    pub contacts: u8,
}

/// A log: a header, and ticks in ascending order, with gaps where ticks were lost.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// The rig, and how the ticks are to be read.
    pub header: LogHeader,
    ticks: Vec<Tick>,
    /// Counters of all ticks, one row per tick.
    counts: Vec<u16>,
}

impl Log {
    /// The first bytes of the file of a log.
    pub const MARK: &'static [u8; 8] = b"UPRTLOG1";

    /// An empty log.
    pub fn new(header: LogHeader) -> Self {
        Self { header, ticks: Vec::new(), counts: Vec::new() }
    }

    /// Number of channels: cart and joints.
    pub fn channels(&self) -> usize {
        self.header.hanging.len()
    }

    /// Appends a tick with the low bits of its counters.
    ///
    /// # Panics
    /// If there is not one counter per channel.
    pub fn push(&mut self, tick: Tick, counts: &[u16]) {
        assert_eq!(counts.len(), self.channels(), "one counter per channel");
        self.ticks.push(tick);
        self.counts.extend_from_slice(counts);
    }

    /// All ticks, in ascending order of their numbers.
    pub fn ticks(&self) -> &[Tick] {
        &self.ticks
    }

    /// Low bits of the counters of the tick at `index` in [`ticks`](Self::ticks), one per channel.
    pub fn counts(&self, index: usize) -> &[u16] {
        &self.counts[index * self.channels()..][..self.channels()]
    }

    /// Number of ticks that are missing between the first and the last one.
    pub fn lost(&self) -> u64 {
        match (self.ticks.first(), self.ticks.last()) {
            (Some(first), Some(last)) => u64::from(last.number - first.number) + 1 - self.ticks.len() as u64,
            _ => 0,
        }
    }

    /// Deviation of each channel from hanging, in counts, with the wrap-around of 16 bits undone; one row per tick. The
    /// first reading is taken to be within half of the 16-bit range of hanging.
    pub fn deviations(&self) -> Vec<i64> {
        let channels = self.channels();
        let mut last: Vec<(u16, i64)> = self.header.hanging.iter().map(|&count| (count, 0)).collect();
        let unwrapped = |(index, &count): (usize, &u16)| {
            let (before, total) = &mut last[index % channels];
            *total += i64::from(count.wrapping_sub(*before) as i16);
            *before = count;
            *total
        };
        self.counts.iter().enumerate().map(unwrapped).collect()
    }

    /// Reads a log from a file.
    ///
    /// # Errors
    /// [`LogError`], with the offset of the damage if there is one.
    pub fn from_path(file: &Path) -> Result<Self, LogError> {
        let unreadable = |error: io::Error| LogError::Unreadable(error.to_string());
        let mut bytes = Vec::new();
        std::fs::File::open(file)
            .and_then(|open| open.take(MOST_BYTES + 1).read_to_end(&mut bytes))
            .map_err(unreadable)?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(LogError::TooLarge);
        }
        Self::from_bytes(&bytes)
    }

    /// Reads a log from the bytes of a file.
    ///
    /// # Errors
    /// [`LogError`], with the offset of the damage if there is one.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, LogError> {
        let (header, mut rest) = header(bytes)?;
        let channels = header.hanging.len();
        let mut log = Self::new(header);
        while !rest.is_empty() {
            let at = bytes.len() - rest.len();
            let count = usize::from(*rest.get(4).ok_or(LogError::Truncated { at })?);
            if !(1..=FRAME_TICKS).contains(&count) {
                return Err(LogError::Damaged { at });
            }
            let body = 8 + count * 2 * (channels + 1);
            let (frame, after) = rest.split_at_checked(body + 4).ok_or(LogError::Truncated { at })?;
            let frame = checked(frame).ok_or(LogError::Damaged { at })?;
            log.frame(frame, at)?;
            rest = after;
        }
        if log.ticks.is_empty() {
            return Err(LogError::Empty);
        }
        Ok(log)
    }

    /// Appends the ticks of a frame whose checksum is right.
    fn frame(&mut self, frame: &[u8], at: usize) -> Result<(), LogError> {
        let (head, ticks) = frame.split_at(8);
        let first = u32::from_le_bytes([head[0], head[1], head[2], head[3]]);
        let (contacts, supply_mv) = (head[5], u16::from_le_bytes([head[6], head[7]]));
        for (index, words) in ticks.chunks_exact(2 * (self.channels() + 1)).enumerate() {
            let number = first.checked_add(index as u32).ok_or(LogError::Order { at })?;
            if self.ticks.last().is_some_and(|last| number <= last.number) {
                return Err(LogError::Order { at });
            }
            let mut words = words.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]]));
            self.counts.extend(words.by_ref().take(self.header.hanging.len()));
            let drive = words.next().unwrap_or_default() as i16;
            self.ticks.push(Tick { number, drive, supply_mv, contacts });
        }
        Ok(())
    }

    /// The log as the bytes of a file. A frame ends before a missing tick, and where supply or contacts change.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.header.to_bytes();
        let mut from = 0;
        while from < self.ticks.len() {
            let first = &self.ticks[from];
            let fits = |(index, tick): &(usize, &Tick)| {
                tick.number == first.number.wrapping_add(*index as u32)
                    && (tick.supply_mv, tick.contacts) == (first.supply_mv, first.contacts)
            };
            let count = self.ticks[from..].iter().take(FRAME_TICKS).enumerate().take_while(fits).count();
            let mut frame = first.number.to_le_bytes().to_vec();
            frame.extend([count as u8, first.contacts]);
            frame.extend(first.supply_mv.to_le_bytes());
            for index in from..from + count {
                frame.extend(self.counts(index).iter().flat_map(|count| count.to_le_bytes()));
                frame.extend(self.ticks[index].drive.to_le_bytes());
            }
            bytes.extend(with_checksum(frame));
            from += count;
        }
        bytes
    }

    /// Drive of a tick: a duty from -1 to 1, a force (N), or pulses; 0 while the motor was off.
    pub fn drive(&self, tick: &Tick) -> f64 {
        let value = if tick.drive == OFF { 0.0 } else { f64::from(tick.drive) };
        match self.header.drive {
            DriveScale::Duty => value / f64::from(i16::MAX),
            DriveScale::Force(full_n) => value / f64::from(i16::MAX) * full_n,
            DriveScale::Steps(_) => value,
        }
    }
}

impl LogHeader {
    fn to_bytes(&self) -> Vec<u8> {
        let name = &self.rig.as_bytes()[..self.rig.len().min(255)];
        let (kind, full) = match self.drive {
            DriveScale::Duty => (0, 1.0),
            DriveScale::Force(full_n) => (1, full_n),
            DriveScale::Steps(step_m) => (2, step_m),
        };
        let mut body = vec![self.hanging.len() as u8, kind, name.len() as u8];
        body.extend(name);
        body.extend(self.hash.to_le_bytes());
        body.extend(self.period_ns.to_le_bytes());
        body.extend(full.to_le_bytes());
        body.extend(self.hanging.iter().flat_map(|count| count.to_le_bytes()));
        let mut bytes = Log::MARK.to_vec();
        bytes.extend(with_checksum(body));
        bytes
    }
}

/// Reads the header; returns it with the bytes that follow.
fn header(bytes: &[u8]) -> Result<(LogHeader, &[u8]), LogError> {
    if bytes.is_empty() {
        return Err(LogError::Empty);
    }
    let Some(body) = bytes.strip_prefix(Log::MARK) else {
        let foreign = !Log::MARK.starts_with(bytes);
        return Err(if foreign { LogError::Foreign } else { LogError::Truncated { at: 0 } });
    };
    let at = Log::MARK.len();
    let [channels, kind, name_length] = *body.first_chunk::<3>().ok_or(LogError::Truncated { at })?;
    let (channels, name_length) = (usize::from(channels), usize::from(name_length));
    let length = 3 + name_length + 8 + 4 + 8 + 2 * channels + 4;
    let (body, rest) = body.split_at_checked(length).ok_or(LogError::Truncated { at })?;
    let damaged = || LogError::Damaged { at };
    let body = checked(body).ok_or_else(damaged)?;
    let (name, numbers) = body[3..].split_at(name_length);
    let (numbers, hanging) = numbers.split_at(20);
    let (hash, numbers) = numbers.split_first_chunk::<8>().ok_or_else(damaged)?;
    let (period, full) = numbers.split_first_chunk::<4>().ok_or_else(damaged)?;
    let full = f64::from_le_bytes(*full.first_chunk().ok_or_else(damaged)?);
    let drive = match kind {
        0 => DriveScale::Duty,
        1 if full.is_finite() && full > 0.0 => DriveScale::Force(full),
        2 if full.is_finite() && full > 0.0 => DriveScale::Steps(full),
        _ => return Err(damaged()),
    };
    let rig = core::str::from_utf8(name).map_err(|_| damaged())?.to_owned();
    let period_ns = u32::from_le_bytes(*period);
    if channels < 2 || period_ns == 0 {
        return Err(damaged());
    }
    let hanging = hanging.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
    Ok((LogHeader { rig, hash: u64::from_le_bytes(*hash), period_ns, drive, hanging }, rest))
}

fn with_checksum(mut body: Vec<u8>) -> Vec<u8> {
    let crc = crc32(0, &body);
    body.extend(crc.to_le_bytes());
    body
}

/// The bytes before the checksum, if it is right.
fn checked(bytes: &[u8]) -> Option<&[u8]> {
    let (body, crc) = bytes.split_last_chunk::<4>()?;
    (crc32(0, body) == u32::from_le_bytes(*crc)).then_some(body)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn log(numbers: &[u32]) -> Log {
        let header = LogHeader {
            rig: "two".to_owned(),
            hash: 7,
            period_ns: 1_000_000,
            drive: DriveScale::Force(3.0),
            hanging: vec![5, 65530, 100],
        };
        let mut log = Log::new(header);
        for &number in numbers {
            let drive = (number as i16).wrapping_mul(77);
            let tick = Tick { number, drive, supply_mv: 12_000, contacts: (number / 50) as u8 & 3 };
            log.push(tick, &[number as u16, 65530u16.wrapping_add(number as u16), 100]);
        }
        log
    }

    #[test]
    fn a_log_comes_back_as_written() {
        let numbers: Vec<u32> = (3..40).chain(44..120).collect();
        let log = log(&numbers);
        let back = Log::from_bytes(&log.to_bytes()).unwrap();
        assert_eq!(back, log);
        assert_eq!(back.lost(), 4);
        assert_eq!(back.deviations()[..6], [-2, 3, 0, -1, 4, 0]);
    }

    #[test]
    fn damage_is_named() {
        let bytes = log(&(0..30).collect::<Vec<_>>()).to_bytes();
        assert_eq!(Log::from_bytes(b""), Err(LogError::Empty));
        assert_eq!(Log::from_bytes(b"UPRT"), Err(LogError::Truncated { at: 0 }));
        assert_eq!(Log::from_bytes(b"tick,time_s\n"), Err(LogError::Foreign));
        let frame = 8 + 10 * 8 + 4;
        let head = bytes.len() - 3 * frame;
        assert_eq!(Log::from_bytes(&bytes[..head]), Err(LogError::Empty));
        assert_eq!(
            Log::from_bytes(&bytes[..bytes.len() - 1]),
            Err(LogError::Truncated { at: head + 2 * frame })
        );
        let mut bad = bytes.clone();
        bad[head + frame + 20] ^= 1;
        assert_eq!(Log::from_bytes(&bad), Err(LogError::Damaged { at: head + frame }));
        bad = bytes.clone();
        bad[12] ^= 1;
        assert_eq!(Log::from_bytes(&bad), Err(LogError::Damaged { at: 8 }));
        let twice: Vec<u8> = bytes.iter().chain(&bytes[head..]).copied().collect();
        assert_eq!(Log::from_bytes(&twice), Err(LogError::Order { at: bytes.len() }));
    }

    #[test]
    fn csv_has_a_row_per_tick() {
        let mut text = Vec::new();
        log(&[7, 8]).write_csv(&[0.5, 0.25, 1.0], &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0].split(',').next_back(), Some("driver_fault"));
        assert_eq!(rows[2], "8,0.001000,3,8,0,1.5000000,2.0000000,0.0000000,0.056398,12.000,0,0,0,0");
    }

    proptest! {
        #[test]
        fn no_bytes_break_the_reader(bytes in prop::collection::vec(any::<u8>(), 0..400), keep in 0..200usize) {
            let _ = Log::from_bytes(&bytes);
            let mut log = log(&(0..20).collect::<Vec<_>>()).to_bytes();
            log.truncate(keep);
            log.extend(&bytes);
            let _ = Log::from_bytes(&log);
        }

        #[test]
        fn a_flipped_bit_is_found(at in any::<prop::sample::Index>(), bit in 0..8u8) {
            let mut bytes = log(&(0..30).collect::<Vec<_>>()).to_bytes();
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
            prop_assert!(Log::from_bytes(&bytes).is_err());
        }
    }
}
