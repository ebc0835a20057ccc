//! `upright shake`

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use upright_design::identify::{Log, shake};
use upright_design::rig::Rig;
use upright_design::table::{Gains, write_atomically};
use upright_tool::in_the_loop::run_shaken;

use crate::failure::Failure;
use crate::firmware::Target;
use crate::progress::with_spinner;
use crate::variation::with_table;

/// Shakes the simulated machine, hanging, and writes its log for `upright identify`.
///
/// The machine is that of the rig file with its [reality]; the force is computed from the file alone. With --target, the
/// whole firmware shakes it, from power-up on, and sends the log over its serial line.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright shake rigs/quadruple-paper.toml --log run.log
  upright shake rigs/single-quanser-ip02.toml --log run.log --target qemu
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
    /// Where the firmware runs that shakes it [default: no firmware]
    #[arg(long, value_enum)]
    target: Option<Target>,
}

impl Shake {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        let log = self.shaken(&rig)?;
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

    fn shaken(&self, rig: &Rig) -> Result<Log, Failure> {
        let seconds = f64::from(self.seconds);
        let Some(target) = self.target else {
            return Ok(with_spinner("shaking", || shake(rig, seconds, self.seed))?);
        };
        let (_, table) = with_table(rig, &self.rig, Gains::Sampled)?;
        let built = target.built_for_identification(rig, &table)?;
        Ok(with_spinner("shaking", || run_shaken(rig, &table, seconds, self.seed, built.place(self.seed)))?)
    }
}
