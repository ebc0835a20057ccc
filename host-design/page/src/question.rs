//! What a page asks, and the answers.

use std::path::Path;

use serde::Deserialize;
use serde_json::{Value, json};
use upright_design::export::c_header;
use upright_design::rig::{Rig, RigText};
use upright_design::table::gains_source;

use crate::changes::{changed, differences};
use crate::designed::{DeskDesign, ShownRun};
use crate::fingerprint::{Fingerprint, PullRounding};
use crate::hand_in::sealed;
use crate::lab::{shown, varied};
use crate::refusal::{FILE, PageRefusal, failed};
use crate::sketch::sketch;
use crate::task::LabTask;

/// A question about a rig: the text of its file, and what is wanted.
#[derive(Debug, Deserialize)]
struct Question {
    #[serde(flatten)]
    wanted: Asked,
    /// The rig file.
    toml: String,
    /// The motions that are stored beside it, if there are any.
    motions: Option<String>,
    /// A person's own gains K, one per state, in place of those of the laws.
    own: Option<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case")]
enum Asked {
    /// Whether the file is valid, and what it describes.
    Check,
    /// The text with other values of some keys, without those that have none; before, with this number of links.
    Set {
        #[serde(default)]
        links: Option<usize>,
        #[serde(default)]
        values: Vec<(String, Option<String>)>,
    },
    /// The gains, and the closed loop in a run of the firmware's controller.
    Design(ShownRun),
    /// That run, tick by tick, as `upright simulate --csv` writes it.
    Csv {
        law: String,
        #[serde(flatten)]
        run: ShownRun,
    },
    /// What differs from another file.
    Differences { from: String },
    /// How much the loop of a law stands.
    Survival { law: String },
    /// The poles of the loops, which take as long as the gains.
    Poles,
    /// The trust report in short form, as far as its step of this number.
    Verify { step: usize },
    /// What the lab in this text is.
    Lab,
    /// The text with the numbers of a student, whose seed this is.
    Vary { vary: Vec<(String, f64)>, seed: String },
    /// Whether an answer to a step of a lab is right: numbers, or what the text has become of the lab's `rig`.
    Mark { task: LabTask, rig: String, answer: Vec<f64> },
    /// A file for the teacher.
    HandIn { work: Value },
    /// The gain table as Rust source, as `upright design` writes it.
    Table,
    /// Table and controller as a C header, as `upright export` writes it.
    Header,
    /// Checksums of the table and of `ticks` ticks of the firmware.
    Fingerprint { rounding: PullRounding, ticks: u32 },
}

/// Answers questions; keeps the last design, because the next question is often about the same rig.
#[derive(Debug, Default)]
pub struct Desk {
    designed: Option<(String, Option<Vec<f64>>, DeskDesign)>,
}

impl Desk {
    /// Answers a question in JSON with an object in JSON. One that cannot be answered gives `failed`, with what to do,
    /// and for an error in the rig file its `line` and `column`.
    pub fn answer(&mut self, question: &str) -> String {
        let answer = serde_json::from_str(question)
            .map_err(PageRefusal::from)
            .and_then(|question| self.answered(&question));
        answer.unwrap_or_else(|refusal| failed(&refusal)).to_string()
    }

    fn answered(&mut self, question: &Question) -> Result<Value, PageRefusal> {
        if let Asked::Lab = question.wanted {
            return Ok(json!({ "lab": shown(&question.toml).map_err(PageRefusal::Lab)? }));
        }
        let rig = Rig::from_toml(&question.toml, Path::new(FILE))?;
        let motions = question.motions.as_deref();
        match &question.wanted {
            Asked::Check => Ok(sketch(&rig, &RigText::parse(&question.toml, Path::new(FILE))?)),
            Asked::Set { links, values } => {
                let text = changed(&question.toml, *links, values)?;
                Rig::from_toml(&text, Path::new(FILE))?;
                Ok(json!({ "toml": text }))
            }
            Asked::Design(run) => self.designed(question, &rig)?.gains_and_run(&rig, run),
            Asked::Csv { law, run } => {
                let text = self.designed(question, &rig)?.csv(&rig, law, run)?;
                Ok(json!({ "text": text }))
            }
            Asked::Differences { from } => Ok(json!({ "differences": differences(from, &question.toml)? })),
            Asked::Survival { law } => self.designed(question, &rig)?.survival(&rig, law),
            Asked::Poles => self.designed(question, &rig)?.poles(&rig),
            &Asked::Verify { step } => self.designed(question, &rig)?.verify(&rig, step),
            // Answered above: its text is no rig.
            Asked::Lab => Ok(Value::Null),
            Asked::Vary { vary, seed } => Ok(json!({ "toml": varied(&question.toml, vary, seed)? })),
            Asked::Mark { task, rig, answer } => task.marked(rig, &question.toml, answer),
            Asked::HandIn { work } => Ok(json!({ "text": sealed(work.clone()) })),
            Asked::Table => {
                let table = self.designed(question, &rig)?.table_with(&rig, motions)?;
                Ok(json!({ "text": gains_source(&rig, &table) }))
            }
            Asked::Header => {
                let table = self.designed(question, &rig)?.table()?;
                Ok(json!({ "text": c_header(&rig, table)? }))
            }
            &Asked::Fingerprint { rounding, ticks } => {
                let table = self.designed(question, &rig)?.table_with(&rig, motions)?;
                Ok(json!(Fingerprint::compute(&rig, &table, rounding, ticks)?))
            }
        }
    }

    /// The design of `rig`, whose file is that of the question, with a person's own gains if there are any.
    fn designed(&mut self, question: &Question, rig: &Rig) -> Result<&mut DeskDesign, PageRefusal> {
        let Question { toml, own, .. } = question;
        let kept = self.designed.take().filter(|(text, gains, _)| text == toml && gains == own);
        let designed = match kept {
            Some((.., designed)) => designed,
            None => DeskDesign::design(rig)?.with_own(rig, own.as_deref())?,
        };
        Ok(&mut self.designed.insert((toml.clone(), own.clone(), designed)).2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig(name: &str) -> String {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{name}.toml"));
        std::fs::read_to_string(file).unwrap()
    }

    fn ask(question: &Value) -> Value {
        serde_json::from_str(&Desk::default().answer(&question.to_string())).unwrap()
    }

    #[test]
    fn an_error_in_a_rig_file_comes_with_its_line_and_what_to_do() {
        let toml = rig("single-quanser-ip02");
        assert!(ask(&json!({ "ask": "check", "toml": toml }))["failed"].is_null());
        let wrong = toml.replace("mass_kg", "mas_kg");
        let line = wrong.lines().position(|line| line.contains("mas_kg")).unwrap() + 1;
        let failed = &ask(&json!({ "ask": "check", "toml": wrong }))["failed"];
        assert_eq!(failed["line"], line);
        assert!(failed["why"].as_str().unwrap().contains("did you mean `mass_kg`"), "{failed}");
        assert!(ask(&json!({ "ask": "guess", "toml": toml }))["failed"].is_object());
    }

    #[test]
    fn another_weight_gives_other_gains_and_the_first_one_those_of_the_paper() {
        let toml = rig("quadruple-paper");
        let gains = |toml: &Value| {
            let design = json!({ "ask": "design", "toml": toml, "lean_rad": 0.002, "step_m": 0.05 });
            ask(&design)["laws"][0]["continuous"]["k"].clone()
        };
        let first = gains(&json!(toml));
        assert!((first[0].as_f64().unwrap() - 3.162_277_66).abs() < 1e-6, "{first}");
        let set = json!({ "ask": "set", "toml": toml, "values": [["lqr.force_weight", "2"]] });
        let changed = ask(&set)["toml"].clone();
        assert!(changed.as_str().unwrap().contains("force_weight = 2\n"));
        assert_ne!(gains(&changed), first);
        let refused = json!({ "ask": "set", "toml": toml, "values": [["lqr.force_weight", "-2"]] });
        assert!(ask(&refused)["failed"]["why"].as_str().unwrap().contains("force_weight"));
    }
}
