//! Tests of rig files, plant, design and simulation. One program, so that linking happens once.

mod design_properties;
mod motor;
mod plant_arm;
mod plant_equations;
mod plant_linear_model;
mod plant_linearisation;
mod plant_motion;
mod plant_rigs;
mod plant_sines;
mod public_machines;
mod reality_friction;
mod rig_arm;
mod rig_errors;
mod rig_files;

use upright_test_support::published;
