//! The control core in closed loop with the nonlinear plant, and the images. One program, so that linking happens once.

mod absolute_sensors;
mod acceleration;
mod acceleration_firmware;
mod acceleration_motor;
mod acceleration_servo;
mod bench;
mod c_header;
mod c_library;
mod chips;
mod closed_loop;
mod driver_lag;
mod embassy;
mod encoders_only;
mod equipment;
mod fuzz_corpus;
#[path = "../../src/gains.rs"]
#[allow(dead_code, unreachable_pub, reason = "a table of which not all is needed")]
mod gains;
mod gains_table;
mod governor;
mod homing;
mod image_tables;
mod in_the_loop;
mod integral;
mod lockstep;
mod lost_loops;
mod mountings;
mod own_board;
mod pico;
mod plain_equations;
mod potentiometer;
mod reality_loop;
mod rig_fuzz;
mod set_points;
mod stilling;
mod supervised;
mod supervisor_false_alarms;
mod supervisor_faults;
mod supervisor_rules;
mod supervisor_session;
mod two_wires;
mod verdicts;

use upright_test_support::published;
