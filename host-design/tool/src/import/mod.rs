//! Rig files from the descriptions of other programs: a cart and a chain of hinges in a URDF.
//!
//! ```
//! let urdf = r#"<robot name="p">
//!   <link name="rail"/>
//!   <link name="cart"><inertial><mass value="0.5"/></inertial></link>
//!   <link name="rod"><inertial>
//!     <origin xyz="0 0 0.3"/><mass value="0.2"/><inertia ixx="6e-3" iyy="6e-3" izz="0"/>
//!   </inertial></link>
//!   <joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/></joint>
//!   <joint name="hinge" type="continuous"><parent link="cart"/><child link="rod"/><axis xyz="0 1 0"/></joint>
//! </robot>"#;
//! let rig_file = upright_tool::import::rig_file(urdf, "p.urdf")?;
//! assert!(rig_file.contains("mass_kg = 0.2") && rig_file.contains("centre_of_mass_m = 0.3"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod hinges;
mod rig_text;
mod urdf;

pub use error::ImportError;

/// The text of a rig file for the machine in a URDF. `file` is its name, for messages. A comment marks each number that
/// a URDF does not have.
///
/// # Errors
/// [`ImportError`] if the text is no URDF, or the machine is not a cart with a chain of parallel hinges.
pub fn rig_file(text: &str, file: &str) -> Result<String, ImportError> {
    let robot = urdf::Robot::read(text)?;
    let machine = hinges::Machine::of(&robot)?;
    rig_text::rig_text(&robot.name, file, &machine)
}
