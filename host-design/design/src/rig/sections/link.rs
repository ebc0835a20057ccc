//! `[[link]]`: one link of a chain, from data sheets and drawings or from measurements of the link alone.

use std::f64::consts::{LN_2, PI, TAU};

use serde::Serialize;
#[cfg(any(doc, test))]
use upright::boards::parts::PARTS;
use upright::boards::parts::{SensorPart, part};

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::{Node, Table};
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use crate::number::significant;

/// `[[link]]`
pub(crate) static LINK: Section = Section {
    name: "link",
    title: "[[link]]",
    meaning: "one table per link, from the cart outwards, 1 to 14 of them",
    absent: Absent::RequiredIf("unless [model]"),
    keys: &[LINK_KEYS, TurnErrors::KEYS],
};

const LINK_KEYS: &[Key] = &[
    Key {
        name: "mass_kg",
        unit: "kg",
        rule: Rule::POSITIVE,
        meaning: "mass of the link",
        absent: Absent::Required,
    },
    Key {
        name: "length_m",
        unit: "m",
        rule: Rule::POSITIVE,
        meaning: "length of the link from its joint to the next one, or to its tip",
        absent: Absent::Required,
    },
    Key {
        name: "centre_of_mass_m",
        unit: "m",
        rule: Rule::POSITIVE.worded("a number > 0, at most 10 times length_m"),
        meaning: "distance from the link's joint to its centre of mass",
        absent: Absent::Follows("half the length"),
    },
    Key {
        name: "inertia_kg_m2",
        unit: "kg·m²",
        rule: Rule::NOT_NEGATIVE,
        meaning: "moment of inertia about the centre of mass (0 for a point mass)",
        absent: Absent::Follows("a uniform rod, mass · length² / 12"),
    },
    Key {
        name: "inertia_about_joint_kg_m2",
        unit: "kg·m²",
        rule: Rule::POSITIVE.worded("a number >= mass · centre of mass²"),
        meaning: "moment of inertia about the link's lower joint",
        absent: Absent::Follows("what inertia_kg_m2 gives"),
    },
    Key {
        name: "tip_mass_kg",
        unit: "kg",
        rule: Rule::POSITIVE,
        meaning: "point mass at length_m, in addition to the link that the keys above describe",
        absent: Absent::Follows("none"),
    },
    Key {
        name: "swing_period_s",
        unit: "s",
        rule: Rule::POSITIVE.worded("a number > 0, longer than that of a point mass at the centre of mass"),
        meaning: "period of small swings of this link alone, hanging from its joint, with its tip mass",
        absent: Absent::Follows("what inertia_kg_m2 gives"),
    },
    Key {
        name: "friction_n_m_s_per_rad",
        unit: "N·m·s/rad",
        rule: Rule::NOT_NEGATIVE,
        meaning: "viscous friction in the link's lower joint",
        absent: Absent::Numbers(&[0.0]),
    },
    Key {
        name: "swing_half_life_s",
        unit: "s",
        rule: Rule::POSITIVE,
        meaning: "time in which the amplitude of these swings falls to half",
        absent: Absent::Follows("what friction_n_m_s_per_rad gives"),
    },
    Key {
        name: "radius_m",
        unit: "m",
        rule: Rule::POSITIVE,
        meaning: "distance from an arm's axis to the plane in which the link turns",
        absent: Absent::Follows("radius_m of [arm]"),
    },
    Key {
        name: "axial_inertia_kg_m2",
        unit: "kg·m²",
        rule: Rule::NOT_NEGATIVE.worded("a number >= 0, at most twice inertia_kg_m2"),
        meaning: "moment of inertia of a thick link about its own length, which turns only with an arm",
        absent: Absent::Numbers(&[0.0]),
    },
    Key {
        name: "encoder_step_rad",
        unit: "rad",
        rule: Rule::ANGLE,
        meaning: "angle per encoder count",
        absent: Absent::Follows("what encoder_counts_per_rev gives"),
    },
    Key {
        name: "encoder_counts_per_rev",
        unit: "counts/rev",
        rule: Rule::COUNTS,
        meaning: "resolution of the encoder after quadrature (four counts per line)",
        absent: Absent::Follows("what encoder_step_rad gives; neither, no encoder"),
    },
    Key {
        name: "sensor",
        unit: "",
        rule: Rule::checked_by_its_section("\"as5047\", \"as5600\", \"mt6701\" or \"as5048b\""),
        meaning: "an absolute sensor that boards know by its name; it gives sensor_bits, noise and delay",
        absent: Absent::Follows("none"),
    },
    Key {
        name: "sensor_bits",
        unit: "bits",
        rule: Rule::BITS,
        meaning: "resolution of an absolute sensor, instead of an encoder; the upper 16 are used",
        absent: Absent::Follows("no absolute sensor, or that of sensor"),
    },
    Key {
        name: "sensor_travel_rad",
        unit: "rad",
        rule: Rule::TRAVEL,
        meaning: "angle over which a potentiometer reads from 0 to 2^sensor_bits; 1/64 at each end is not used",
        absent: Absent::Follows("a whole turn: a magnetic sensor"),
    },
    Key {
        name: "sensor_zero_counts",
        unit: "counts",
        rule: Rule::WHOLE.worded("a whole number from 0 to below 2^sensor_bits"),
        meaning: "reading of this sensor while the links hang at rest",
        absent: Absent::Numbers(&[0.0]),
    },
    Key {
        name: "sensor_noise_rad",
        unit: "rad",
        rule: Rule::NOISE,
        meaning: "noise of this sensor besides the rounding to its bits, root mean square; a tenth of it or more is real, or a link at rest \
                  is taken for a frozen sensor",
        absent: Absent::Follows("0, or that of sensor"),
    },
    Key {
        name: "sensor_delay_s",
        unit: "s",
        rule: Rule::NOT_NEGATIVE.worded("a number >= 0, with an encoder or sensor"),
        meaning: "age of the reading of encoder or sensor at the tick, by its own filter and its bus; made up for",
        absent: Absent::Follows("0, or that of sensor"),
    },
];

const WITH_A_PART: Rule = Rule::NOT_NEGATIVE.worded("a number >= 0, with sensor");
const PHASE_WITH_A_PART: Rule = Rule::SIGNED_ANGLE.worded("a number from -pi to pi (rad), with sensor");

keys! {
    /// Known errors of an absolute sensor, which the firmware takes out: `a sin(θ + p)` and `b sin(2 θ + q)` at the
    /// joint's angle θ.
    #[derive(Copy, Default)]
    pub struct TurnErrors {
        sensor_once_per_turn_rad: f64, "rad", WITH_A_PART,
            "amplitude of this sensor's error once per turn, which is taken out", Absent::Numbers(&[0.0]);
        sensor_once_per_turn_phase_rad: f64, "rad", PHASE_WITH_A_PART,
            "phase of that error when the joint is straight", Absent::Numbers(&[0.0]);
        sensor_twice_per_turn_rad: f64, "rad", WITH_A_PART,
            "amplitude of this sensor's error twice per turn, which is taken out", Absent::Numbers(&[0.0]);
        sensor_twice_per_turn_phase_rad: f64, "rad", PHASE_WITH_A_PART,
            "phase of that error when the joint is straight", Absent::Numbers(&[0.0]);
    }
}

impl TurnErrors {
    /// Amplitude and phase of the error once per turn, and of that twice per turn.
    pub fn harmonics(&self) -> [[f64; 2]; 2] {
        [
            [self.sensor_once_per_turn_rad, self.sensor_once_per_turn_phase_rad],
            [self.sensor_twice_per_turn_rad, self.sensor_twice_per_turn_phase_rad],
        ]
    }

    /// Whether there are none.
    pub fn are_none(&self) -> bool {
        self.sensor_once_per_turn_rad == 0.0 && self.sensor_twice_per_turn_rad == 0.0
    }
}

/// One link of a chain, `[[link]]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Link {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Distance from this link's joint to the next one (m).
    pub length_m: f64,
    /// Distance from the joint to the centre of mass (m); half the length if not given.
    pub centre_of_mass_m: Option<f64>,
    /// Moment of inertia about the centre of mass (kg·m²); that of a uniform rod, m l²/12, if not given.
    pub inertia_kg_m2: Option<f64>,
    /// Viscous friction in the lower joint, on the relative rate (N·m·s/rad).
    pub friction_n_m_s_per_rad: f64,
    /// Resolution of the joint's encoder.
    pub encoder: Option<LinkEncoder>,
    /// Age of its reading at the tick (s).
    #[serde(skip_serializing_if = "is_zero")]
    pub sensor_delay_s: f64,
    /// Distance of its plane from an arm's axis (m); 0 on a cart.
    #[serde(skip_serializing_if = "is_zero")]
    pub radius_m: f64,
    /// Moment of inertia about its own length (kg·m²), which turns only with an arm.
    #[serde(skip_serializing_if = "is_zero")]
    pub axial_inertia_kg_m2: f64,
    /// Number of the part that is its absolute sensor, in [`PARTS`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<usize>,
    /// Errors of that sensor.
    #[serde(skip_serializing_if = "TurnErrors::are_none")]
    pub errors: TurnErrors,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
pub(super) fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// Resolution of a joint encoder, in the form that the file gives.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum LinkEncoder {
    /// `encoder_step_rad`: angle per count (rad).
    StepRad(f64),
    /// `encoder_counts_per_rev`: counts per revolution; the step is 2π / counts (rad).
    CountsPerRev(f64),
    /// `sensor_bits`: an absolute sensor.
    Absolute {
        /// Bits per turn, or of a potentiometer.
        bits: u8,
        /// `sensor_travel_rad`: angle that a potentiometer reads (rad); none for a sensor that reads a whole turn.
        #[serde(skip_serializing_if = "Option::is_none")]
        travel_rad: Option<f64>,
        /// `sensor_zero_counts`: reading while the links hang (counts).
        zero_counts: u32,
        /// `sensor_noise_rad`: noise besides rounding (rad, root mean square).
        noise_rad: f64,
    },
}

/// Keys of measurements of a link, which become the fields of [`Link`] when a file is read. A program that writes those
/// fields into a rig file takes these keys out.
pub const MEASUREMENTS_OF_A_LINK: [&str; 4] =
    ["inertia_about_joint_kg_m2", "tip_mass_kg", "swing_period_s", "swing_half_life_s"];

/// Angle that a potentiometer reads beside hanging and beside upright, at least (rad).
const BESIDE_RAD: f64 = 0.2;

/// Reads one `[[link]]`; the lowest one turns half a turn from hanging to upright.
/// `radius_m` is that of its arm.
pub(super) fn link(
    node: &Node<'_>,
    gravity_m_per_s2: f64,
    is_lowest: bool,
    radius_m: Option<f64>,
) -> Result<Link, RigError> {
    const ONE_INERTIA: &str = "keep the one that you measured";
    let table = node.table(&LINK)?;
    table.not_both("inertia_kg_m2", "inertia_about_joint_kg_m2", ONE_INERTIA)?;
    table.not_both("inertia_kg_m2", "swing_period_s", ONE_INERTIA)?;
    table.not_both("inertia_about_joint_kg_m2", "swing_period_s", ONE_INERTIA)?;
    table.not_both("friction_n_m_s_per_rad", "swing_half_life_s", "keep the one that you measured")?;
    let named = named_part(&table)?;
    let row = named.map(|(_, row)| row);
    let length_m = table.value("length_m")?;
    let centre_of_mass_m = table.value("centre_of_mass_m")?;
    within_reach(&table, centre_of_mass_m, length_m)?;
    let mut link = Link {
        mass_kg: table.value("mass_kg")?,
        length_m,
        centre_of_mass_m,
        inertia_kg_m2: table.value("inertia_kg_m2")?,
        friction_n_m_s_per_rad: table.value("friction_n_m_s_per_rad")?,
        encoder: link_encoder(&table, row, is_lowest)?,
        sensor_delay_s: given_or(&table, "sensor_delay_s", row.map(|row| row.delay_s))?,
        part: named.map(|(number, _)| number),
        errors: TurnErrors::read(&table)?,
        radius_m: table.value::<Option<f64>>("radius_m")?.or(radius_m).unwrap_or_default(),
        axial_inertia_kg_m2: axial_inertia(&table)?,
    };
    if let (None, Some(key)) = (row, TurnErrors::KEYS.iter().find(|key| table.get(key.name).is_some())) {
        return Err(table
            .required(key.name)?
            .out_of_range("only with sensor", "name the part, or leave it out"));
    }
    if let (None, Some(node)) = (link.encoder, table.get("sensor_delay_s")) {
        return Err(
            node.out_of_range("only with an encoder or sensor", "describe it, or leave sensor_delay_s out")
        );
    }
    if let Some(about_joint) = table.value("inertia_about_joint_kg_m2")? {
        link.set_inertia_about_joint(&table, "inertia_about_joint_kg_m2", about_joint, |least| least)?;
    }
    if let Some(tip_mass_kg) = table.value("tip_mass_kg")? {
        link.add_tip_mass(tip_mass_kg);
    }
    link.take_swing(&table, gravity_m_per_s2)?;
    Ok(link)
}

/// No body has a moment of inertia that is larger than the sum of the other two.
fn axial_inertia(table: &Table<'_>) -> Result<f64, RigError> {
    let axial: f64 = table.value("axial_inertia_kg_m2")?;
    match (table.get("axial_inertia_kg_m2"), table.value::<Option<f64>>("inertia_kg_m2")?) {
        (Some(node), Some(across)) if axial > 2.0 * across => {
            let key = table.key("axial_inertia_kg_m2");
            Err(node.out_of_range(key.rule.accepts, "give the smaller one of its moments of inertia"))
        }
        _ => Ok(axial),
    }
}

impl Link {
    /// Distance from the joint to the centre of mass (m), half the length if not given.
    pub fn centre_m(&self) -> f64 {
        self.centre_of_mass_m.unwrap_or(0.5 * self.length_m)
    }

    /// Makes mass, length and inertia other ones by these factors. A given centre of mass moves with the length; the
    /// inertia scales with m l², too.
    pub fn scale(&mut self, mass: f64, length: f64, inertia: f64) {
        let uniform = self.mass_kg * self.length_m * self.length_m / 12.0;
        self.inertia_kg_m2 = Some(inertia * mass * length * length * self.inertia_kg_m2.unwrap_or(uniform));
        self.axial_inertia_kg_m2 *= mass;
        self.mass_kg *= mass;
        self.length_m *= length;
        self.centre_of_mass_m = self.centre_of_mass_m.map(|centre| centre * length);
    }

    /// Moment of inertia about the joint (kg·m²), `J + m c²`.
    fn inertia_about_joint_kg_m2(&self) -> f64 {
        let about_centre = self.inertia_kg_m2.unwrap_or(self.mass_kg * self.length_m.powi(2) / 12.0);
        about_centre + self.mass_kg * self.centre_m().powi(2)
    }

    /// The inertia about the centre of mass, `J - m c²`, from the one about the joint, which `key` gives. `in_key`
    /// turns the least inertia about the joint into the least value of the key.
    fn set_inertia_about_joint(
        &mut self,
        table: &Table<'_>,
        key: &str,
        about_joint: f64,
        in_key: impl Fn(f64) -> f64,
    ) -> Result<(), RigError> {
        let of_a_point = self.mass_kg * self.centre_m().powi(2);
        if about_joint < of_a_point {
            let accepts = format!(
                "a number >= {}, as for a point mass at the centre of mass",
                significant(in_key(of_a_point), 6)
            );
            let remedy =
                "measure again, or correct mass_kg and centre_of_mass_m (half of length_m if left out)";
            return Err(table.required(key)?.out_of_range(&accepts, remedy));
        }
        self.inertia_kg_m2 = Some(about_joint - of_a_point);
        Ok(())
    }

    /// Adds a point mass at the end of the link: masses and first moments about the joint add up, and so do the
    /// inertias about the joint.
    fn add_tip_mass(&mut self, tip_mass_kg: f64) {
        let about_joint = self.inertia_about_joint_kg_m2() + tip_mass_kg * self.length_m.powi(2);
        let mass_kg = self.mass_kg + tip_mass_kg;
        let centre_m = (self.mass_kg * self.centre_m() + tip_mass_kg * self.length_m) / mass_kg;
        self.mass_kg = mass_kg;
        self.centre_of_mass_m = Some(centre_m);
        // Rounding must not make it negative for a point mass at the end of a massless rod.
        self.inertia_kg_m2 = Some((about_joint - mass_kg * centre_m.powi(2)).max(0.0));
    }

    /// Inertia and friction from small swings `J θ̈ + b θ̇ + m g c θ = 0` about the joint: the amplitude decays with
    /// `σ = b / (2 J) = ln 2 / half-life`, and `(2π / period)² = m g c / J - σ²`.
    fn take_swing(&mut self, table: &Table<'_>, gravity_m_per_s2: f64) -> Result<(), RigError> {
        let half_life_s: Option<f64> = table.value("swing_half_life_s")?;
        let decay_per_s = half_life_s.map_or(0.0, |half_life_s| LN_2 / half_life_s);
        if let Some(period_s) = table.value::<Option<f64>>("swing_period_s")? {
            let stiffness = self.mass_kg * gravity_m_per_s2 * self.centre_m();
            let about_joint = stiffness / ((TAU / period_s).powi(2) + decay_per_s.powi(2));
            let period_of = |about_joint: f64| TAU / (stiffness / about_joint - decay_per_s.powi(2)).sqrt();
            self.set_inertia_about_joint(table, "swing_period_s", about_joint, period_of)?;
        }
        if half_life_s.is_some() {
            self.friction_n_m_s_per_rad = 2.0 * decay_per_s * self.inertia_about_joint_kg_m2();
        }
        Ok(())
    }
}

/// The centre of mass may lie beyond the next joint (a link with an extension), but not far beyond.
fn within_reach(table: &Table<'_>, centre_of_mass_m: Option<f64>, length_m: f64) -> Result<(), RigError> {
    let most = 10.0 * length_m;
    match (table.get("centre_of_mass_m"), centre_of_mass_m) {
        (Some(node), Some(distance)) if distance > most => Err(node.out_of_range(
            &format!("a number > 0 and <= 10 times length_m, {most} (m)"),
            "give the distance from the joint to the centre of mass in m, or correct length_m",
        )),
        _ => Ok(()),
    }
}

/// The part that the file names, with its number.
fn named_part(table: &Table<'_>) -> Result<Option<(usize, &'static SensorPart)>, RigError> {
    let Some(node) = table.get("sensor") else { return Ok(None) };
    for other in ["encoder_step_rad", "encoder_counts_per_rev", "sensor_travel_rad"] {
        table.not_both("sensor", other, "keep the one that the board reads")?;
    }
    let key = LINK.key("sensor");
    let named = part(node.text(key.rule.accepts, key.meaning)?);
    let Some((number, row)) = named else {
        let remedy = "name the part, or describe it by sensor_bits, sensor_noise_rad and sensor_delay_s";
        return Err(node.out_of_range(key.rule.accepts, remedy));
    };
    match table.get("sensor_bits") {
        Some(bits) if table.value::<Option<f64>>("sensor_bits")? != Some(row.bits.into()) => {
            Err(bits.out_of_range(&format!("{} with sensor = \"{}\"", row.bits, row.name), "leave it out"))
        }
        _ => Ok(Some((number, row))),
    }
}

/// A number of the file, or that of the part, or 0.
fn given_or(table: &Table<'_>, key: &str, of_part: Option<f64>) -> Result<f64, RigError> {
    Ok(table.value::<Option<f64>>(key)?.or(of_part).unwrap_or_default())
}

fn link_encoder(
    table: &Table<'_>,
    row: Option<&SensorPart>,
    is_lowest: bool,
) -> Result<Option<LinkEncoder>, RigError> {
    table.not_both("encoder_step_rad", "encoder_counts_per_rev", "keep the one the data sheet gives")?;
    table.not_both("encoder_step_rad", "sensor_bits", "keep the one that the board reads")?;
    table.not_both("encoder_counts_per_rev", "sensor_bits", "keep the one that the board reads")?;
    if let Some(absolute) = absolute_sensor(table, row, is_lowest)? {
        return Ok(Some(absolute));
    }
    let step: Option<f64> = table.value("encoder_step_rad")?;
    let counts: Option<f64> = table.value("encoder_counts_per_rev")?;
    Ok(step.map(LinkEncoder::StepRad).or(counts.map(LinkEncoder::CountsPerRev)))
}

fn absolute_sensor(
    table: &Table<'_>,
    row: Option<&SensorPart>,
    is_lowest: bool,
) -> Result<Option<LinkEncoder>, RigError> {
    let given: Option<f64> = table.value("sensor_bits")?;
    let Some(bits) = given.or(row.map(|row| row.bits.into())) else {
        let needs_bits = ["sensor_travel_rad", "sensor_zero_counts", "sensor_noise_rad"]
            .iter()
            .any(|key| table.get(key).is_some());
        return match needs_bits {
            true => Err(table.missing("sensor_bits", "the bits per turn of the absolute sensor")),
            false => Ok(None),
        };
    };
    let zero_counts: f64 = table.value("sensor_zero_counts")?;
    let turn = bits.exp2();
    if zero_counts >= turn {
        let accepts = format!("a whole number from 0 to {}", turn - 1.0);
        let remedy = "give what the sensor reads while the links hang, or correct sensor_bits";
        return Err(table.required("sensor_zero_counts")?.out_of_range(&accepts, remedy));
    }
    let travel_rad = table.value("sensor_travel_rad")?;
    let noise_rad = given_or(table, "sensor_noise_rad", row.map(|row| row.noise_rad))?;
    if let Some(travel_rad) = travel_rad {
        within_travel(table, turn, travel_rad, is_lowest)?;
    }
    Ok(Some(LinkEncoder::Absolute {
        bits: bits as u8,
        travel_rad,
        zero_counts: zero_counts as u32,
        noise_rad,
    }))
}

/// A potentiometer has to read where its link hangs and where it is upright, and some way to both sides.
fn within_travel(table: &Table<'_>, range: f64, travel_rad: f64, is_lowest: bool) -> Result<(), RigError> {
    let counts = |angle_rad: f64| (angle_rad * range / travel_rad).ceil();
    let (half, end) = (if is_lowest { counts(PI) } else { 0.0 }, range / 64.0 + counts(BESIDE_RAD));
    let ranges = [[end, range - 1.0 - end - half], [end + half, range - 1.0 - end]];
    let zero: f64 = table.value("sensor_zero_counts")?;
    if ranges.iter().any(|[low, high]| (low..=high).contains(&&zero)) {
        return Ok(());
    }
    let [[a, b], [c, d]] = ranges;
    let accepts = match is_lowest {
        true => format!("a whole number from {a} to {b} or from {c} to {d}"),
        false => format!("a whole number from {a} to {d}"),
    };
    let remedy = "turn the potentiometer so that it reads where the link hangs and where it is upright";
    let needed = "the reading of the potentiometer while the links hang at rest, in counts: at 0 it is in its dead band";
    Err(table.need("sensor_zero_counts", needed)?.out_of_range(&accepts, remedy))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::rig::Rig;

    fn parse(keys: &str) -> Result<Link, RigError> {
        let text =
            format!("name = \"a\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 0.2\nlength_m = 0.5\n{keys}");
        Rig::from_toml(&text, Path::new("rig.toml")).map(|rig| rig.chain().unwrap().links[0].clone())
    }

    fn near(found: f64, wanted: f64) -> bool {
        (found - wanted).abs() < 1e-12 * wanted.abs().max(1e-3)
    }

    #[test]
    fn an_inertia_about_the_joint_is_moved_to_the_centre_of_mass() {
        let link = parse("centre_of_mass_m = 0.3\ninertia_about_joint_kg_m2 = 0.02").unwrap();
        assert!(near(link.inertia_kg_m2.unwrap(), 0.002), "{link:?}");
        let error =
            parse("centre_of_mass_m = 0.3\ninertia_about_joint_kg_m2 = 0.0179").unwrap_err().to_string();
        assert!(
            error.contains(
                ":8:29: link[1].inertia_about_joint_kg_m2: found 0.0179, accepted: a number >= 0.018"
            ),
            "{error}"
        );
    }

    /// A rod of 0.2 kg and 0.5 m with 0.1 kg at its end, about the joint: 0.2 · 0.5²/3 + 0.1 · 0.5².
    #[test]
    fn a_tip_mass_adds_its_mass_moment_and_inertia() {
        let link = parse("tip_mass_kg = 0.1").unwrap();
        assert!(near(link.mass_kg, 0.3) && near(link.centre_of_mass_m.unwrap(), 0.1 / 0.3), "{link:?}");
        let about_joint = link.inertia_kg_m2.unwrap() + link.mass_kg * link.centre_of_mass_m.unwrap().powi(2);
        assert!(near(about_joint, 0.05 / 3.0 + 0.025), "{about_joint}");
    }

    /// The swing of a link whose inertia and friction are known, simulated by its own solution, gives them back.
    #[test]
    fn period_and_half_life_of_a_swing_give_inertia_and_friction() {
        let (mass, centre, inertia, friction): (f64, f64, f64, f64) = (0.2, 0.25, 0.004, 0.003);
        let about_joint = inertia + mass * centre * centre;
        let decay = friction / (2.0 * about_joint);
        let period = TAU / (mass * 9.81 * centre / about_joint - decay * decay).sqrt();
        let swing = format!("swing_period_s = {period}\nswing_half_life_s = {}", LN_2 / decay);
        let link = parse(&swing).unwrap();
        assert!(
            near(link.inertia_kg_m2.unwrap(), inertia) && near(link.friction_n_m_s_per_rad, friction),
            "{link:?}"
        );
        // A tip mass swings with the link: the same period belongs to a larger inertia about the joint.
        let with_tip = parse(&format!("{swing}\ntip_mass_kg = 0.05")).unwrap();
        let grown = with_tip.inertia_about_joint_kg_m2() / link.inertia_about_joint_kg_m2();
        assert!(near(grown, (0.2 * 0.25 + 0.05 * 0.5) / (0.2 * 0.25)), "{grown}");
        let damping = with_tip.friction_n_m_s_per_rad / link.friction_n_m_s_per_rad;
        assert!(near(damping, grown), "{damping}");
    }

    #[test]
    fn a_swing_that_no_such_link_has_is_refused_with_the_shortest_period() {
        // A point mass at 0.25 m: 2π √(0.25 / 9.81) = 1.00303 s.
        assert!(parse("swing_period_s = 1.0031").is_ok());
        let error = parse("swing_period_s = 1.0030").unwrap_err().to_string();
        assert!(
            error.contains("link[1].swing_period_s: found 1.0030, accepted: a number >= 1.00303"),
            "{error}"
        );
        for (first, second) in [
            ("inertia_kg_m2 = 1", "swing_period_s = 2"),
            ("inertia_kg_m2 = 1", "inertia_about_joint_kg_m2 = 2"),
            ("inertia_about_joint_kg_m2 = 1", "swing_period_s = 2"),
            ("friction_n_m_s_per_rad = 1", "swing_half_life_s = 2"),
        ] {
            let error = parse(&format!("{first}\n{second}")).unwrap_err().to_string();
            assert!(error.contains("keep the one that you measured"), "{error}");
        }
    }

    #[test]
    fn a_named_sensor_fills_what_the_file_leaves_out() {
        let link = parse("sensor = \"as5600\"\nsensor_zero_counts = 9").unwrap();
        let row = &PARTS[link.part.unwrap()];
        let wanted =
            LinkEncoder::Absolute { bits: 12, travel_rad: None, zero_counts: 9, noise_rad: row.noise_rad };
        assert_eq!((link.encoder, link.sensor_delay_s), (Some(wanted), row.delay_s));
        let own = parse("sensor = \"as5600\"\nsensor_noise_rad = 0.002\nsensor_delay_s = 0.0004").unwrap();
        assert_eq!(own.sensor_delay_s, 4e-4);
        assert!(matches!(own.encoder, Some(LinkEncoder::Absolute { noise_rad: 0.002, .. })));
        // The rule of the key names each part, and no other.
        let named: Vec<&str> = LINK.key("sensor").rule.accepts.split('"').skip(1).step_by(2).collect();
        assert_eq!(named, PARTS.each_ref().map(|part| part.name));
    }

    #[test]
    fn a_sensor_that_is_not_known_or_contradicts_the_file_is_refused() {
        for (keys, words) in [
            ("sensor = \"as5601\"", "accepted: \"as5047\", \"as5600\""),
            ("sensor = 5600", "link[1].sensor"),
            ("sensor = \"as5600\"\nsensor_bits = 14", "accepted: 12 with sensor = \"as5600\""),
            ("sensor = \"as5600\"\nencoder_counts_per_rev = 4096", "keep the one that the board reads"),
            ("sensor = \"as5600\"\nsensor_travel_rad = 6", "keep the one that the board reads"),
            ("sensor = \"as5600\"\nsensor_zero_counts = 4096", "a whole number from 0 to 4095"),
            ("sensor_bits = 14\nsensor_twice_per_turn_rad = 0.01", "only with sensor"),
            ("sensor_bits = 9", "a whole number from 10 to 18"),
        ] {
            let error = parse(keys).unwrap_err().to_string();
            assert!(error.contains(words), "{keys}: {error}");
        }
        for bits in [10, 11] {
            assert!(parse(&format!("sensor_bits = {bits}\nsensor_zero_counts = 700")).is_ok(), "{bits}");
        }
    }
}
