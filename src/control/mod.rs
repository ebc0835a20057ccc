//! From encoder counts to motor duty cycle, once per tick.
//!
//! A [`Controller`](controller::Controller) also takes positions in SI units, from absolute sensors or from somebody
//! else's driver. The same positions give the same bits:
//!
//! ```
//! # mod gains { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/gains.rs")); }
//! use gains::{SENSORS, TABLE};
//! use upright::control::controller::Controller;
//! use upright::control::encoder::CounterWidth;
//!
//! let mut controller = Controller::new(&TABLE, [CounterWidth::Bits32; SENSORS])?;
//! let mut positions = [0.0; SENSORS]; // metres, radians
//! controller.start_at(&positions)?;
//! positions[1] = 0.002; // the first link leans
//! let command = controller.control_at(&positions);
//! controller.predict();
//! assert!(command.applied_n != 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod actuator;
pub mod controller;
pub mod encoder;
pub mod friction;
pub mod motion;
pub mod observer;
mod rejected;
pub mod spring_damper;
pub mod state_feedback;
