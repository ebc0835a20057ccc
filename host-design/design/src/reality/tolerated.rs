//! Machines within the tolerances of `[robust]`.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::rig::{CartInput, PerJoint, Rig, Tolerances};

/// The rig with `share` of the tolerances for friction, zeros and latency, and with its own masses.
pub fn tolerated_machine(rig: &Rig, tolerances: &Tolerances, share: f64) -> Rig {
    let mut rig = rig.clone();
    let (real, tolerances) = (&mut rig.reality, tolerances.scaled(share));
    real.friction.joint_friction_n_m = PerJoint::all(tolerances.joint_friction_n_m);
    real.friction.cart_friction_n = tolerances.cart_friction_n;
    real.sensors.homing_error_rad = PerJoint::all(tolerances.homing_error_rad);
    real.driver.latency_s = tolerances.latency_s;
    rig
}

/// Machine of the run with this number: drawn within `[robust]`, or, if the rig file has none, the machine of
/// `[reality]`.
///
/// Friction, zero errors and latency are the same share of their tolerances, drawn uniformly from 0 to 1. The error of
/// each mass is drawn uniformly within its tolerance.
pub fn drawn_machine(rig: &Rig, number: u64) -> Rig {
    let (Some(tolerances), Some(chain)) = (&rig.robust, rig.chain()) else {
        return rig.clone();
    };
    let mut random = Pcg64::seed_from_u64(number);
    let mut machine = tolerated_machine(rig, tolerances, random.random_range(0.0..=1.0));
    let percent = tolerances.mass_percent;
    let mut wrong = || percent * random.random_range(-1.0..=1.0);
    let parameters = &mut machine.reality.parameters;
    parameters.cart_mass_percent = wrong();
    parameters.link_mass_percent = PerJoint::each(chain.links.iter().map(|_| wrong()).collect());
    machine
}

/// Machine at the combination of wrong masses with this number, with the full tolerances of `[robust]` for friction,
/// zero errors and latency.
///
/// The cart is too heavy if the lowest bit of the number is set, the first link if the next is, and so on. Where the
/// drive imposes the cart's acceleration, the lowest bit belongs to the first link.
pub fn corner_machine(rig: &Rig, number: u64) -> Rig {
    let (Some(tolerances), Some(chain)) = (&rig.robust, rig.chain()) else {
        return rig.clone();
    };
    let mut machine = tolerated_machine(rig, tolerances, 1.0);
    let percent = tolerances.mass_percent;
    let first = first_mass(rig);
    let wrong = |part: usize| if number >> (part - first) & 1 == 1 { percent } else { -percent };
    let parameters = &mut machine.reality.parameters;
    if first == 0 {
        parameters.cart_mass_percent = wrong(0);
    }
    parameters.link_mass_percent = PerJoint::each((1..=chain.links.len()).map(wrong).collect());
    machine
}

/// Number of machines of [`corner_machine`]; 0 for a model.
pub fn corners_of(rig: &Rig) -> u64 {
    rig.chain().map_or(0, |chain| 2 << (chain.links.len() - first_mass(rig)))
}

/// The first part whose mass matters (0: cart): a drive that imposes the cart's acceleration does not feel its mass.
pub fn first_mass(rig: &Rig) -> usize {
    usize::from(rig.actuator.input() == CartInput::Acceleration)
}
