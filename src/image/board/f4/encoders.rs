//! Incremental encoders, counted by timers.

use crate::pac::{TIM2, TIM3, TIM4, TIM5, TIM8};
use upright::boards::wiring::{Signal, encoders, wire_of};
use upright::control::encoder::CounterWidth::{self, Bits16, Bits32};
use upright::gains::SENSORS;

use super::chosen::BOARD;
use super::motor::GIVES_PULSES;
use super::sensors::is_absolute;

/// The timers in use, cart first, then the links from the lowest up.
const TIMERS: [(*const u32, CounterWidth); SENSORS] = {
    assert!(SENSORS <= encoders(BOARD.wiring), "this board counts fewer encoders than the rig has");
    let mut timers = [(core::ptr::null(), Bits16); SENSORS];
    let mut i = 0;
    while i < SENSORS {
        timers[i] = match wire_of(BOARD.wiring, Signal::Encoder(i as u8, b'A')).number("TIM") {
            2 => (TIM2::PTR.cast(), Bits32),
            3 => (TIM3::PTR.cast(), Bits16),
            4 => (TIM4::PTR.cast(), Bits16),
            5 => (TIM5::PTR.cast(), Bits32),
            8 => (TIM8::PTR.cast(), Bits16),
            _ => panic!("this timer has no encoder mode, or no clock here"),
        };
        i += 1;
    }
    timers
};

/// Address of a sensor's counter register, if the sensor is in use: the cart's is not, where pulses move it; nor
/// is that of an absolute sensor.
const fn counter(sensor: usize) -> Option<*const u32> {
    if sensor < SENSORS && !is_no_counter(sensor) {
        Some(TIMERS[sensor].0.wrapping_byte_add(CNT))
    } else {
        None
    }
}

const fn is_no_counter(sensor: usize) -> bool {
    is_absolute(sensor) || GIVES_PULSES && sensor == 0
}

/// Widths of the counters in use.
pub(super) const WIDTHS: [CounterWidth; SENSORS] = {
    let mut widths = [Bits16; SENSORS];
    let mut i = 0;
    while i < SENSORS {
        widths[i] = if is_no_counter(i) { Bits32 } else { TIMERS[i].1 };
        i += 1;
    }
    widths
};

// Register offsets, the same in all these timers (RM0090, 17.4 and 18.4).
const CR1: usize = 0x00;
const SMCR: usize = 0x08;
const CCMR1: usize = 0x18;
const CNT: usize = 0x24;
const ARR: usize = 0x2c;

/// Starts the counters in use, at 0.
pub(super) fn set_up() {
    for &(timer, width) in &TIMERS {
        let write = |offset, value: u32| {
            // SAFETY: a register of this timer, which nothing else uses.
            unsafe { timer.byte_add(offset).cast_mut().write_volatile(value) };
        };
        // Each input goes directly to its own channel. A level counts only after eight equal samples of the timer's
        // clock (48 ns or 95 ns); anything shorter is noise (RM0090, 18.4.7: CCxS = 01, ICxF = 0011).
        write(CCMR1, 0x3131);
        // Encoder mode 3: every edge of both inputs counts (RM0090, 18.3.12).
        write(SMCR, 3);
        write(ARR, if width == Bits32 { u32::MAX } else { 0xffff });
        write(CR1, 1);
    }
}

/// Current readings of the counters in use.
pub(super) fn raw_counts() -> [u32; SENSORS] {
    const { assert!(SENSORS <= 5, "more encoders than are read here") };
    let mut counts = [0; SENSORS];
    // Unrolled, because a loop would fetch the addresses from a table in flash.
    macro_rules! read {
        ($($sensor:literal)*) => {
            $(if let (Some(count), Some(counter)) = (counts.get_mut($sensor), const { counter($sensor) }) {
                // SAFETY: reading a counter has no side effect.
                *count = unsafe { counter.read_volatile() };
            })*
        };
    }
    read!(0 1 2 3 4);
    counts
}
