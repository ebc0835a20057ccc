//! The rig as understood, for reading: every value with its unit, defaults filled in.
//!
//! The derived numbers here are for the eye and computed in f64; no gain depends on them.

use std::f64::consts::TAU;
use std::fmt::Display;

use crate::number::significant;

use super::{
    Actuator, Chain, Kalman, Limits, LinearPlant, Link, LinkEncoder, Lqr, Motor, PlantDescription,
    PolePlacement, Rig, defaults,
};

const DEFAULT: &str = "(default)";

impl Rig {
    /// What the rig file says, in plain text of less than 80 columns: values that equal their default or that were left
    /// out are marked `(default)`.
    pub fn describe(&self) -> String {
        let mut page = Page::default();
        page.heading(&self.name);
        page.note("hash", &format!("{:016x}", self.hash()));
        match &self.plant {
            PlantDescription::Chain(chain) => page.chain(chain),
            PlantDescription::Model(model) => page.model(model),
        }
        page.actuator(&self.actuator);
        page.heading("tick");
        page.value("period", self.tick.period_s, "s", mark(self.tick.period_s == defaults::PERIOD_S));
        page.value("rate", 1.0 / self.tick.period_s, "Hz", "");
        let delay = f64::from(self.tick.delay_ticks);
        page.value("delay", delay, "ticks", mark(self.tick.delay_ticks == defaults::DELAY_TICKS));
        page.design(self);
        page.limits(&self.limits);
        page.text
    }
}

fn mark(is_default: bool) -> &'static str {
    if is_default { DEFAULT } else { "" }
}

/// Six significant digits.
fn digits(x: f64) -> String {
    significant(x, 6)
}

#[derive(Default)]
struct Page {
    text: String,
}

impl Page {
    fn heading(&mut self, title: impl Display) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text.push_str(&format!("{title}\n"));
    }

    fn value(&mut self, name: &str, x: f64, unit: &str, remark: &str) {
        let line = format!("  {name:<26}{:>12} {unit:<12}{remark}", digits(x));
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    fn value_or_none(&mut self, name: &str, x: Option<f64>, unit: &str) {
        match x {
            Some(x) => self.value(name, x, unit, ""),
            None => self.note(name, "none"),
        }
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
        let mass: f64 = chain.cart.mass_kg + chain.links.iter().map(|link| link.mass_kg).sum::<f64>();
        let gravity = chain.gravity_m_per_s2;
        self.value("links on a cart", n as f64, "", "");
        self.value("states", (2 * n + 2) as f64, "", "");
        self.value("total mass", mass, "kg", "");
        self.value("total length", length, "m", "");
        self.value("gravity", gravity, "m/s²", mark(gravity == defaults::GRAVITY_M_PER_S2));

        let cart = &chain.cart;
        self.heading("cart");
        self.value("mass", cart.mass_kg, "kg", "");
        let friction = cart.friction_n_s_per_m;
        self.value("viscous friction", friction, "N·s/m", mark(friction == defaults::FRICTION));
        let [low, high] = cart.travel_m;
        let travel = mark(cart.travel_m == defaults::TRAVEL_M);
        self.value("rail from", low, "m", travel);
        self.value("rail to", high, "m", travel);
        self.value_or_none("encoder step", cart.encoder_step_m, "m");
        for (index, link) in chain.links.iter().enumerate() {
            self.heading(format!("link {}", index + 1));
            self.link(link);
        }
    }

    fn limits(&mut self, limits: &Limits) {
        self.heading("limits");
        self.value_or_none("angle", limits.angle_rad, "rad");
        self.value_or_none("cart speed", limits.speed_m_per_s, "m/s");
        let mut value_or = |name: &str, x: Option<f64>, unit: &str, otherwise: &str| match x {
            Some(x) => self.value(name, x, unit, ""),
            None => self.list(name, [otherwise.to_owned()], DEFAULT),
        };
        value_or("rail margin", limits.rail_margin_m, "m", "2.5 % of the rail");
        value_or("travel tolerance", limits.travel_tolerance_m, "m", "1 % of the rail");
        value_or("least supply", limits.supply_min_v, "V", "80 % of supply_v");
        value_or("begins within", limits.arm_angle_rad, "rad", "a tenth of the angle");
        let usual = Limits::default();
        let mut value =
            |name: &str, x: f64, unit: &str, usual: f64| self.value(name, x, unit, mark(x == usual));
        value("begins below", limits.arm_rate_rad_per_s, "rad/s", usual.arm_rate_rad_per_s);
        value("begins below", limits.arm_speed_m_per_s, "m/s", usual.arm_speed_m_per_s);
        value("begins after", limits.arm_time_s, "s", usual.arm_time_s);
        value("still for homing", limits.still_time_s, "s", usual.still_time_s);
        value("supply too low for", limits.supply_time_s, "s", usual.supply_time_s);
        value("saturated for", limits.saturation_time_s, "s", usual.saturation_time_s);
        value("host silent for", limits.link_timeout_s, "s", usual.link_timeout_s);
        value("false alarm every", limits.false_alarm_h, "h", usual.false_alarm_h);
    }

    fn link(&mut self, link: &Link) {
        let &Link { mass_kg, length_m, .. } = link;
        self.value("mass", mass_kg, "kg", "");
        self.value("length", length_m, "m", "");
        let centre = link.centre_of_mass_m.unwrap_or(length_m / 2.0);
        self.value("centre of mass from joint", centre, "m", mark(link.centre_of_mass_m.is_none()));
        let inertia = link.inertia_kg_m2.unwrap_or(mass_kg * length_m * length_m / 12.0);
        self.value("inertia about it", inertia, "kg·m²", mark(link.inertia_kg_m2.is_none()));
        let friction = link.friction_n_m_s_per_rad;
        self.value("viscous joint friction", friction, "N·m·s/rad", mark(friction == defaults::FRICTION));
        match link.encoder {
            Some(LinkEncoder::StepRad(step)) => self.value("encoder step", step, "rad", ""),
            Some(LinkEncoder::CountsPerRev(counts)) => {
                self.value("encoder step", TAU / counts, "rad", &format!("(2π / {})", digits(counts)));
            }
            None => self.note("encoder step", "none"),
        }
    }

    fn model(&mut self, model: &LinearPlant) {
        self.value("states of a linear model", model.b.len() as f64, "", "");
        self.value("controlled state", model.output as f64, "", mark(model.output == defaults::OUTPUT));
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
        self.value_or_none("force limit", actuator.force_limit_n, "N");
        match &actuator.motor {
            None => self.note("motor", "none"),
            Some(motor) => self.motor(motor),
        }
    }

    fn motor(&mut self, motor: &Motor) {
        let volts_per_speed = motor.volts_per_speed();
        self.value("torque constant", motor.torque_constant_n_m_per_a, "N·m/A", "");
        self.value("winding resistance", motor.resistance_ohm, "Ω", "");
        self.value("gear ratio", motor.gear_ratio, "", mark(motor.gear_ratio == defaults::GEAR_RATIO));
        self.value("pulley radius", motor.pulley_radius_m, "m", "");
        self.value("supply", motor.supply_v, "V", "");
        self.value("dead zone", motor.dead_zone_v, "V", mark(motor.dead_zone_v == defaults::DEAD_ZONE_V));
        self.value_or_none("slew", motor.slew_v_per_s, "V/s");
        self.value("force at standstill", motor.stall_force_n(), "N", "(largest)");
        self.value("speed without load", motor.supply_v / volts_per_speed, "m/s", "(largest)");
        // (gear Kt / r)² / R: back-EMF acts on the cart as viscous friction.
        let braking = volts_per_speed * volts_per_speed / motor.resistance_ohm;
        self.value("braking by back-EMF", braking, "N·s/m", "");
    }

    fn design(&mut self, rig: &Rig) {
        if let Some(Lqr { state_weights, force_weight }) = &rig.lqr {
            self.heading("lqr");
            self.numbers("state weights", state_weights, "");
            self.value("force weight", *force_weight, "", "");
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
                let pole = |&[re, im]: &[f64; 2]| match digits(im.abs()) {
                    _ if im == 0.0 => digits(re),
                    part if im < 0.0 => format!("{}-{part}i", digits(re)),
                    part => format!("{}+{part}i", digits(re)),
                };
                self.list("poles", poles.iter().map(pole), "1/s");
            }
        }
        if let Some(Kalman { force_noise_n2_s, joint_noise }) = &rig.kalman {
            self.heading("kalman");
            self.value("force noise intensity", *force_noise_n2_s, "N²·s", "");
            self.numbers("joint noise intensities", joint_noise, "(N·m)²·s");
        }
        if let Some(integral) = &rig.integral {
            self.heading("integral");
            self.value("position weight", integral.position_weight, "", "");
        }
    }
}
