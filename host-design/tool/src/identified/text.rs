//! An identification as text and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};
use upright_design::number::significant;
use upright_identify::{
    ChannelError, ChannelFit, Doubt, Estimate, Identification, ParameterKind, Settings, WindowErrors,
};

/// Below this angle the scale of the force is poorly known (rad).
const LARGE_ENOUGH_RAD: f64 = 30.0 * std::f64::consts::PI / 180.0;
/// Stands for the error of a prediction that has no number.
pub(super) const DIVERGES: &str = "diverges";
/// Factor on the deviations from which fewer rows are worth a note.
const DEAR: f64 = 1.2;
/// Share by which lengths and moments may be wrong without a model of the encoders' eccentricity.
const WITHOUT_ECCENTRICITY: f64 = 0.003;

/// The identification as text.
pub fn text(rig: &str, found: &Identification, settings: &Settings) -> String {
    let mut text = format!(
        "{rig}: {:.1} s of log, {} {}, links up to {:.0}° from hanging\n",
        found.seconds,
        found.lost_ticks,
        if found.rows.is_some() { "rows missing" } else { "ticks lost" },
        found.largest_angle_rad.to_degrees()
    );
    // Writing into a string cannot fail.
    if let Some(wiring) = &found.wiring {
        let _ = match wiring.is_as_in_file() {
            true => writeln!(text, "wiring: as in the file; any fault fits {:.1} times worse", wiring.margin),
            false => writeln!(text, "wiring: {}", wiring.best),
        };
    }
    if found.estimates.is_empty() {
        return text;
    }
    let _ = writeln!(
        text,
        "\n  {:<32}{:>13}{:>13}{:>12}{:>9}  unit",
        "parameter", "file", "found", "deviation", "change/σ"
    );
    for estimate in &found.estimates {
        let _ = writeln!(text, "{}", row(found, estimate));
    }
    if !found.channels.is_empty() {
        fits(&mut text, found);
    }
    for (what, errors) in windows(found) {
        let _ = writeln!(
            text,
            "\n{what}, error (rms) in % of the range\n  {:<10}{:>10}{:>12}{:>12}",
            "channel", "window", "file", "found"
        );
        for row in errors.iter().flat_map(window_rows) {
            let _ = writeln!(text, "  {:<10}{:>10}{:>12}{:>12}", row[0], row[1], row[2], row[3]);
        }
    }
    text.push('\n');
    for note in notes(found, settings) {
        let _ = writeln!(text, "- {note}");
    }
    text
}

/// What was predicted over windows, with its title.
pub(super) fn windows(found: &Identification) -> Vec<(&'static str, &[WindowErrors])> {
    let both = [
        ("Parts of the recordings, predicted with numbers from the other parts", found.left_out.as_slice()),
        ("Recordings that were not used", found.predicted.as_slice()),
    ];
    both.into_iter().filter(|(_, errors)| !errors.is_empty()).collect()
}

/// Channel, window, and errors in percent with the old file and the new numbers.
pub(super) fn window_rows(errors: &WindowErrors) -> Vec<[String; 4]> {
    let row = |channel: &ChannelError| {
        let percent = |percent: f64| match percent.is_finite() {
            true => significant(percent, 3),
            false => DIVERGES.to_owned(),
        };
        let [file, found] = channel.percent().map(percent);
        [channel.name.clone(), format!("{} s", errors.window_s), file, found]
    };
    errors.channels.iter().map(row).collect()
}

fn fits(text: &mut String, found: &Identification) {
    let _ = writeln!(
        text,
        "\n  {:<10}{:>22}{:>26}{:>14}",
        "channel", "innovation variance", "error over 0.5 s: file", "found"
    );
    for channel in &found.channels {
        let [old, new] = channel.held_out.map(|error| error_text(channel.channel, error));
        let variance = variance_text(channel);
        let _ = writeln!(text, "  {:<10}{variance:>22}{old:>26}{new:>14}", channel.name);
    }
}

fn error_text(channel: usize, error: f64) -> String {
    match channel {
        _ if !error.is_finite() => DIVERGES.to_owned(),
        0 => format!("{} mm", significant(1e3 * error, 3)),
        _ => format!("{}°", significant(error.to_degrees(), 3)),
    }
}

/// Variance of the innovations of a channel.
pub(super) fn variance_text(channel: &ChannelFit) -> String {
    match channel.innovation_variance.is_finite() {
        true => format!("{:.2}", channel.innovation_variance),
        false => DIVERGES.to_owned(),
    }
}

fn row(found: &Identification, estimate: &Estimate) -> String {
    let [name, file, found, deviation, change, unit, held] = row_texts(found, estimate);
    let held = if held.is_empty() { held } else { format!(", {held}") };
    format!("  {name:<32}{file:>13}{found:>13}{deviation:>12}{change:>9}  {unit}{held}")
}

/// Name, value of the file, value found, its deviation, change over deviation, unit, and a remark if the prior
/// dominates.
pub(super) fn row_texts(found: &Identification, estimate: &Estimate) -> [String; 7] {
    let (name, unit) = estimate.kind.name_and_unit();
    if found.refusal.is_some() && !estimate.is_possible() {
        let [found, none] = ["impossible".to_owned(), String::new()];
        return [
            name,
            significant(estimate.old, 5),
            found,
            none.clone(),
            none,
            unit.to_owned(),
            String::new(),
        ];
    }
    [
        name,
        significant(estimate.old, 5),
        significant(estimate.new, 5),
        significant(estimate.deviation, 2),
        format!("{:.1}", (estimate.new - estimate.old) / estimate.deviation),
        unit.to_owned(),
        if estimate.held_by_prior { "held by the prior".to_owned() } else { String::new() },
    ]
}

/// What fixes the scale of masses and frictions.
fn scale_note(found: &Identification, settings: &Settings) -> String {
    match settings.weighed_kg_m {
        Some(moment) => format!(
            "Masses and frictions in the new file are scaled to the weighed {} kg·m of the last link{}.",
            significant(moment, 4),
            if found.is_moved { "" } else { ", and resistance_ohm with them" }
        ),
        None if found.is_moved => {
            "The drive moves the cart whatever force that takes: the cart's mass and friction are not seen and stay as in the \
             file, and a common factor of all other masses, moments and frictions changes no motion. The first moment of the last \
             link is that of the file, and the deviations are those of ratios to it. One weighing of the last link gives true \
             kilograms (--weigh)."
                .to_owned()
        }
        None if !found.is_driven => {
            "Without a drive, a common factor of all masses, moments and frictions changes no motion: the first moment of the last \
             link is that of the file, and the deviations are those of ratios to it. One weighing of the last link gives true \
             kilograms (--weigh)."
                .to_owned()
        }
        None => {
            "The scale of the force is taken from the file: masses, moments and frictions are in its newtons, and a common factor \
             of all of them changes no motion. One weighing of the last link gives true kilograms (--weigh)."
                .to_owned()
        }
    }
}

/// How far the links' zeros are off.
fn zeros_note(found: &Identification) -> String {
    let zeros = found.estimates.iter().filter(|estimate| matches!(estimate.kind, ParameterKind::Zero(_)));
    let worst = zeros.map(|zero| zero.new.abs()).fold(0.0, f64::max);
    format!(
        "The zeros of the links are off by up to {:.2}°. This belongs to this homing and is not in the file.",
        worst.to_degrees()
    )
}

/// Whether the recordings that were not used are predicted.
fn unused_note(found: &Identification) -> Option<String> {
    let percents = found.predicted.iter().flat_map(|errors| &errors.channels).map(|one| one.percent()[1]);
    let most = percents.fold(0.0, f64::max);
    let is_doubted = found.doubts.iter().any(|doubt| matches!(doubt, Doubt::Unpredicted { .. }));
    (!found.predicted.is_empty() && !is_doubted).then(|| {
        format!(
            "The recordings that were not used are predicted: no window is off by more than {} % of the motion (rms).",
            significant(most, 2)
        )
    })
}

/// What a reader has to know to judge the numbers.
pub(super) fn notes(found: &Identification, settings: &Settings) -> Vec<String> {
    let doubts = found.doubts.iter().map(|doubt| match doubt.needs_trust() {
        true => format!("Doubt: {doubt}"),
        false => doubt.to_string(),
    });
    // The others are of numbers that are written.
    if found.refusal.is_some() {
        return doubts.chain(row_notes(found)).collect();
    }
    let mut notes = vec![scale_note(found, settings)];
    notes.extend(doubts);
    notes.extend(row_notes(found));
    notes.extend(unused_note(found));
    notes.push(
        "Single masses cannot be seen from outside: the new file keeps those of the old one where it can, and centres and \
         inertias follow."
            .to_owned(),
    );
    if !settings.eccentricity && found.estimate(ParameterKind::EccentricSine(0)).is_none() {
        notes.push(format!(
            "Encoders are assumed to be centred: 0.1° of eccentricity alone changes lengths and moments by {:.1} %, whatever the \
             deviations say. --eccentricity identifies it.",
            100.0 * WITHOUT_ECCENTRICITY
        ));
    }
    if found.is_driven && found.channels.iter().filter(|fit| fit.channel > 0).count() > 2 {
        notes.push(
            "With three links or more it is not known whether dry friction is larger at rest than in motion. If it is, frictions \
             may be wrong by more than their deviations."
                .to_owned(),
        );
    }
    if found.largest_angle_rad < LARGE_ENOUGH_RAD {
        notes.push(format!(
            "The links came only {:.0}° from hanging: shake more; the scale is twenty times better known at 60° than at 10°.",
            found.largest_angle_rad.to_degrees()
        ));
    }
    notes.extend(delay_note(found));
    notes.push(zeros_note(found));
    notes.push(format!(
        "A log four times as long halves the deviations, as far as the friction model allows; this log had {:.0} s.",
        found.seconds
    ));
    notes
}

/// How late the force is.
fn delay_note(found: &Identification) -> Option<String> {
    let estimate = found.estimate(ParameterKind::Delay)?;
    Some(match found.other_delay() {
        _ if found.late_ticks != 0 => late_note(found, estimate),
        Some(delay) => format!(
            "The force comes {:.2} ticks later than delay_ticks: set delay_ticks = {delay}; the new file has it.",
            estimate.new
        ),
        None => format!("delay_ticks stays: the force comes {:.2} ticks later than that.", estimate.new),
    })
}

/// What fewer or uneven rows cost.
fn row_notes(found: &Identification) -> Vec<String> {
    let Some(rows) = &found.rows else { return Vec::new() };
    let mut notes = vec![
        "No recording shows whether its times are right: with times twice as long, second moments are found four times as large, \
         and all else fits. Compare them with a clock."
            .to_owned(),
    ];
    if rows.costs() > DEAR {
        notes.push(format!(
            "Rows every {} ms instead of every 2 ms: by the Cramér–Rao bound, they make the deviations up to {:.1} times as large (the \
             fastest mode of the hanging links has a period of {:.0} ms).",
            significant(1e3 * rows.period_s, 3),
            rows.costs(),
            1e3 * rows.fastest_s
        ));
    }
    if rows.uneven_s > 0.0 || found.lost_ticks > 0 {
        notes.push(format!(
            "The rows are off even times by {} ms (rms) and {} are missing: values are interpolated. If only the times are uneven, \
             not the measurements, they look like errors of the angles.",
            significant(1e3 * rows.uneven_s, 2),
            found.lost_ticks
        ));
    }
    notes
}

/// A drive that is whole ticks late.
fn late_note(found: &Identification, delay: &Estimate) -> String {
    let (unit, remedy) = match found.rows {
        Some(_) => ("rows", "as if its column was recorded that much earlier; the numbers allow for it"),
        None => {
            ("ticks", "and delay_ticks is at most 1: look for what delays it, or state it as driver_lag_s")
        }
    };
    let (by, when) = (significant(delay.new.abs(), 3), if delay.new > 0.0 { "later" } else { "earlier" });
    format!("The force comes {by} {unit} {when} than the file says, {remedy}.")
}

/// The identification as a JSON object.
pub fn json(rig: &str, found: &Identification) -> Value {
    let estimates: Vec<Value> = found
        .estimates
        .iter()
        .map(|estimate| {
            let (name, unit) = estimate.kind.name_and_unit();
            json!({
                "name": name, "unit": unit, "file": estimate.old,
                "found": (found.refusal.is_none() || estimate.is_possible()).then_some(estimate.new),
                "deviation": estimate.deviation, "halves": estimate.halves, "held_by_prior": estimate.held_by_prior,
            })
        })
        .collect();
    let channels: Vec<Value> = found
        .channels
        .iter()
        .map(|channel| {
            json!({
                "name": channel.name, "innovation_variance": channel.innovation_variance,
                "error_file": channel.held_out[0], "error_found": channel.held_out[1], "range": channel.range,
            })
        })
        .collect();
    let wiring = found.wiring.as_ref().map(|wiring| {
        json!({
            "best": wiring.best.to_string(), "second": wiring.second.to_string(), "as_in_file": wiring.is_as_in_file(), "margin": wiring.margin,
            "file_is_worse_by": wiring.file_is_worse_by,
        })
    });
    json!({
        "rig": rig, "seconds": found.seconds, "lost_ticks": found.lost_ticks,
        "rows": found.rows.map(|rows| json!({
            "period_s": rows.period_s, "uneven_s": rows.uneven_s, "fastest_mode_s": rows.fastest_s, "deviations_times": rows.costs(),
        })),
        "largest_angle_rad": found.largest_angle_rad, "wiring": wiring, "estimates": estimates,
        "is_driven": found.is_driven, "is_moved": found.is_moved, "left_out": windows_json(&found.left_out), "predicted": windows_json(&found.predicted),
        "channels": channels, "delay_ticks": found.other_delay().unwrap_or(found.delay_ticks),
        "doubts": found.doubts.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "doubted": found.doubted().map(ToString::to_string),
        "refused": found.refusal.as_ref().map(ToString::to_string),
    })
}

fn windows_json(errors: &[WindowErrors]) -> Vec<Value> {
    let one = |errors: &WindowErrors| {
        let channel = |channel: &ChannelError| {
            let [file, found] = channel.percent();
            json!({
                "name": channel.name, "range": channel.range, "sensor_error": channel.sensor_error, "error_file": channel.errors[0], "error_found": channel.errors[1],
                "percent_file": file, "percent_found": found,
            })
        };
        json!({ "window_s": errors.window_s, "channels": errors.channels.iter().map(channel).collect::<Vec<_>>() })
    };
    errors.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use upright_identify::Refusal;

    use super::*;

    #[test]
    fn a_number_that_no_machine_has_is_not_printed_with_a_refusal() {
        let estimate =
            |kind, new| Estimate { kind, old: 0.7, new, deviation: 0.1, halves: None, held_by_prior: false };
        let mut found = Identification {
            estimates: vec![
                estimate(ParameterKind::TotalMass, -1.22),
                estimate(ParameterKind::CartDry, -0.3),
                estimate(ParameterKind::Length(0), f64::NAN),
                estimate(ParameterKind::Tilt, -0.01),
            ],
            refusal: Some(Refusal::Misfit("does not fit".to_owned())),
            ..Identification::default()
        };
        let text = super::text("m", &found, &Settings::default());
        assert_eq!(text.matches("impossible").count(), 3, "{text}");
        assert!(!text.contains("-1.22") && !text.contains("NaN") && text.contains("-0.01"), "{text}");
        assert!(json("m", &found)["estimates"][0]["found"].is_null());
        // The negative control: it is the refusal that hides them.
        found.refusal = None;
        assert!(super::text("m", &found, &Settings::default()).contains("-1.22"));
    }
}
