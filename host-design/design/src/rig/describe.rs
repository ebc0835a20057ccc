//! Readable text of a rig as the program understands it: every value with its unit, defaults filled in.
//!
//! Derived numbers here are for the reader and computed in `f64`; no gain depends on them.

use std::f64::consts::TAU;
use std::fmt::Display;

use upright::boards::parts::PARTS;

use crate::number::significant;

use super::base::Base;
use super::key::{Absent, Key, Section};
use super::sections::actuator::ACTUATOR;
use super::sections::chain::{CART, GRAVITY};
use super::sections::friction::FRICTION;
use super::sections::imperfections::REQUIRED_SIZES;
use super::sections::integral::INTEGRAL;
use super::sections::kalman::KALMAN;
use super::sections::limits::LIMITS;
use super::sections::link::LINK;
use super::sections::reality::REALITY;
use super::sections::robust::ROBUST;
use super::sections::swing_up::SWING_UP;
use super::sections::tick::TICK;
use super::sections::verify::VERIFY;
use super::value::Keys;
use super::{
    Actuator, Chain, ForceDrive, KalmanNoise, LinearPlant, Link, LinkEncoder, Lqr, Motor, PlantDescription,
    PolePlacement, Reality, Rig,
};

const DEFAULT: &str = "(default)";

impl Rig {
    /// The rig's values as plain text, narrower than 80 columns. Values that equal their default or were left out are
    /// marked `(default)`.
    pub fn describe(&self) -> String {
        let is_acceleration = self.actuator.held().is_motion();
        let mut page = Description { is_acceleration, base: self.base(), ..Description::default() };
        page.heading(&self.name);
        page.note("hash", &format!("{:016x}", self.hash()));
        match &self.plant {
            PlantDescription::Chain(chain) => page.chain(chain),
            PlantDescription::Model(model) => page.model(model),
        }
        page.actuator(&self.actuator);
        page.section(&TICK, &self.tick);
        page.value("rate", 1.0 / self.tick.period_s, "Hz", "");
        page.design(self);
        page.section(&LIMITS, &self.limits);
        page.section(&VERIFY, &self.verify);
        let base = page.base;
        for key in REQUIRED_SIZES.iter().filter(|key| base.has(&VERIFY, key.name)) {
            let size = self.must_survive.iter().find(|(imperfection, _)| imperfection.key == key.name);
            page.row(&VERIFY, key, size.map(|&(_, size)| size).as_slice());
        }
        page.reality(&self.reality);
        if let Some(tolerances) = &self.robust {
            page.section(&ROBUST, tolerances);
        }
        if let Some(tolerances) = self.detection_tolerances() {
            page.heading("tolerated by fault detection");
            page.rows(&ROBUST, &tolerances);
        }
        if let Some(rules) = &self.swing_up {
            page.section(&SWING_UP, rules);
        }
        page.text
    }
}

fn mark(is_default: bool) -> &'static str {
    if is_default { DEFAULT } else { "" }
}

/// A pole [re, im].
fn pole(&[re, im]: &[f64; 2]) -> String {
    match digits(im.abs()) {
        _ if im == 0.0 => digits(re),
        part if im < 0.0 => format!("{}-{part}i", digits(re)),
        part => format!("{}+{part}i", digits(re)),
    }
}

/// Six significant digits.
fn digits(x: f64) -> String {
    significant(x, 6)
}

#[derive(Default)]
struct Description {
    text: String,
    /// Whether the drive imposes the cart's acceleration.
    is_acceleration: bool,
    /// What carries the links.
    base: Base,
}

impl Description {
    fn heading(&mut self, title: impl Display) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text.push_str(&format!("{title}\n"));
    }

    fn value(&mut self, name: &str, x: f64, unit: &str, remark: &str) {
        self.line(name, &digits(x), unit, remark);
    }

    /// A section of scalars under its heading.
    fn section<T: Keys>(&mut self, section: &'static Section, values: &T) {
        self.heading(self.base.name("", section.name).replace('_', " "));
        self.rows(section, values);
    }

    fn rows<T: Keys>(&mut self, section: &'static Section, values: &T) {
        let (rows, base) = (T::KEYS.iter().zip(values.values()), self.base);
        for (key, numbers) in rows.filter(|(key, _)| base.has(section, key.name)) {
            self.row(section, key, &numbers);
        }
    }

    /// A key with its numbers or, if it has none, with the default that applies.
    fn row(&mut self, section: &'static Section, key: &Key, numbers: &[f64]) {
        let key = &self.base.key(section, key.name);
        let label = match key.label() {
            label if label.is_empty() => section.name.to_owned(),
            // Only their units tell `stribeck_rad_per_s` and `stribeck_m_per_s` apart.
            label
                if section
                    .keys()
                    .filter(|other| self.base.key(section, other.name).label() == label)
                    .count()
                    > 1 =>
            {
                key.name.replace('_', " ")
            }
            label => label,
        };
        let (numbers, remark) = match key.absent {
            Absent::Numbers(usual) if numbers.is_empty() || numbers == usual => (usual, DEFAULT),
            _ => (numbers, ""),
        };
        match numbers {
            // A key that this rig does not have.
            [] if matches!(key.absent, Absent::Required | Absent::RequiredIf(_)) => {}
            [] => {
                let text = self.base.words(&key.absent.to_string());
                // The text after the semicolon is for other rigs.
                self.list(&label, text.split(';').take(1).map(str::to_owned), DEFAULT);
            }
            [number] => self.value(&label, *number, key.unit, remark),
            _ => {
                let all: Vec<_> = numbers.iter().map(|&x| digits(x)).collect();
                let text = format!("[{}]", all.join(", "));
                self.line(&label, &text, key.unit, remark);
            }
        }
    }

    fn line(&mut self, name: &str, text: &str, unit: &str, remark: &str) {
        let line = format!("  {name:<26}{text:>12} {unit:<12}{remark}");
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    fn note(&mut self, name: &str, note: &str) {
        self.text.push_str(&format!("  {name:<26}{note:>12}\n"));
    }

    /// A list, broken into lines.
    fn list(&mut self, name: &str, entries: impl IntoIterator<Item = String>, unit: &str) {
        const WIDTH: usize = 78;
        let mut line = format!("  {name:<26}");
        for entry in entries {
            if line.chars().count() + 2 + entry.chars().count() > WIDTH {
                self.text.push_str(line.trim_end());
                self.text.push('\n');
                line = " ".repeat(28);
            }
            line.push_str(&format!("{entry}  "));
        }
        if line.chars().count() + unit.chars().count() > WIDTH {
            self.text.push_str(line.trim_end());
            self.text.push('\n');
            line = " ".repeat(28);
        }
        self.text.push_str(format!("{line}{unit}").trim_end());
        self.text.push('\n');
    }

    fn numbers(&mut self, name: &str, numbers: &[f64], unit: &str) {
        self.list(name, numbers.iter().map(|&x| digits(x)), unit);
    }

    fn chain(&mut self, chain: &Chain) {
        let n = chain.links.len();
        let length: f64 = chain.links.iter().map(|link| link.length_m).sum();
        let links_kg = chain.links_mass_kg();
        self.value(
            &format!("links on a{} {}", if self.base.is_cart() { "" } else { "n" }, self.base.noun()),
            n as f64,
            "",
            "",
        );
        self.value("states", (2 * n + 2) as f64, "", "");
        match chain.cart.mass_kg {
            Some(_) => {
                let mass = self.base.mass();
                self.value(&format!("total {}", mass.name), chain.total_mass_kg(), mass.unit, "");
            }
            None => self.value("mass of the links", links_kg, "kg", ""),
        }
        self.value("total length", length, "m", "");
        self.row(&GRAVITY, GRAVITY.key("m_per_s2"), &[chain.gravity_m_per_s2]);
        self.section(&CART, &chain.cart);
        for (index, link) in chain.links.iter().enumerate() {
            self.heading(format!("link {}", index + 1));
            self.link(link);
        }
    }

    fn link(&mut self, link: &Link) {
        let &Link { mass_kg, length_m, .. } = link;
        let centre = link.centre_of_mass_m.unwrap_or(length_m / 2.0);
        let inertia = link.inertia_kg_m2.unwrap_or(mass_kg * length_m * length_m / 12.0);
        let given = |name| LINK.key(name);
        self.row(&LINK, given("mass_kg"), &[mass_kg]);
        self.row(&LINK, given("length_m"), &[length_m]);
        self.value("centre of mass from joint", centre, "m", mark(link.centre_of_mass_m.is_none()));
        self.value("inertia about it", inertia, "kg·m²", mark(link.inertia_kg_m2.is_none()));
        self.row(&LINK, given("friction_n_m_s_per_rad"), &[link.friction_n_m_s_per_rad]);
        if !self.base.is_cart() {
            self.row(&LINK, given("radius_m"), &[link.radius_m]);
            self.row(&LINK, given("axial_inertia_kg_m2"), &[link.axial_inertia_kg_m2]);
        }
        match link.encoder {
            Some(LinkEncoder::StepRad(step)) => self.value("encoder step", step, "rad", ""),
            Some(LinkEncoder::CountsPerRev(counts)) => {
                self.value("encoder step", TAU / counts, "rad", &format!("(2π / {})", digits(counts)));
            }
            Some(LinkEncoder::Absolute { bits, travel_rad, zero_counts, noise_rad }) => {
                self.row(&LINK, given("sensor_bits"), &[f64::from(bits)]);
                if let Some(travel_rad) = travel_rad {
                    self.row(&LINK, given("sensor_travel_rad"), &[travel_rad]);
                }
                self.row(&LINK, given("sensor_zero_counts"), &[f64::from(zero_counts)]);
                self.row(&LINK, given("sensor_noise_rad"), &[noise_rad]);
            }
            None => self.note("encoder step", "none"),
        }
        if let Some(row) = link.part.and_then(|number| PARTS.get(number)) {
            self.note("sensor", row.name);
        }
        if !link.errors.are_none() {
            self.rows(&LINK, &link.errors);
        }
        if link.sensor_delay_s > 0.0 {
            self.row(&LINK, given("sensor_delay_s"), &[link.sensor_delay_s]);
        }
    }

    fn model(&mut self, model: &LinearPlant) {
        self.value("states of a linear model", model.b.len() as f64, "", "");
        self.value("controlled state", model.output as f64, "", mark(model.output == 0));
        let indices = model.measured.iter().map(usize::to_string);
        self.list("measured states", indices, mark(model.measured == [model.output]));
        match &model.measured_steps[..] {
            [] => self.note("sensor steps", "none"),
            steps => self.numbers("sensor steps", steps, ""),
        }
        for (index, row) in model.a.iter().enumerate() {
            self.numbers(&format!("A, row {}", index + 1), row, "");
        }
        self.numbers("B", &model.b, "");
        match &model.noise_input {
            None => self.list("noise enters through", ["B".to_owned()], DEFAULT),
            Some(columns) => {
                for (index, column) in columns.iter().enumerate() {
                    self.numbers(&format!("noise column {}", index + 1), column, "");
                }
            }
        }
    }

    fn actuator(&mut self, actuator: &Actuator) {
        self.heading("actuator");
        match actuator {
            Actuator::Force(force) => {
                self.force_limit(force);
                self.note("motor", "none");
            }
            Actuator::Motor(motor, force) => {
                self.force_limit(force);
                self.motor(motor);
            }
            Actuator::Pulses(drive) => {
                self.note("kind", "acceleration");
                self.rows(&ACTUATOR, drive);
            }
        }
    }

    fn force_limit(&mut self, force: &ForceDrive) {
        self.row(&ACTUATOR, ACTUATOR.key("force_limit_n"), force.limit_n.as_slice());
    }

    fn motor(&mut self, motor: &Motor) {
        self.rows(&ACTUATOR, motor);
        let (force, base) = (self.base.force(), self.base);
        let at_standstill = format!("{} at standstill", force.name);
        self.value(&at_standstill, motor.stall_force_n(), force.unit, "(largest)");
        let without_load = motor.supply_v / motor.volts_per_speed();
        self.value("speed without load", without_load, base.speed().unit, "(largest)");
        self.value("braking by back-EMF", motor.braking_n_s_per_m(), base.damping().unit, "");
    }

    fn reality(&mut self, reality: &Reality) {
        if *reality == Reality::default().on(self.base) {
            return;
        }
        self.section(&REALITY, &reality.friction);
        self.rows(&REALITY, &reality.air_drag);
        self.rows(&REALITY, &reality.drive_train);
        self.rows(&REALITY, &reality.driver);
        self.rows(&REALITY, &reality.step_motor);
        self.rows(&REALITY, &reality.sensors);
        self.rows(&REALITY, &reality.parameters);
    }

    fn lqr(&mut self, lqr: &Lqr) {
        self.heading("lqr");
        match &lqr.mixed_weights[..] {
            [] => self.numbers("state weights", &lqr.state_weights, ""),
            _ => lqr.weight_rows().iter().for_each(|row| self.numbers("state weights", row, "")),
        }
        if !lqr.cross_weights.is_empty() {
            self.numbers("cross weights", &lqr.cross_weights, "");
        }
        let weight = if self.is_acceleration { "acceleration_weight" } else { "force_weight" };
        self.value(&self.base.name("lqr", weight).replace('_', " "), lqr.force_weight, "", "");
        if lqr.angles_are_absolute {
            self.line("angles", "absolute", "", "");
        }
        if lqr.cost_is_sum {
            self.line("cost", "sum", "", "(over the ticks)");
        }
    }

    fn design(&mut self, rig: &Rig) {
        if let Some(lqr) = &rig.lqr {
            self.lqr(lqr);
        }
        match &rig.pole_placement {
            None => {}
            Some(PolePlacement::Response { overshoot_percent, settling_time_s, far_poles }) => {
                self.heading("pole placement");
                self.value("overshoot", *overshoot_percent, "%", "");
                self.value("settling time", *settling_time_s, "s", "");
                self.numbers("far poles", far_poles, "1/s");
            }
            Some(PolePlacement::Poles(poles)) => {
                self.heading("pole placement");
                self.list("poles", poles.iter().map(pole), "1/s");
            }
        }
        if let Some(KalmanNoise { force_noise_n2_s, joint_noise, observer_poles }) = &rig.kalman {
            self.heading("kalman");
            let noise = match self.is_acceleration {
                false => "force_noise_n2_s",
                true => "acceleration_noise_m2_per_s3",
            };
            let key = self.base.key(&KALMAN, noise);
            self.value(&format!("{} intensity", key.label()), *force_noise_n2_s, key.unit, "");
            self.numbers("joint noise intensities", joint_noise, "(N·m)²·s");
            if !observer_poles.is_empty() {
                self.list("observer poles", observer_poles.iter().map(pole), "1/s");
            }
        }
        if let Some(integral) = &rig.integral {
            self.section(&INTEGRAL, integral);
        }
        if let Some(friction) = &rig.friction {
            self.section(&FRICTION, friction);
        }
    }
}
