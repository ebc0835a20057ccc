//! Tests of rig files, plant, design, simulation and verification. One program, so that linking happens once.

mod acceleration;
mod acceleration_firmware;
mod acceleration_imperfect;
mod acceleration_motor;
mod design_properties;
mod homing;
mod identify;
mod identify_coverage;
mod known_friction;
mod lockstep;
mod plant_equations;
mod plant_linear_model;
mod plant_linearisation;
mod plant_motion;
mod plant_rigs;
mod plant_sines;
mod public_machines;
mod pushes;
mod reality_friction;
mod reality_loop;
mod rig_errors;
mod rig_files;
mod robust;
mod robust_generated;
mod supervised;
mod supervisor_false_alarms;
mod supervisor_faults;
mod supervisor_rules;
mod supervisor_session;
mod swing_up;
mod swing_up_firmware;
mod transitions;
mod verify_linear;
mod verify_nonlinear;

use upright_test_support::published;
