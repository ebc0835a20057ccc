//! The control core in closed loop with the nonlinear plant, and the image in QEMU. One program, so that linking
//! happens once.

mod bench;
mod c_header;
mod c_library;
mod chips;
mod closed_loop;
mod embassy;
mod encoders_only;
mod equipment;
mod fuzz_corpus;
mod gains_table;
mod governor;
mod in_the_loop;
mod integral;
mod lost_loops;
mod mountings;
mod own_board;
mod pico;
mod plain_equations;
mod rig_fuzz;
mod set_points;
mod verdicts;

use upright_test_support::published;
