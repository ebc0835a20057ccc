//! The law with which the motor stills the links, as text.

use upright_design::design::Stilling;
use upright_design::rig::Rig;

/// The law for `rig`, or why there is none.
pub fn stilling(rig: &Rig) -> String {
    Stilling::of(rig).map_or_else(|none| format!("\nstilling\n  none: {none}\n"), |law| format!("\n{law}"))
}
