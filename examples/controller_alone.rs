//! The controller alone, without a supervisor, in a program of your own: `cargo run --example controller_alone`.
//!
//! It balances the rig of the committed table. Here the machine is its equations of motion; yours has counters and a
//! motor. Nothing looks after limits, signs, homing, a fall or a broken wire: that is what `Firmware` is for.

// Yours is `mod gains;`, as `upright design` has written it.
#[path = "../src/gains.rs"]
#[allow(dead_code, unreachable_pub, reason = "a table of which not all is needed")]
mod gains;

use gains::{SENSORS, STATES, TABLE, TICK_S};
use upright::control::controller::Controller;
use upright::control::encoder::CounterWidth;
use upright::nalgebra::{SMatrix, SVector};
use upright::table::ChainModel;

const LINKS: usize = SENSORS - 1;
/// Cart and links of `rigs/quadruple-paper.toml`: uniform rods.
const CART_KG: f32 = 0.1;
const LINK_KG: f32 = 0.1;
const LENGTHS_M: [f32; LINKS] = [0.03, 0.04, 0.07, 0.10];
/// Steps of the encoders.
const CART_STEP_M: f32 = 2e-5;
const COUNTS_PER_TURN: f32 = 4096.0;

/// The machine's constants: a rod has its mass in the middle, and all rods above it at its end.
fn machine() -> ChainModel<LINKS> {
    let mass = CART_KG + LINK_KG * LINKS as f32;
    let above = |link: usize| LINK_KG * (LINKS - 1 - link) as f32;
    let a = SVector::from_fn(|j, _| (LINK_KG / 2.0 + above(j)) * LENGTHS_M[j]);
    let b = SMatrix::from_fn(|j, k| {
        let own = if j == k { LINK_KG / 3.0 } else { LINK_KG / 2.0 };
        (own + above(j.max(k))) * LENGTHS_M[j] * LENGTHS_M[k]
    });
    ChainModel {
        inverse_mass: 1.0 / mass,
        a,
        weight: a * 9.81,
        b,
        b_reduced: b - a * a.transpose() / mass,
        reaction: a,
        cart_friction: 0.0,
        joint_frictions: SVector::zeros(),
        turning: None,
    }
}

/// What the counters read.
fn counters(state: &[f32; STATES]) -> [u32; SENSORS] {
    std::array::from_fn(|sensor| {
        let step = if sensor == 0 { CART_STEP_M } else { std::f32::consts::TAU / COUNTS_PER_TURN };
        (state[2 * sensor] / step).round() as i32 as u32
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let machine = machine();
    let mut state = [0.0; STATES];
    // All links upright and at rest, all counters at 0, the cart half a metre from where it shall be.
    let mut controller = Controller::new(&TABLE, [CounterWidth::Bits32; SENSORS])?;
    controller.start(&[0; SENSORS])?;
    controller.set_setpoint(0.5)?;
    for tick in 0..8000 {
        let command = controller.control(&counters(&state)); // as soon as the counters are read
        machine.predict(&mut state, command.applied_n, TICK_S); // the motor drives the machine for a tick
        controller.predict(); // meanwhile
        if tick % 1000 == 0 {
            println!("{tick} ms: cart at {:.4} m, {:+.3} N", state[0], command.applied_n);
        }
    }
    let error_m = (state[0] - 0.5).abs();
    // It wanders by some centimetres: a count is 0.09°.
    if error_m < 0.05 { Ok(()) } else { Err(format!("the cart is {error_m} m off").into()) }
}
