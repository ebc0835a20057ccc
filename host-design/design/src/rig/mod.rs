//! The rig file: what the user knows about the machine on the bench, in SI units.
//!
//! [`Rig`] holds the values as the file gives them; defaults that follow from other values (the centre of mass of a
//! uniform rod, its inertia, an encoder's step from its counts) stay `None` here and are computed where they are used,
//! in the precision used there.
//!
//! ```
//! use upright_design::rig::{Rig, RigText};
//!
//! let file = "../../rigs/single-quanser-ip02.toml".as_ref();
//! let mut text = RigText::parse(&std::fs::read_to_string(file)?, file)?;
//! text.set("link[1].mass_kg", "0.25")?;
//! let rig = Rig::from_toml(&text.to_string(), file)?;
//! assert_eq!(rig.chain().map(|chain| chain.links[0].mass_kg), Some(0.25));
//! // An error names file, line and key.
//! text.set("link[1].mass_kg", "-0.25")?;
//! let error = Rig::from_toml(&text.to_string(), file).unwrap_err().to_string();
//! assert!(error.contains("link[1].mass_kg"), "{error}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod base;
mod cart_only;
pub mod defaults;
mod describe;
mod description;
mod document;
mod edit;
mod error;
mod held;
mod key;
mod load;
mod node;
mod quantity;
mod read;
mod rule;
mod sections;
mod sensors;
mod typical;
mod unusual;
mod value;

pub use base::Base;
pub use cart_only::CartOnly;
pub use description::Rig;
pub use document::key_table;
pub use edit::RigText;
pub use error::{MAX_BYTES, Place, RigError, RigErrorKind};
pub use held::Held;
pub(crate) use held::lag_at;
pub use key::{Absent, Key, Section, unit_in_names};
pub use quantity::Quantity;
pub use rule::Rule;
pub use sections::actuator::{AccelerationDrive, Actuator, ForceDrive, Motor};
pub use sections::chain::{Cart, CartInput, Chain, MAX_LINKS, PlantDescription};
pub use sections::friction::KnownFriction;
pub(crate) use sections::imperfections::ArmSizes;
pub use sections::imperfections::{Allowance, IMPERFECTIONS, Imperfection, LargestSize, Slider};
pub use sections::integral::Integral;
pub use sections::kalman::KalmanNoise;
pub use sections::limits::Limits;
pub use sections::link::{Link, LinkEncoder, MEASUREMENTS_OF_A_LINK, TurnErrors};
pub use sections::lqr::Lqr;
pub use sections::model::LinearPlant;
pub use sections::pole_placement::PolePlacement;
pub use sections::reality::{
    DriveTrain, DriverErrors, DryFriction, FrictionLaw, ParameterErrors, Reality, SensorErrors, StepMotorData,
};
pub use sections::robust::{ToleranceKey, Tolerances};
pub use sections::swing_up::SwingUpRules;
pub use sections::tick::Tick;
pub(crate) use sections::verify::VERIFY;
pub use sections::verify::{RequiredSize, Requirements};
pub use sections::{SECTIONS, TOP};
pub use sensors::{AbsoluteRange, Sensor};
pub use unusual::UnusualValue;
pub use value::PerJoint;
