//! The machine of a rig file for simulators: MJCF, which MuJoCo reads, and URDF.
//!
//! The rail is along x, z points up, and the hinges turn about -y: `slide`, `hinge_1`, … have the signs of the rig
//! file, and each hinge is straight at 0. Masses, lengths and inertias are those of the simulated machine, with
//! `[reality]`.
//!
//! ```
//! use std::path::Path;
//! use upright_design::rig::Rig;
//!
//! let text = "name = \"p\"\n[cart]\nmass_kg = 0.5\n[[link]]\nmass_kg = 0.2\nlength_m = 0.6\n";
//! let rig = Rig::from_toml(text, Path::new("p.toml"))?;
//! assert!(upright_tool::simulator_model::mjcf(&rig)?.contains("<joint name=\"hinge_1\""));
//! assert!(upright_tool::simulator_model::urdf(&rig)?.contains("<joint name=\"hinge_1\""));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod machine;
mod mjcf;
mod urdf;

pub(crate) use machine::{TIP, UNLIMITED};

pub use machine::NoModel;
pub use mjcf::mjcf;
pub use urdf::urdf;
