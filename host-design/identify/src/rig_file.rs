//! The rig file with the identified numbers.

use std::path::Path;

use upright_design::number::rounded;
use upright_design::reality::sum_of_sines;
#[cfg(doc)]
use upright_design::rig::TurnErrors;
use upright_design::rig::{
    MEASUREMENTS_OF_A_LINK, ParameterErrors, PerJoint, Rig, RigError, RigText, SensorErrors,
};

use crate::estimated::Identification;
use crate::parameters::ParameterKind;
use crate::realise::{Realised, RealisedLink};

/// The text of `old` with the identified numbers, with comments and layout as they were, and `note` as first line.
///
/// # Errors
/// [`RigError`] if the result would not be a valid rig file.
pub fn rig_file(
    old: &str,
    rig: &Rig,
    found: &Identification,
    note: &str,
    file: &Path,
) -> Result<String, RigError> {
    let mut text = RigText::parse(old, file)?;
    if let Some(realised) = &found.realised {
        for (key, value) in values(realised, rig, found.is_driven).into_iter().chain(sensors(rig, found)) {
            text.set(&key, &value)?;
        }
        for number in 1..=realised.links.len() {
            for key in MEASUREMENTS_OF_A_LINK {
                text.remove(&format!("link[{number}].{key}"));
            }
        }
    }
    if let Some(delay) = found.other_delay() {
        text.set("tick.delay_ticks", &delay.to_string())?;
    }
    // The identified numbers include the errors of masses and lengths.
    for key in ParameterErrors::percentages().map(|key| format!("reality.{key}")) {
        if text.has(&key) {
            text.set(&key, "0")?;
        }
    }
    let text = format!("# {note}\n{text}");
    Rig::from_toml(&text, file)?;
    Ok(text)
}

/// Keys and values, with six digits: more than the identification knows.
fn values(realised: &Realised, rig: &Rig, is_driven: bool) -> Vec<(String, String)> {
    let number = |value: f64| rounded(value, 6).to_string();
    let mut values = Vec::new();
    if let Some(cart) = realised.cart {
        values.extend([
            ("cart.mass_kg".to_owned(), number(cart.mass_kg)),
            ("cart.friction_n_s_per_m".to_owned(), number(cart.viscous)),
            ("reality.cart_friction_n".to_owned(), number(cart.dry_n)),
        ]);
    }
    values.push(("reality.rail_tilt_rad".to_owned(), number(realised.tilt_rad)));
    for (index, link) in realised.links.iter().enumerate() {
        let key = |name: &str| format!("link[{}].{name}", index + 1);
        values.extend([
            (key("mass_kg"), number(link.mass_kg)),
            (key("length_m"), number(link.length_m)),
            (key("centre_of_mass_m"), number(link.centre_m)),
            (key("inertia_kg_m2"), number(link.inertia_kg_m2)),
            (key("friction_n_m_s_per_rad"), number(link.viscous)),
        ]);
    }
    let mut each = |key: &str, of: fn(&RealisedLink) -> f64| {
        let numbers: Vec<String> = realised.links.iter().map(|link| number(of(link))).collect();
        values.push((format!("reality.{key}"), format!("[{}]", numbers.join(", "))));
    };
    each("joint_friction_n_m", |link| link.dry_n_m);
    each("air_drag_n_m_s2_per_rad2", |link| link.air_drag);
    // Only free swings show this.
    if !is_driven {
        each("presliding_rad", |link| link.presliding_rad);
    }
    if let Some(motor) = rig.actuator.motor() {
        values.push(("actuator.dead_zone_v".to_owned(), number(realised.dead_zone_v)));
        let resistance = motor.resistance_ohm * realised.resistance_factor;
        if realised.resistance_factor != 1.0 {
            values.push(("actuator.resistance_ohm".to_owned(), number(resistance)));
        }
    }
    values
}

/// Keys and values of the sensors: the travel per count, unless the recording has a scale of its own, and the errors
/// once and twice per turn.
fn sensors(rig: &Rig, found: &Identification) -> Vec<(String, String)> {
    let number = |value: f64| rounded(value, 6).to_string();
    let mut values = Vec::new();
    let of = |kind: ParameterKind| found.estimate(kind).map(|estimate| estimate.new);
    let drive = rig.actuator.pulses().map(|drive| ("actuator.step_m", drive.step_m));
    let cart = rig.chain().and_then(|chain| Some(("cart.encoder_step_m", chain.cart.encoder_step_m?)));
    if let (true, Some((key, step_m)), Some(travel)) =
        (found.is_log, drive.or(cart), of(ParameterKind::Travel))
    {
        values.push((key.to_owned(), number(travel * step_m)));
    }
    for harmonic in [&ONCE, &TWICE] {
        values.extend(errors_per_turn(rig, harmonic, &of));
    }
    values
}

/// A key of `[reality]`, and its values.
type RealKey = (&'static str, fn(&SensorErrors) -> &PerJoint);

/// An error of the sensors once or twice per turn.
struct Harmonic {
    /// The parameters that are the parts of it which follow the sine and the cosine.
    parts: [fn(usize) -> ParameterKind; 2],
    /// Amplitude and phase of the simulated machine.
    real: [RealKey; 2],
    /// Keys of those that are taken out of the readings of a part, and its place in [`TurnErrors::harmonics`].
    taken_out: [&'static str; 2],
    place: usize,
}

static ONCE: Harmonic = Harmonic {
    parts: [ParameterKind::EccentricSine, ParameterKind::EccentricCosine],
    real: [
        ("eccentricity_rad", |errors| &errors.eccentricity_rad),
        ("eccentricity_phase_rad", |errors| &errors.eccentricity_phase_rad),
    ],
    taken_out: ["sensor_once_per_turn_rad", "sensor_once_per_turn_phase_rad"],
    place: 0,
};

static TWICE: Harmonic = Harmonic {
    parts: [ParameterKind::TwiceSine, ParameterKind::TwiceCosine],
    real: [
        ("twice_per_turn_rad", |errors| &errors.twice_per_turn_rad),
        ("twice_per_turn_phase_rad", |errors| &errors.twice_per_turn_phase_rad),
    ],
    taken_out: ["sensor_twice_per_turn_rad", "sensor_twice_per_turn_phase_rad"],
    place: 1,
};

/// Keys and values of an error per turn. That of a part is added to what is taken out of its readings, because a log
/// has them without it, and is then none of the simulated machine's.
fn errors_per_turn(
    rig: &Rig,
    harmonic: &Harmonic,
    of: &dyn Fn(ParameterKind) -> Option<f64>,
) -> Vec<(String, String)> {
    let number = |value: f64| rounded(value, 6).to_string();
    let [sine, cosine] = harmonic.parts;
    let polar = |joint: usize| {
        let (sine, cosine) = (of(sine(joint))?, of(cosine(joint))?);
        Some([sine.hypot(cosine), libm::atan2(cosine, sine)])
    };
    let links = rig.chain().map(|chain| chain.links.as_slice()).unwrap_or_default();
    let found: Vec<Option<[f64; 2]>> = (0..links.len()).map(polar).collect();
    let mut values = Vec::new();
    for ((joint, link), found) in links.iter().enumerate().zip(&found) {
        let (Some(_), Some(found)) = (link.part, found) else { continue };
        let all = sum_of_sines(*found, link.errors.harmonics()[harmonic.place]);
        let keys = harmonic.taken_out.iter().zip(all);
        values.extend(keys.map(|(key, value)| (format!("link[{}].{key}", joint + 1), number(value))));
    }
    let is_real = |joint: usize| links[joint].part.is_none();
    // Without any, the file needs no keys for it, unless it has some.
    let is_given = harmonic.real[0].1(&rig.reality.sensors).is_any();
    if !found.iter().enumerate().any(|(joint, found)| found.is_some() && (is_real(joint) || is_given)) {
        return values;
    }
    for (place, (key, file)) in harmonic.real.into_iter().enumerate() {
        let one = |(joint, found): (usize, &Option<[f64; 2]>)| {
            number(match found {
                Some(_) if !is_real(joint) => 0.0,
                Some(found) => found[place],
                None => file(&rig.reality.sensors).of_joint(joint),
            })
        };
        let all: Vec<String> = found.iter().enumerate().map(one).collect();
        values.push((format!("reality.{key}"), format!("[{}]", all.join(", "))));
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::realise::RealisedCart;

    /// An identification that found nothing new.
    const NOTHING: Identification = Identification {
        seconds: 60.0,
        lost_ticks: 0,
        rows: None,
        late_ticks: 0,
        largest_angle_rad: 0.3,
        wiring: None,
        estimates: Vec::new(),
        sample_s: 0.001,
        correlations: Vec::new(),
        channels: Vec::new(),
        realised: None,
        delay_ticks: 0,
        refusal: None,
        is_log: true,
        is_driven: true,
        is_moved: false,
        left_out: Vec::new(),
        doubts: Vec::new(),
        predicted: Vec::new(),
    };

    /// The rig file with the identified numbers, for a rig whose file gives this `[reality]`.
    fn written(reality: &str, before_all: bool) -> String {
        let file: &Path = "../../rigs/single-quanser-ip02.toml".as_ref();
        let text = std::fs::read_to_string(file).unwrap();
        let old = if before_all { reality.to_owned() + &text } else { text + reality };
        let rig = Rig::from_toml(&old, file).unwrap();
        rig_file(&old, &rig, &NOTHING, "identified", file).unwrap()
    }

    /// The identified masses include the stated error, so it must not be applied once more.
    #[test]
    fn an_error_that_the_numbers_include_is_taken_out_however_it_is_written() {
        for (reality, before_all) in [
            ("\n[reality]\ncart_mass_percent = 5\n", false),
            ("\n[reality]\n\"cart_mass_percent\" = 5\n", false),
            ("reality.cart_mass_percent = 5\n", true),
            ("reality = { cart_mass_percent = 5, homing_error_rad = 0.01 } # mine\n", true),
        ] {
            let text = written(reality, before_all);
            let rig = Rig::from_toml(&text, "new.toml".as_ref()).unwrap();
            assert_eq!(rig.reality.parameters.cart_mass_percent, 0.0, "{text}");
            assert_eq!(
                text,
                format!(
                    "# identified\n{}",
                    written(&reality.replace('5', "0"), before_all).split_once('\n').unwrap().1
                )
            );
        }
        assert!(!written("", false).contains("cart_mass_percent"), "what the file leaves out stays out");
    }
    /// A file may give a link by its swing and its tip mass; what was identified includes them.
    #[test]
    fn measurements_of_a_link_give_way_to_the_identified_numbers() {
        let file: &Path = "../../rigs/single-quanser-ip02.toml".as_ref();
        let text = std::fs::read_to_string(file).unwrap();
        let old = text.replace("[[link]]\n", "[[link]]\ntip_mass_kg = 0.1\nswing_half_life_s = 9\n");
        let old: String = old
            .lines()
            .filter(|line| !line.starts_with("friction_n_m_s"))
            .fold(String::new(), |all, line| all + line + "\n");
        let rig = Rig::from_toml(&old, file).unwrap();
        let link = RealisedLink {
            mass_kg: 0.2,
            length_m: 0.5,
            centre_m: 0.3,
            inertia_kg_m2: 0.004,
            viscous: 0.001,
            dry_n_m: 0.0,
            presliding_rad: 1e-3,
            air_drag: 0.0,
        };
        let realised = Realised {
            cart: Some(RealisedCart { mass_kg: 1.0, viscous: 2.0, dry_n: 0.0 }),
            links: vec![link],
            tilt_rad: 0.0,
            dead_zone_v: 0.0,
            resistance_factor: 1.0,
        };
        let found = Identification { realised: Some(realised), ..NOTHING };
        let new = rig_file(&old, &rig, &found, "identified", file).unwrap();
        let new = Rig::from_toml(&new, file).unwrap();
        let link = &new.chain().unwrap().links[0];
        assert_eq!(
            (link.mass_kg, link.centre_of_mass_m, link.friction_n_m_s_per_rad),
            (0.2, Some(0.3), 0.001)
        );
    }
}
