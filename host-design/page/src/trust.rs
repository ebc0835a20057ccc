//! The trust report in short form, a step per question, so that a page shows how far it is.

use serde_json::{Value, json};
use upright_design::design::Certified;
use upright_design::number::significant;
use upright_design::rig::{Imperfection, Rig};
use upright_design::table::TableValues;
use upright_trust::verify::{
    AttractionSettings, ImperfectionSettings, LawTrust, VerifyError, attraction, brief, of_size, pushes, rows,
};

use crate::refusal::PageRefusal;

/// What is found for each law before the imperfections, one a step.
const PARTS: [&str; 2] = ["region of attraction", "pushes by hand"];

/// Steps of a law.
fn steps(rig: &Rig) -> usize {
    PARTS.len() + Imperfection::all_of(rig).len()
}

/// A report that grows with each step; each law has rows for its imperfections, too.
#[derive(Debug, Default)]
pub(crate) struct ShortTrust(Vec<(LawTrust, Vec<Value>)>);

impl ShortTrust {
    /// Takes the step of this number. The first one, 0, begins again: margins and runs with noise of all laws. The
    /// runs of an unstable loop and what a model does not have are left out.
    pub(crate) fn step(
        &mut self,
        rig: &Rig,
        certified: &Certified,
        table: &TableValues,
        step: usize,
    ) -> Result<Value, PageRefusal> {
        let Some(step_of_laws) = step.checked_sub(1) else {
            let laws = brief(rig, certified, table)?.laws;
            self.0 = laws.into_iter().map(|law| (law, Vec::new())).collect();
            return Ok(self.shown(rig, step));
        };
        let is_chain = rig.chain().is_some();
        if let Some((trust, imperfect)) =
            self.0.get_mut(step_of_laws / steps(rig)).filter(|(trust, _)| trust.linear.stable)
        {
            let law = trust.linear.law;
            match step_of_laws % steps(rig) {
                0 => trust.attraction = Some(attraction(rig, table, law, &AttractionSettings::default())?),
                _ if !is_chain => {}
                1 => trust.pushes = pushes(rig, table, law)?,
                part => imperfect.extend(
                    Imperfection::all_of(rig)
                        .get(part - PARTS.len())
                        .map(|one| typical(rig, table, trust, one))
                        .transpose()?,
                ),
            }
        }
        Ok(self.shown(rig, step))
    }

    /// What has been found after the step of this number, how many there are, and the name of the next one, if there is
    /// one.
    fn shown(&self, rig: &Rig, step: usize) -> Value {
        let next = self.0.get(step / steps(rig)).map(|(trust, _)| {
            let part = step % steps(rig);
            let key = |part: usize| Imperfection::all_of(rig).get(part).map_or("", |one| one.key);
            let name = PARTS.get(part).copied().unwrap_or_else(|| key(part - PARTS.len()));
            format!("{name}, {}", trust.linear.law.title())
        });
        let of = |(trust, imperfect): &(LawTrust, Vec<Value>)| {
            let mut shown: Vec<Value> =
                rows(rig, trust).iter().map(|row| json!([row.name, row.value, row.meaning])).collect();
            shown.extend_from_slice(imperfect);
            json!({ "law": trust.linear.law.option(), "rows": shown })
        };
        json!({
            "step": step + 1,
            "steps": 1 + steps(rig) * self.0.len(),
            "next": next,
            "laws": self.0.iter().map(of).collect::<Vec<_>>(),
        })
    }
}

/// The row of an imperfection: whether the motor stays on with its typical size in a poor machine and, if not, in a
/// good one.
fn typical(
    rig: &Rig,
    table: &TableValues,
    trust: &LawTrust,
    imperfection: &Imperfection,
) -> Result<Value, VerifyError> {
    let settings = ImperfectionSettings::of(rig);
    let [good, poor] = imperfection.typical;
    let mut said = Vec::new();
    for size in [poor, good] {
        let runs = of_size(rig, table, trust.linear.law, &settings, imperfection, size)?;
        said.push(format!("{} {}: {}", significant(size, 2), imperfection.unit, runs.text(rig.base())));
        if runs.ended_by.is_none() {
            break;
        }
    }
    Ok(json!([imperfection.key, said.join("; "), rig.base().words(imperfection.remedy)]))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use upright::table::Law;

    use super::*;
    use crate::question::Desk;

    fn ask(desk: &mut Desk, rig: &str, step: usize) -> Value {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{rig}.toml"));
        let toml = std::fs::read_to_string(file).unwrap();
        serde_json::from_str(
            &desk.answer(&json!({ "ask": "verify", "toml": toml, "step": step }).to_string()),
        )
        .unwrap()
    }

    #[test]
    fn each_step_adds_rows_and_the_last_ones_say_which_imperfection_ends_a_run_and_with_which_fault() {
        let all = |rig: &str| {
            let mut desk = Desk::default();
            let mut answers: Vec<Value> = Vec::new();
            while answers.last().is_none_or(|last| last["step"] != last["steps"]) {
                answers.push(ask(&mut desk, rig, answers.len()));
            }
            answers
        };
        let answers = all("single-quanser-ip02");
        let last = answers.last().unwrap();
        let rows = |answer: &Value| answer["laws"][0]["rows"].as_array().unwrap().clone();
        assert_eq!((&last["next"], &last["laws"][0]["law"]), (&Value::Null, &json!(Law::Lqr.option())));
        for (step, name) in
            ["gain margin", "largest tilt, link 1", "push, cart", "joint_friction_n_m"].iter().enumerate()
        {
            let has = |answer: &Value| rows(answer).iter().any(|row| row[0] == *name);
            assert!(has(last) && has(&answers[step]) && (step == 0 || !has(&answers[step - 1])), "{name}");
        }
        let of = |answer: &Value, key: &str| {
            rows(answer).iter().find(|row| row[0] == key).unwrap()[1].as_str().unwrap().to_owned()
        };
        for key in ["rail_tilt_rad", "cart_friction_n"] {
            assert!(of(last, key).contains("4 of 4 survive,"), "{}", of(last, key));
        }
        // Negative control: more than the rail of the double is long enough for, and what a good machine has.
        let zeros = of(all("double-quanser-dbpen").last().unwrap(), "homing_error_rad");
        assert!(zeros.contains(": 0 of 4 survive (fault ") && zeros.contains(": 4 of 4 "), "{zeros}");
    }

    #[test]
    fn a_stepper_is_verified_without_the_imperfections_that_are_not_simulated_with_pulses() {
        let mut desk = Desk::default();
        let answers: Vec<Value> = (0..10).map(|step| ask(&mut desk, "single-stepper", step)).collect();
        let last = &answers[9];
        let has = |name: &str| last["laws"][0]["rows"].as_array().unwrap().iter().any(|row| row[0] == name);
        assert!(has("least resonance") && has("push, end of link 1") && has("joint_friction_n_m"));
        assert!(!has("backlash_m") && !has("cart_friction_n"));
        assert_eq!((&last["steps"], &last["next"]), (&json!(10), &Value::Null));
    }
}
