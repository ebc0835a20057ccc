//! `upright robust`

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use upright::table::Law;
use upright_design::rig::{Rig, Tolerances};
use upright_design::study::Study;
use upright_design::table::{Gains, write_atomically};
use upright_tool::figure::front_figure;
use upright_trust::robust::{Choice, JudgeSettings, Judgement, RobustError, choose, judge, rewritten};

use crate::split::Split;
use crate::variation::{not_negative, positive, with_table};
use upright_command::Failure;
use upright_command::print;
use upright_command::progress::{with_progress, with_spinner};

mod text;

/// Chooses weights, far poles and joint noise with which the loop survives wrong masses, friction, wrong zeros and
/// latency.
///
/// The tolerances are those of [robust] in the rig file, or of the options. Exit status 3 if nothing helps; the
/// message says why.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright robust rigs/quadruple-paper.toml --mass 10 --joint-friction 1.5e-4 --out rigs/quadruple-robust.toml
  upright robust rigs/quadruple-robust.toml --as-it-is --runs 104      how many runs survive with the file's own numbers
  upright robust my.toml --mass 5 --front --svg front.svg              least ripple over multiples of the tolerances
  upright robust my.toml --joint-friction 1e-3 --json")]
pub(crate) struct RobustCommand {
    /// Rig file (TOML)
    rig: PathBuf,
    /// Error (±) of the masses instead of mass_percent (%)
    #[arg(long, value_name = "PERCENT", value_parser = not_negative)]
    mass: Option<f64>,
    /// Coulomb friction of each joint instead of joint_friction_n_m (N·m)
    #[arg(long, value_name = "N_M", value_parser = not_negative)]
    joint_friction: Option<f64>,
    /// Coulomb friction of the cart instead of cart_friction_n (N)
    #[arg(long, value_name = "N", value_parser = not_negative)]
    cart_friction: Option<f64>,
    /// Error of each joint's zero instead of homing_error_rad (rad)
    #[arg(long, value_name = "RAD", value_parser = not_negative)]
    homing: Option<f64>,
    /// Delay of the force instead of latency_s (s)
    #[arg(long, value_name = "S", value_parser = not_negative)]
    latency: Option<f64>,
    /// Choose nothing: judge the numbers of the file; exit status 1 if a run falls
    #[arg(long, conflicts_with_all = ["out", "front", "svg"])]
    as_it_is: bool,
    /// Number of runs that a choice has to survive at each share of the tolerances
    #[arg(long, default_value_t = 4, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    runs: u32,
    /// Duration of each run (s)
    #[arg(long, default_value_t = 60.0, value_name = "S", value_parser = positive)]
    duration: f64,
    /// Also look for the least ripple at multiples of the tolerances
    #[arg(long)]
    front: bool,
    /// Draw these as SVG
    #[arg(long, value_name = "FILE", requires = "front")]
    svg: Option<PathBuf>,
    /// Write the rig file with the choice; the rig is named after this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write nothing; exit status 1 if the file of --out differs
    #[arg(long, requires = "out")]
    check: bool,
    #[command(flatten)]
    split: Split,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

impl RobustCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        let is_force = rig.actuator.input().is_force();
        for (option, given) in [("--cart-friction", self.cart_friction), ("--latency", self.latency)] {
            if given.is_some() && !is_force {
                let text = format!("{option}: not with kind = \"acceleration\", as in [robust]");
                return Err(Failure::argument(text));
            }
        }
        let tolerances = self.tolerances(&rig);
        let settings =
            JudgeSettings { runs: self.runs.into(), duration_s: self.duration, ..JudgeSettings::of(&rig) };
        if self.as_it_is {
            return self.judge(&rig, &tolerances, &settings);
        }
        if self.split.is_used() {
            return Err(Failure::argument("--shard and --merge are for --as-it-is".to_owned()));
        }
        let failed = |source: RobustError| Failure::of_rig(&rig.name, source);
        let (choice, front) =
            with_progress(|progress| choose(&rig, &tolerances, &settings, self.front, progress))
                .map_err(failed)?;
        if let (Some(path), Some(front)) = (&self.svg, &front) {
            let figure = front_figure(
                front,
                rig.input_quantity(),
                &format!("{}: least ripple that survives", rig.name),
            );
            write_atomically(path, figure.svg()?.as_bytes())?;
        }
        let differs = match &self.out {
            Some(path) => self.write(path, &rig, &tolerances, &choice)?,
            None => false,
        };
        let object = json!({ "rig": rig.name, "tolerances": tolerances, "choice": choice, "front": front });
        print(self.json, &object, || text::chosen(&rig, &tolerances, &choice, front.as_ref()))?;
        match &self.out {
            Some(path) if self.check && differs => {
                Err(Failure::check(format!("{} differs from this choice", path.display())))
            }
            _ => Ok(()),
        }
    }

    /// The tolerances of the rig file, overridden by the options.
    fn tolerances(&self, rig: &Rig) -> Tolerances {
        let stated = rig.robust.clone().unwrap_or_default();
        Tolerances {
            mass_percent: self.mass.unwrap_or(stated.mass_percent),
            joint_friction_n_m: self.joint_friction.unwrap_or(stated.joint_friction_n_m),
            cart_friction_n: self.cart_friction.unwrap_or(stated.cart_friction_n),
            homing_error_rad: self.homing.unwrap_or(stated.homing_error_rad),
            latency_s: self.latency.unwrap_or(stated.latency_s),
        }
    }

    /// Judges the numbers of the file as they are.
    fn judge(&self, rig: &Rig, tolerances: &Tolerances, settings: &JudgeSettings) -> Result<(), Failure> {
        // Fault detection expects what is judged.
        let rig = &Rig { robust: Some(tolerances.clone()), ..rig.clone() };
        let (_, table) = with_table(rig, &self.rig, Gains::Sampled)?;
        let laws: Vec<Law> = table.laws.present().map(|(law, _)| law).collect();
        let options = json!({ "tolerances": tolerances, "settings": settings });
        let work = |study: &Study| -> Result<Vec<Judgement>, Failure> {
            Ok(with_spinner("judging", || {
                let of_law = |&law: &Law| judge(rig, &table, law, tolerances, settings, study);
                laws.iter().map(of_law).collect::<Result<_, _>>()
            })?)
        };
        self.split.study("robust --as-it-is", rig, &options, work, |judgements| {
            self.print_judged(rig, tolerances, settings, &judgements)
        })
    }

    fn print_judged(
        &self,
        rig: &Rig,
        tolerances: &Tolerances,
        settings: &JudgeSettings,
        judgements: &[Judgement],
    ) -> Result<(), Failure> {
        let object = json!({ "rig": rig.name, "tolerances": tolerances, "laws": judgements });
        print(self.json, &object, || text::judged(rig, tolerances, settings, judgements))?;
        let fallen: Vec<&str> =
            judgements.iter().filter(|one| !one.survives()).map(|one| one.law.key()).collect();
        if fallen.is_empty() {
            return Ok(());
        }
        Err(Failure::check(format!("{}: runs fall or leave the limits: {}", rig.name, fallen.join(", "))))
    }

    /// Writes the rig file with the choice, unless --check is given. Returns whether it differs from the existing
    /// file.
    fn write(
        &self,
        path: &Path,
        rig: &Rig,
        tolerances: &Tolerances,
        choice: &Choice,
    ) -> Result<bool, Failure> {
        let bad = |reason: &str| Failure::argument(format!("{}: {reason}", self.rig.display()));
        let text = std::fs::read_to_string(&self.rig)?;
        let part = |name: Option<&std::ffi::OsStr>| name.and_then(|name| name.to_str()).map(str::to_owned);
        let name = part(path.file_stem()).ok_or_else(|| bad("--out needs a file name"))?;
        let file = part(self.rig.file_name()).unwrap_or_default();
        let text = rewritten(&text, &file, &name, rig, tolerances, choice)?;
        // Nothing but a valid rig file is written.
        Rig::from_toml(&text, path)?;
        let differs = std::fs::read_to_string(path).map_or(true, |old| old != text);
        if differs && !self.check {
            write_atomically(path, text.as_bytes())?;
        }
        Ok(differs)
    }
}
