//! Tests of verification and of the search for robust weights. One program, so that linking happens once.

mod acceleration_imperfect;
mod arm;
mod known_friction;
mod pushes;
mod robust;
mod robust_generated;
mod verify_linear;
mod verify_nonlinear;

use upright_test_support::published;
