//! Exercises, and the check of an answer by the library.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use upright::table::Law;
use upright_design::rig::{CartOnly, PlantDescription, Rig};
use upright_design::simulate::{Scenario, simulate};

use crate::designed::DeskDesign;
use crate::refusal::{FILE, PageRefusal};
use crate::twin::InPage;

/// An exercise as its author writes it; texts are for the student.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lesson {
    /// Its name.
    pub title: String,
    /// The rig, by the name of an example.
    pub rig: String,
    /// What to do.
    pub text: String,
    /// What to see, shown once the answer is right.
    pub see: String,
    /// What is asked for.
    pub exercise: Exercise,
    /// Answers for the test of the exercise.
    #[serde(skip_serializing)]
    pub tested: TestedAnswers,
}

/// Answers of which it is known how they are marked.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestedAnswers {
    /// Right.
    pub right: Vec<f64>,
    /// Wrong.
    pub wrong: Vec<f64>,
}

/// What is asked for, and when an answer is right. A wrong answer is told without what would be right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Exercise {
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
}

/// Simulated time that the rig has to survive (s).
const SECONDS: u32 = 10;

impl Exercise {
    /// Marks an answer with the rig of the file `toml`: whether it is right, and why.
    pub(crate) fn marked(&self, toml: &str, answer: &[f64]) -> Result<Value, PageRefusal> {
        let (is_right, why) = match self {
            Self::Gains { lean_rad } => gains(toml, answer, *lean_rad)?,
            Self::Property { property, unit, step } => {
                let [answer] = numbers(answer)?;
                let ends = |value: f64| {
                    let set = json!({ "do": "set", "name": property, "value": value });
                    ended(toml, &set, SECONDS)
                };
                let (here, further) = (ends(answer)?, ends(answer + step)?);
                // What a wrong answer would do is not said: halving the range would find the answer without a look.
                match (here, further) {
                    (None, Some((_, fault))) => {
                        let further = answer + step;
                        let why = format!(
                            "with {answer} {unit} it balances for {SECONDS} s; with {further} {unit} the motor is turned off (fault: {fault})"
                        );
                        (true, why)
                    }
                    _ => (false, format!("{answer} {unit} is not the last value with which it balances")),
                }
            }
            Self::Fault { defect, sensor } => {
                let [answer] = numbers(answer)?;
                let defect = json!({ "do": "defect", "name": defect, "sensor": sensor });
                match ended(toml, &defect, 1)?.filter(|&(code, _)| code as f64 == answer) {
                    Some((code, name)) => (true, format!("fault {code}: {name}")),
                    None => (false, "it ends with another fault".to_owned()),
                }
            }
        };
        Ok(json!({ "right": is_right, "why": why }))
    }
}

fn numbers<const N: usize>(answer: &[f64]) -> Result<[f64; N], PageRefusal> {
    answer.try_into().map_err(|_| PageRefusal::Answer(N))
}

/// The run with the gains of the answer, in the firmware's own controller.
fn gains(toml: &str, answer: &[f64], lean_rad: f64) -> Result<(bool, String), PageRefusal> {
    let rig = Rig::from_toml(toml, Path::new(FILE))?;
    rig.needs_cart(CartOnly::Page, FILE.as_ref())?;
    if answer.len() != rig.states() {
        return Err(PageRefusal::Answer(rig.states()));
    }
    let mut table = DeskDesign::design(&rig)?.table()?.clone();
    for law in Law::ALL {
        if let Some(gains) = &mut table.laws[law] {
            gains.k.iter_mut().zip(answer).for_each(|(gain, &answer)| *gain = answer as f32);
            gains.n = gains.k[0];
        }
    }
    let law = table.laws.present().next().map_or(Law::Lqr, |(law, _)| law);
    let mut scenario = Scenario { duration_s: f64::from(SECONDS), ..Scenario::at_rest(&rig, law) };
    if let PlantDescription::Chain(_) = rig.plant {
        scenario.start[2] = lean_rad;
    }
    let fall = simulate(&rig, &table, &scenario)?.1.fall;
    let is_right = fall.is_none();
    let end = fall.map_or(format!("survives {SECONDS} s"), |fall| format!("falls after {:.1} s", fall.at_s));
    Ok((is_right, format!("from a lean of {:.1}° it {end}", lean_rad.to_degrees())))
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
