//! The rig file with the chosen numbers.

use super::candidate::LawNumbers;
use super::search::Choice;
use crate::number::significant;
use crate::rig::{PolePlacement, Rig, Tolerances, with_value};
use crate::verify::Disturbance;

/// Digits of a number in the file.
const DIGITS: usize = 6;

/// The text of a rig file with the choice in it, and with `name`; everything else stays, comments too. None if a key of
/// `text` has no place of its own, as in an inline table.
pub fn rewritten(
    text: &str,
    file: &str,
    name: &str,
    rig: &Rig,
    tolerances: &Tolerances,
    choice: &Choice,
) -> Option<String> {
    let mut text = text.to_owned();
    let mut set = |key: &str, value: String| {
        text = with_value(&text, key, &value)?.text;
        Some(())
    };
    set("name", format!("{name:?}"))?;
    set("kalman.joint_noise", list(&choice.joint_noise))?;
    for chosen in &choice.laws {
        match &chosen.candidate.numbers {
            LawNumbers::Weights(weights) => {
                set("lqr.state_weights", list(&weights.state_weights))?;
                set("lqr.force_weight", significant(weights.force_weight, DIGITS))?;
            }
            LawNumbers::Poles(PolePlacement::Response { far_poles, .. }) => {
                set("pole_placement.far_poles", list(far_poles))?;
            }
            // Poles given one by one are never changed.
            LawNumbers::Poles(PolePlacement::Poles(_)) => {}
        }
    }
    // Without these, the runs of `verify` would follow the new joint noise.
    let disturbance = Disturbance::of(rig);
    if rig.verify.torque_rms_n_m.is_none() {
        set("verify.torque_rms_n_m", significant(disturbance.torque_n_m, DIGITS))?;
    }
    if rig.verify.force_rms_n.is_none() {
        set("verify.force_rms_n", significant(disturbance.force_n, DIGITS))?;
    }
    Some(format!("{}{}", head(file, choice), with_tolerances(&text, tolerances)?))
}

/// The text of a rig file with these tolerances as its `[robust]`; those that are 0 are left out. None if a key of
/// `text` has no place of its own.
pub fn with_tolerances(text: &str, tolerances: &Tolerances) -> Option<String> {
    // A new key comes first in its section.
    let stated: Vec<_> = tolerances.each().filter(|(_, _, value)| *value != 0.0).collect();
    stated.into_iter().rev().try_fold(text.to_owned(), |text, (key, _, value)| {
        Some(with_value(&text, &format!("robust.{key}"), &significant(value, DIGITS))?.text)
    })
}

fn head(file: &str, choice: &Choice) -> String {
    let mut head = format!(
        "# Written by `upright robust {file}`: that file with the weights, far poles and joint noise that survive\n\
         # its [robust] with the least ripple. The comments below are those of that file.\n\
         #   joint noise × {}\n",
        significant(choice.joint_noise_factor, 3)
    );
    for chosen in &choice.laws {
        head.push_str(&format!(
            "#   {}: {}; predicted ripple {} N\n",
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
