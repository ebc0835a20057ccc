//! Tests of the virtual board: one program.

mod independent_answers;
