//! Tests of the paper's numbers. One program, so that linking happens once.

mod paper;
mod paper_matrices;
mod reproduce_numbers;
mod reproduced;

use upright_test_support::published;
