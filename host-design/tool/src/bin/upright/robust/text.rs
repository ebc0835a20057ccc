//! What was chosen and what it survives, as text.

use core::fmt::Write;

use upright_design::number::significant;
use upright_design::rig::{PolePlacement, Rig, Tolerances};
use upright_trust::robust::{Choice, Chosen, Front, JudgeSettings, Judgement, LawNumbers, LawRipple};

/// The choice for each law, then the front.
pub(super) fn chosen(rig: &Rig, tolerances: &Tolerances, choice: &Choice, front: Option<&Front>) -> String {
    let mut out = head(rig, tolerances);
    // Writing into a String cannot fail.
    let _ = write_choice(&mut out, choice, rig);
    if let Some(front) = front {
        let _ = write_front(&mut out, front, rig.input_quantity().unit);
    }
    out
}

/// What the numbers of the file survive.
pub(super) fn judged(
    rig: &Rig,
    tolerances: &Tolerances,
    settings: &JudgeSettings,
    laws: &[Judgement],
) -> String {
    let mut out = head(rig, tolerances);
    let _ = writeln!(
        out,
        "the numbers of the file in runs of {} s, with shares of friction, zeros and latency",
        settings.duration_s
    );
    for judgement in laws {
        let _ = writeln!(out, "\n{}", judgement.law);
        let _ = write_judgement(&mut out, judgement, rig);
    }
    out
}

fn head(rig: &Rig, tolerances: &Tolerances) -> String {
    let stated = tolerances.each().filter(|(_, _, value)| *value != 0.0);
    let stated: Vec<String> =
        stated.map(|(key, _, value)| format!("{key} = {}", significant(value, 4))).collect();
    format!("{}: {}\n", rig.name, rig.words(&stated.join(", ")))
}

fn write_choice(out: &mut String, choice: &Choice, rig: &Rig) -> core::fmt::Result {
    let factor = significant(choice.joint_noise_factor, 3);
    writeln!(out, "joint noise × {factor}: {}", list(&choice.joint_noise))?;
    writeln!(out, "judged in runs with shares of friction, zeros and latency")?;
    for Chosen { law, candidate, ripple_n, own_ripple_n, judgement } in &choice.laws {
        writeln!(out, "\n{law}: {}", candidate.name)?;
        match &candidate.numbers {
            LawNumbers::Weights(weights) => {
                writeln!(out, "  state_weights   {}", list(&weights.state_weights))?;
                writeln!(
                    out,
                    "  {:<15} {}",
                    rig.base().name("lqr", rig.actuator.input().weight_key()),
                    significant(weights.force_weight, 6)
                )?;
            }
            LawNumbers::Poles(PolePlacement::Response { far_poles, .. }) => {
                writeln!(out, "  far_poles       {}", list(far_poles))?;
            }
            LawNumbers::Poles(PolePlacement::Poles(_)) => {}
        }
        let own = own_ripple_n.map_or("not stable".to_owned(), |ripple| significant(ripple, 3));
        let (ripple, unit) = (significant(*ripple_n, 3), rig.input_quantity().unit);
        writeln!(out, "  predicted ripple {ripple} {unit} (as in the file: {own})")?;
        write_judgement(out, judgement, rig)?;
    }
    Ok(())
}

fn write_judgement(out: &mut String, judgement: &Judgement, rig: &Rig) -> core::fmt::Result {
    let (input, base) = (rig.input_quantity(), rig.base());
    let force = match rig.actuator.input().is_force() {
        true => format!("{}, {} rms", input.name, input.unit),
        false => format!("{} rms", input.unit),
    };
    let position = format!("{}, m{}", base.noun(), base.position().unit);
    let head = ["share", "survive", &force, "angle, mrad", &position, "ended by"];
    let row = |[share, survived, force, angle, cart, ended_by]: [&str; 6]| {
        format!("  {share:<8}{survived:>12}{force:>15}{angle:>14}{cart:>11}   {ended_by}")
    };
    writeln!(out, "{}", row(head))?;
    for runs in &judgement.machines {
        let share = runs.share.to_string();
        let survived = format!("{} of {}", runs.survived, runs.runs);
        let figures = [runs.force_rms_n, 1e3 * runs.peak_angle_rad, 1e3 * runs.peak_position_m];
        // They are of the runs that survived: blank if none did.
        let [force, angle, cart] =
            figures.map(|figure| if runs.survived == 0 { String::new() } else { significant(figure, 3) });
        let ended_by = runs.ended_by.map_or(String::new(), |kind| rig.words(&kind.to_string()));
        writeln!(out, "{}", row([&share, &survived, &force, &angle, &cart, &ended_by]).trim_end())?;
    }
    match judgement.corners {
        Some([all, survived]) => {
            writeln!(out, "  share 1 with wrong masses: {survived} of {all} combinations survive")
        }
        None => Ok(()),
    }
}

fn write_front(out: &mut String, front: &Front, unit: &str) -> core::fmt::Result {
    writeln!(out, "\nleast ripple at multiples of the tolerances (by one run of 10 s for each share)")?;
    for point in &front.0 {
        let scale = significant(point.scale, 3);
        match &point.best {
            None => writeln!(out, "  × {scale:<5} nothing survives")?,
            Some(best) => {
                writeln!(out, "  × {scale:<5} joint noise × {}", significant(best.joint_noise_factor, 3))?;
                for LawRipple { law, name, ripple_n } in &best.laws {
                    writeln!(out, "          {law}: {} {unit}, {name}", significant(*ripple_n, 3))?;
                }
            }
        }
    }
    Ok(())
}

fn list(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|&number| significant(number, 6)).collect();
    format!("[{}]", numbers.join(", "))
}
