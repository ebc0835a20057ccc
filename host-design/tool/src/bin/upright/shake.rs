//! `upright shake`

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use upright_design::identify::shake;
use upright_design::rig::Rig;
use upright_design::table::write_atomically;

use crate::failure::Failure;
use crate::progress::with_spinner;

/// Shakes the simulated machine, hanging, and writes its log for `upright identify`.
///
/// The machine is that of the rig file with its [reality]; the force is computed from the file alone.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright shake rigs/quadruple-paper.toml --log run.log
  upright shake my-rig-as-it-is.toml --log run.log --seconds 20 --seed 7")]
pub(crate) struct Shake {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Where the log goes
    #[arg(long, value_name = "FILE")]
    log: PathBuf,
    /// Length (s)
    #[arg(long, default_value_t = 60, value_name = "S", value_parser = clap::value_parser!(u16).range(5..=3600))]
    seconds: u16,
    /// Seed of the excitation's phases
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Shake {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        let log = with_spinner("shaking", || shake(&rig, f64::from(self.seconds), self.seed))?;
        write_atomically(&self.log, &log.to_bytes())?;
        let angles = log.deviations();
        let largest = |channel: usize| {
            let counts = angles.iter().skip(channel).step_by(log.channels());
            counts.map(|count| count.unsigned_abs()).max().unwrap_or_default() as f64
        };
        let steps: Vec<f64> = rig.sensors().iter().map(|sensor| sensor.step()).collect();
        let mut out = std::io::stdout().lock();
        writeln!(
            out,
            "{}: {} ticks, cart up to {:.3} m, first joint up to {:.0}°",
            rig.name,
            log.ticks().len(),
            largest(0) * steps[0],
            (largest(1) * steps[1]).to_degrees()
        )?;
        Ok(())
    }
}
