//! What a step of a lab asks for, and the check of an answer by the library: it runs what is claimed.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use upright::table::Law;
use upright_design::design::continuous_plant;
use upright_design::numerics::{Complex, eigenvalues};
use upright_design::rig::{PlantDescription, Rig, RigText};
use upright_design::simulate::{Scenario, Summary, simulate};
use upright_design::table::TableValues;

use crate::changes::differences;
use crate::designed::{DeskDesign, with_gains};
use crate::refusal::{FILE, PageRefusal};
use crate::survival::{LoopSurvival, survival};
use crate::twin::InPage;

/// What is asked for, and when an answer is right. A wrong answer is told without what would be right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum LabTask {
    /// Gains K, one per state, with which the rig survives this lean of its first link.
    Gains {
        /// Lean at the start (rad).
        lean_rad: f64,
    },
    /// The last value of a property that the controller does not know with which it still balances.
    Property {
        /// Its name in the twin.
        property: String,
        /// Unit of the answer, for the page.
        unit: String,
        /// How much further it has to fall.
        step: f64,
    },
    /// The number of the fault with which the firmware turns the motor off after a defect.
    Fault {
        /// The defect.
        defect: String,
        /// At which sensor (0: cart).
        sensor: usize,
    },
    /// A number that the library computes of the student's rig.
    Number {
        /// Which.
        of: LabQuantity,
        /// Unit of the answer, for the page.
        unit: String,
        /// How far it may be off (%).
        tolerance_percent: f64,
    },
    /// The rig, changed until its loop does what is asked for.
    Rig {
        /// Keys that may be changed, or their beginnings.
        may_change: Vec<String>,
        /// What the loop has to do.
        asks: LoopAsks,
    },
}

/// A number of a rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LabQuantity {
    /// The rightmost pole without a controller (1/s).
    OpenPole,
    /// The rightmost pole of the closed loop in continuous time (1/s).
    ClosedPole,
    /// The gain of the first law on the angle of the first link, in continuous time (N/rad).
    AngleGain,
}

/// What a loop has to do: to survive, and what is given.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoopAsks {
    /// Number of links.
    pub links: Option<usize>,
    /// Largest lean of a link (°), at least.
    pub tilt_deg: Option<f64>,
    /// Hardest touch at its end (N), at least.
    pub touch_n: Option<f64>,
    /// Largest force after a step of 0.1 m (N), at most.
    pub at_most_n: Option<f64>,
    /// Time after this step from which it is settled (s), at most.
    pub settles_s: Option<f64>,
    /// Keys of the rig with their largest values.
    pub most: Vec<(String, f64)>,
}

/// Simulated time that the rig has to survive (s).
const SECONDS: u32 = 10;
/// The step of the set-point for the asks (m).
const STEP_M: f64 = 0.1;

impl LabTask {
    /// Marks an answer: whether it is right, and why. `rig` is the rig of the lab, `changed` what the student has made
    /// of it, `answer` the numbers.
    pub(crate) fn marked(&self, rig: &str, changed: &str, answer: &[f64]) -> Result<Value, PageRefusal> {
        let (is_right, why) = match self {
            Self::Gains { lean_rad } => gains(rig, answer, *lean_rad)?,
            Self::Property { property, unit, step } => last_value(rig, answer, property, unit, *step)?,
            Self::Fault { defect, sensor } => {
                let [answer] = numbers(answer)?;
                let defect = json!({ "do": "defect", "name": defect, "sensor": sensor });
                match ended(rig, &defect, 1)?.filter(|&(code, _)| code as f64 == answer) {
                    Some((code, name)) => (true, format!("fault {code}: {name}")),
                    None => (false, "it ends with another fault".to_owned()),
                }
            }
            Self::Number { of, unit, tolerance_percent } => {
                let [answer] = numbers(answer)?;
                let value = of.value(rig)?;
                match (answer - value).abs() <= 0.01 * tolerance_percent * value.abs() {
                    true => (true, format!("the library computes {value:.4} {unit}")),
                    false => (false, format!("{answer} {unit} is more than {tolerance_percent} % off")),
                }
            }
            Self::Rig { may_change, asks } => asks.marked(rig, changed, may_change)?,
        };
        Ok(json!({ "right": is_right, "why": why }))
    }
}

impl LabQuantity {
    fn value(self, toml: &str) -> Result<f64, PageRefusal> {
        let rig = read(toml)?;
        let rightmost =
            |poles: &[Complex<f64>]| poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max);
        if self == Self::OpenPole {
            let plant = continuous_plant::<f64>(&rig)?;
            let poles = eigenvalues(&plant.a).map_err(|_| PageRefusal::Poles)?;
            return Ok(rightmost(&poles));
        }
        let designed = DeskDesign::design(&rig)?;
        match self {
            Self::AngleGain => designed.angle_gain().ok_or(PageRefusal::Law),
            _ => designed.rightmost_pole(&rig)?.ok_or(PageRefusal::Law),
        }
    }
}

impl LoopAsks {
    fn marked(&self, rig: &str, changed: &str, may_change: &[String]) -> Result<(bool, String), PageRefusal> {
        let is_free = |key: &str| may_change.iter().any(|free| key.starts_with(free.as_str()));
        for difference in differences(rig, changed)? {
            let key = difference[0].as_str().unwrap_or_default();
            if !is_free(key) {
                return Ok((
                    false,
                    format!("`{key}` may not be changed here: take it back, in the list of differences"),
                ));
            }
        }
        let text = RigText::parse(changed, Path::new(FILE))?;
        for (key, most) in &self.most {
            if text.number(key).is_none_or(|value| value > *most) {
                return Ok((false, format!("`{key}` is more than {most}")));
            }
        }
        let rig = read(changed)?;
        let designed = DeskDesign::design(&rig)?;
        let table = designed.table()?;
        let law = first_law(table);
        let summary = stepped(&rig, table, law)?;
        let LoopSurvival { tilt_rad, touch_n } = survival(&rig, table, law)?;
        let (links, input) = (rig.chain().map_or(0, |chain| chain.links.len()), rig.input_quantity());
        let is_more = |asked: Option<f64>, is: f64| asked.is_none_or(|asked| is >= asked);
        let is_less = |asked: Option<f64>, is: f64| asked.is_none_or(|asked| is <= asked);
        let found = [
            (self.links.is_none_or(|asked| links == asked), self.links.is_some(), format!("{links} links")),
            (
                summary.fall.is_none(),
                true,
                if summary.fall.is_none() { "survives" } else { "falls" }.to_owned(),
            ),
            (
                is_more(self.tilt_deg, tilt_rad.to_degrees()),
                self.tilt_deg.is_some(),
                format!("tilt up to {:.1}°", tilt_rad.to_degrees()),
            ),
            (
                is_more(self.touch_n, touch_n.unwrap_or(f64::INFINITY)),
                self.touch_n.is_some(),
                format!("touch of {:.2} N", touch_n.unwrap_or(f64::INFINITY)),
            ),
            (
                is_less(self.at_most_n, summary.peak_force_n),
                self.at_most_n.is_some(),
                format!("{} after the step", input.of(&format!("{:.2}", summary.peak_force_n))),
            ),
            (
                is_less(self.settles_s, summary.settling_time_s.unwrap_or(f64::INFINITY)),
                self.settles_s.is_some(),
                summary
                    .settling_time_s
                    .map_or("not settled".to_owned(), |s| format!("settled after {s:.2} s")),
            ),
        ];
        let said: Vec<&str> =
            found.iter().filter(|(_, is_asked, _)| *is_asked).map(|(_, _, text)| text.as_str()).collect();
        Ok((found.iter().all(|(is_right, ..)| *is_right), said.join(", ")))
    }
}

/// A rig that the page can run.
fn read(toml: &str) -> Result<Rig, PageRefusal> {
    let rig = Rig::from_toml(toml, Path::new(FILE))?;
    Ok(rig)
}

/// A run after a step of the set-point.
fn stepped(rig: &Rig, table: &TableValues, law: Law) -> Result<Summary, PageRefusal> {
    let scenario = Scenario { duration_s: f64::from(SECONDS), step_m: STEP_M, ..Scenario::at_rest(rig, law) };
    Ok(simulate(rig, table, &scenario)?.1)
}

fn first_law(table: &TableValues) -> Law {
    table.laws.present().next().map_or(Law::Lqr, |(law, _)| law)
}

fn numbers<const N: usize>(answer: &[f64]) -> Result<[f64; N], PageRefusal> {
    answer.try_into().map_err(|_| PageRefusal::Answer(N))
}

/// The run with the gains of the answer, in the firmware's own controller.
fn gains(toml: &str, answer: &[f64], lean_rad: f64) -> Result<(bool, String), PageRefusal> {
    let rig = read(toml)?;
    let table = with_gains(&rig, DeskDesign::design(&rig)?.table()?, answer)?;
    let mut scenario =
        Scenario { duration_s: f64::from(SECONDS), ..Scenario::at_rest(&rig, first_law(&table)) };
    if let PlantDescription::Chain(_) = rig.plant {
        scenario.start[2] = lean_rad;
    }
    let fall = simulate(&rig, &table, &scenario)?.1.fall;
    let is_right = fall.is_none();
    let end = fall.map_or(format!("survives {SECONDS} s"), |fall| format!("falls after {:.1} s", fall.at_s));
    Ok((is_right, format!("from a lean of {:.1}° it {end}", lean_rad.to_degrees())))
}

/// Whether it balances with a value of a property, and falls a step further.
fn last_value(
    toml: &str,
    answer: &[f64],
    property: &str,
    unit: &str,
    step: f64,
) -> Result<(bool, String), PageRefusal> {
    let [answer] = numbers(answer)?;
    let ends = |value: f64| ended(toml, &json!({ "do": "set", "name": property, "value": value }), SECONDS);
    let further = answer + step;
    // What a wrong answer would do is not said: halving the range would find the answer without a look.
    Ok(match (ends(answer)?, ends(further)?) {
        (None, Some((_, fault))) => (
            true,
            format!(
                "with {answer} {unit} it balances for {SECONDS} s; with {further} {unit} the motor is turned off (fault: {fault})"
            ),
        ),
        _ => (false, format!("{answer} {unit} is not the last value with which it balances")),
    })
}

/// Number and name of the fault that ends a run of the whole firmware in the twin, at most some seconds after a person
/// has done `what`; `None` if it still balances.
fn ended(toml: &str, what: &Value, seconds: u32) -> Result<Option<(u64, String)>, PageRefusal> {
    let mut twin = InPage::default();
    let mut ask = |question: Value| -> Result<Value, PageRefusal> {
        let answer: Value = serde_json::from_str(&twin.answer(&question.to_string()))?;
        match answer["failed"]["why"].as_str() {
            Some(why) => Err(PageRefusal::Twin(why.to_owned())),
            None => Ok(answer),
        }
    };
    let run = |asked: Value| json!({ "twin": "run", "asked": asked, "passed_s": 1.0, "most_ticks": 10_000, "is_silent": false });
    ask(json!({ "twin": "start", "toml": toml, "upright": true, "since_1970_s": 1.7e9 }))?;
    ask(run(json!([])))?;
    let mut asked = json!([{ "ask": "machine", "what": what }]);
    for _ in 0..seconds {
        let fault = &ask(run(asked))?["picture"]["fault"];
        if let Some(code) = fault["code"].as_u64() {
            return Ok(Some((code, fault["name"].as_str().unwrap_or_default().to_owned())));
        }
        asked = json!([]);
    }
    Ok(None)
}
