//! The rig file with the chosen numbers.

use super::candidate::LawNumbers;
use super::search::Choice;
use upright_design::number::significant;
use upright_design::rig::{PolePlacement, Rig, RigError, RigText, Tolerances};
use upright_design::simulate::Disturbance;

/// Digits of a number in the file.
const DIGITS: usize = 6;

/// The text of a rig file with the choice in it, and with `name`; everything else stays, comments too. `file` is the
/// name of the old file.
///
/// # Errors
/// [`RigError`] if the text is not TOML.
pub fn rewritten(
    text: &str,
    file: &str,
    name: &str,
    rig: &Rig,
    tolerances: &Tolerances,
    choice: &Choice,
) -> Result<String, RigError> {
    let mut text = RigText::parse(text, file.as_ref())?;
    text.set("name", &format!("{name:?}"))?;
    text.set("kalman.joint_noise", &list(&choice.joint_noise))?;
    for chosen in &choice.laws {
        match &chosen.candidate.numbers {
            LawNumbers::Weights(weights) => {
                let written = match &weights.mixed_weights[..] {
                    [] => list(&weights.state_weights),
                    _ => format!(
                        "[{}]",
                        weights.weight_rows().iter().map(|row| list(row)).collect::<Vec<_>>().join(", ")
                    ),
                };
                text.set("lqr.state_weights", &written)?;
                let key = format!("lqr.{}", rig.actuator.input().weight_key());
                text.set(&key, &significant(weights.force_weight, DIGITS))?;
            }
            LawNumbers::Poles(PolePlacement::Response { far_poles, .. }) => {
                text.set("pole_placement.far_poles", &list(far_poles))?;
            }
            // Poles given one by one are never changed.
            LawNumbers::Poles(PolePlacement::Poles(_)) => {}
        }
    }
    // Without these, the runs of `verify` would follow the new joint noise.
    let disturbance = Disturbance::of(rig);
    if rig.verify.torque_rms_n_m.is_none() {
        text.set("verify.torque_rms_n_m", &significant(disturbance.torque_n_m, DIGITS))?;
    }
    if rig.verify.force_rms_n.is_none() && rig.actuator.input().is_force() {
        text.set("verify.force_rms_n", &significant(disturbance.force_n, DIGITS))?;
    }
    set_tolerances(&mut text, tolerances)?;
    Ok(format!("{}{text}", head(file, choice, rig.input_quantity().unit)))
}

/// Gives a rig file these tolerances as its `[robust]`; those that are 0 are left out.
///
/// # Errors
/// [`RigError`] if the file has something else of that name.
pub fn set_tolerances(text: &mut RigText, tolerances: &Tolerances) -> Result<(), RigError> {
    let mut stated = tolerances.each().filter(|(_, _, value)| *value != 0.0);
    stated.try_for_each(|(key, _, value)| text.set(&format!("robust.{key}"), &significant(value, DIGITS)))
}

fn head(file: &str, choice: &Choice, unit: &str) -> String {
    let mut head = format!(
        "# Written by `upright robust {file}`: that file with the weights, far poles and joint noise that survive\n\
         # its [robust] with the least ripple. The comments below are those of that file.\n\
         #   joint noise × {}\n",
        significant(choice.joint_noise_factor, 3)
    );
    for chosen in &choice.laws {
        head.push_str(&format!(
            "#   {}: {}; predicted ripple {} {unit}\n",
            chosen.law,
            chosen.candidate.name,
            significant(chosen.ripple_n, 3)
        ));
    }
    head.push_str("#\n");
    head
}

fn list(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|&number| significant(number, DIGITS)).collect();
    format!("[{}]", numbers.join(", "))
}
