//! Tests of planned motions. One program, so that linking happens once.

mod swing_up;
mod swing_up_firmware;
mod transitions;

use upright_test_support::published;
