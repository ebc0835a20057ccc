//! Tests of the virtual board: one program.

mod exceptions;
mod independent_answers;
mod peripherals;
mod program;
mod strictness;
mod supply_and_chip;
