//! Tests of identification, with simulated machines. One program, so that linking happens once.

mod identify;
mod identify_coverage;
mod identify_rows;
mod identify_stepper;
mod identify_truth;
mod planted_errors;
mod swinging;
