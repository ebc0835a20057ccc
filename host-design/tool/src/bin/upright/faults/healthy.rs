//! `upright faults --healthy`

use clap::Args;
use serde_json::json;
use upright::table::Law;
use upright_design::rig::Rig;
use upright_design::study::Study;
use upright_trust::robust::{FalseAlarms, Machines, false_alarms};

use crate::split::Split;
use crate::variation::{Variation, law_option, positive};
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::with_bar;

/// Number of machines for each law.
const MACHINES: u64 = 20;

/// What `--healthy` takes.
#[derive(Args)]
pub(super) struct HealthyOptions {
    /// Inject no defect: balance --runs machines (20) of each law, drawn within [robust], and count false alarms: how
    /// many are turned off. Exit status 1 if any is. Without [robust], each is the machine of [reality]
    #[arg(long, conflicts_with_all = ["swing_up", "jog", "shake", "target", "seed", "kind", "only"])]
    pub(super) healthy: bool,
    /// One machine for each combination of wrong masses, with the full friction, wrong zeros and latency of [robust]
    #[arg(long, requires = "healthy", conflicts_with = "runs")]
    corners: bool,
    /// Time for which each machine balances (s)
    #[arg(long, requires = "healthy", default_value_t = 360.0, value_name = "S", value_parser = positive)]
    duration: f64,
    /// Only this law
    #[arg(long, requires = "healthy", value_parser = law_option())]
    law: Option<Law>,
}

impl HealthyOptions {
    /// Balances machines without a defect with the whole firmware, and counts false alarms.
    pub(super) fn run(
        &self,
        variation: &Variation,
        runs: Option<u64>,
        split: &Split,
        json: bool,
    ) -> Result<(), Failure> {
        let (rig, _, table) = variation.designed()?;
        let runs = runs.unwrap_or(MACHINES);
        let laws: Vec<Law> = table
            .laws
            .present()
            .map(|(law, _)| law)
            .filter(|law| self.law.is_none_or(|only| only == *law))
            .collect();
        if laws.is_empty() {
            return Err(Failure::argument(
                "--law: the rig file does not ask for this control law".to_owned(),
            ));
        }
        let machines = match &rig.robust {
            _ if !self.corners => Machines::Drawn(runs),
            Some(tolerances) if tolerances.mass_percent > 0.0 => Machines::Corners,
            _ => {
                return Err(Failure::argument(
                    "--corners: the rig file has no mass_percent in [robust]".to_owned(),
                ));
            }
        };
        let options = json!({
            "gains": variation.changes(), "runs": (!self.corners).then_some(runs), "duration": self.duration, "law": self.law.map(Law::key),
        });
        let work = |study: &Study| -> Result<Vec<FalseAlarms>, Failure> {
            Ok(with_bar("machines", laws.len() as u64 * machines.count(&rig), |done| {
                let of_law =
                    |&law: &Law| false_alarms(&rig, &table, law, (machines, self.duration), study, done);
                laws.iter().map(of_law).collect::<Result<_, _>>()
            })?)
        };
        split.study("faults --healthy", &rig, &options, work, |found| self.print(&rig, &found, json))
    }

    fn print(&self, rig: &Rig, found: &[FalseAlarms], json: bool) -> Result<(), Failure> {
        let object = json!({ "rig": rig.name, "duration_s": self.duration, "laws": found });
        print(json, &object, || text(found))?;
        let alarms: Vec<String> = found
            .iter()
            .flat_map(|one| {
                one.alarms.iter().map(|(run, fault)| format!("{} run {run}: {fault}", one.law.key()))
            })
            .collect();
        if alarms.is_empty() {
            return Ok(());
        }
        Err(Failure::check(format!("{}: turned off: {}", rig.name, alarms.join("; "))))
    }
}

/// The results as a table, a line for each law.
fn text(found: &[FalseAlarms]) -> String {
    let head = ["law", "machines", "hours", "alarms", "at most", "rejected", "innovation"].map(str::to_owned);
    let row = |one: &FalseAlarms| {
        [
            one.law.key().to_owned(),
            one.runs.to_string(),
            format!("{:.2}", one.hours),
            one.alarms.len().to_string(),
            format!("{:.2} /h", one.most_per_hour),
            one.rejected.to_string(),
            format!("{:.2}", one.closest),
        ]
    };
    let line = |[law, runs, hours, alarms, most, rejected, closest]: [String; 7]| {
        format!("{law:16} {runs:>9} {hours:>8} {alarms:>8} {most:>11} {rejected:>10} {closest:>11}\n")
    };
    [head].into_iter().chain(found.iter().map(row)).map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stay_apart_however_large_their_numbers_are() {
        let one = FalseAlarms {
            law: Law::PolePlacement,
            runs: 123_456_789_012,
            hours: 1e9,
            alarms: Vec::new(),
            most_per_hour: 4_123_418.23,
            rejected: 98_765_432_109_876,
            closest: 123_456_790.0,
        };
        let text = text(&[one]);
        let words: Vec<&str> = text.lines().nth(1).unwrap_or_default().split_whitespace().collect();
        let wanted = [
            "pole_placement",
            "123456789012",
            "1000000000.00",
            "0",
            "4123418.23",
            "/h",
            "98765432109876",
            "123456792.00",
        ];
        assert_eq!(words, wanted);
    }
}
