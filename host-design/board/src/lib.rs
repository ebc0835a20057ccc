//! A virtual board with an STM32F405, STM32F407 or STM32F446: it runs the very ELF file that is flashed.
//!
//! A [`Board`] interprets the image's instructions against models of the registers that the firmware uses. It is strict:
//! what the manuals do not allow, or what is not modelled, ends the run with a [`Stopped`] that says where and why.
//! Inputs are edges, levels, volts and bytes at their baud rate; the output is what the pins do.
//!
//! ```no_run
//! use upright_board::{Board, Conditions, Image, Input, Rules, Wire, Wiring, pin, seconds};
//!
//! let image = Image::from_elf(&std::fs::read("upright-image")?)?;
//! let mut board = Board::power_on(&image, &Conditions::f405(1), Wiring::upright(), Rules::NOTED)?;
//! board.apply(Input::Level(pin('B', 12), Wire::Low));
//! board.apply(Input::Supply(24.0));
//! board.run_until(seconds(0.1))?;
//! println!("{} bytes sent", board.sent().len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is approximate
//! Cycles (see `execute`): ARM's table with the flash accelerator looked up by address. DWT_CYCCNT counts during WFI,
//! too. What is exact: every value, every flag, every exception, for given inputs and given times.

#![forbid(unsafe_code)]

mod board;
mod bus;
mod chip;
mod clock;
mod decode;
mod error;
mod execute;
mod image;
mod instruction;
mod machine;
mod peripherals;
mod processor;
pub mod single_step;
mod wiring;

pub use board::{Board, Input, PowerStage};
pub use bus::{Conditions, Driven};
pub use chip::Chip;
pub use clock::{Time, UNITS_PER_MICROSECOND, UNITS_PER_SECOND, seconds};
pub use error::{Note, Rule, Rules, Stopped, Violation};
pub use image::{Image, ImageError};
pub use peripherals::gpio::Wire;
pub use peripherals::rcc::Crystal;
pub use peripherals::usart::LineByte;
pub use wiring::{Pin, Wiring, pin};
