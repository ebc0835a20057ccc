//! A virtual board with an STM32F405, STM32F407 or STM32F446: it runs the very ELF file that is flashed.
//!
//! A [`SimulatedBoard`] interprets the image's instructions against models of the registers that the firmware uses. It
//! is strict: anything that the manuals forbid or that is not modelled ends the run with a [`Stopped`] that says where
//! and why.
//! Inputs are encoder edges, pin levels, supply voltages and serial bytes at their baud rate; outputs are pin levels
//! and the bytes sent.
//!
//! ```no_run
//! use upright_board::{Conditions, ExternalLevel, Image, Input, Rules, SimulatedBoard, pin, seconds};
//!
//! let image = Image::from_elf(&std::fs::read("upright-image")?)?;
//! let mut board = SimulatedBoard::power_on(&image, &Conditions::f405(1), Rules::NOTED)?;
//! board.apply(Input::Level(pin('B', 12), ExternalLevel::Low));
//! board.apply(Input::Supply(24.0));
//! board.run_until(seconds(0.1))?;
//! println!("{} bytes sent", board.sent().len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is modelled
//! | what | section (RM0090) |
//! |---|---|
//! | ARMv7E-M with FPv4-SP, exceptions, lazy stacking, MPU, SysTick, NVIC, DWT cycle counter | ARM DDI 0403 |
//! | clock tree, clock security, reset flags, delays after enabling | 7.3; ES0182 2.1.13 |
//! | flash wait states that depend on the supply, approximate accelerator; option bytes (read-only) | 3.5, 3.9 |
//! | ports, external interrupts 0 to 15 and 16 (voltage detector) | 8.4, 12.3 |
//! | TIM1 channel 1 or its complementary output: one-pulse mode, repetition, preload, PWM, break, lock | 17.4 |
//! | TIM2 to 5, TIM8: encoder mode 3 with filter | 18.4 |
//! | TIM11: input capture, to measure HSE against HSI | 19.5 |
//! | ADC1, single conversions; USART2 or USART3, whichever is wired; DMA1 between it and SRAM; IWDG | 13.13, 30.6, 10.5, 21.4 |
//! | PWR with the voltage detector; brown-out reset at the level set in the option bytes | 5.2.2, 5.4 |
//! | DBGMCU: identity, and freezing of the watchdog while a debugger halts the core | 38.6, 38.16 |
//!
//! Not modelled, and an error if used: every other peripheral, other modes of these, rounding modes other than to
//! nearest, sleep deeper than WFI, bit-banding, writing flash. The rise time of pull-ups, the over-drive of the F446,
//! and the effect on the core of a supply too low for its clock are not modelled either.
//!
//! # What is approximate
//! Cycle counts: they follow ARM's table, with a direct-mapped model of the flash accelerator, in one of two ways
//! ([`CoreTiming`]). DWT_CYCCNT also counts
//! during WFI. Everything else is exact for given inputs at given times: every value, every flag, every exception.

#![forbid(unsafe_code)]

mod angle_sensor;
mod board;
mod bus;
mod chip;
mod clock;
mod decode;
mod effect;
mod error;
mod execute;
mod image;
mod instruction;
mod lines;
mod machine;
mod meter;
mod peripherals;
mod processor;
mod register_sensor;
pub mod single_step;
mod timing;
mod wiring;

pub use angle_sensor::SensorDefect;
pub use board::{Input, PowerStage, SimulatedBoard};
pub use bus::{Conditions, Driven, Pulse};
pub use chip::Chip;
pub use clock::{Time, UNITS_PER_MICROSECOND, UNITS_PER_SECOND, seconds};
pub use decode::is_wide;
pub use effect::{Effect, effect};
pub use error::{Note, Rules, Stopped, Strictness, Violation};
pub use image::{Image, ImageError};
pub use lines::{Lines, LinesError};
pub use meter::{CodePlace, Meter, TickCost, TickPart};
pub use peripherals::gpio::ExternalLevel;
pub use peripherals::power::BrownOut;
pub use peripherals::rcc::Crystal;
pub use peripherals::usart::LineByte;
pub use register_sensor::{RegisterDefect, RegisterSensor};
pub use timing::CoreTiming;
pub use wiring::{BoardWiring, Pin, pin};
