//! `upright shake`

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use upright_design::rig::{CartOnly, Rig};
use upright_design::table::{Gains, write_atomically};
use upright_identify::{LineError, Log, OverLine, shake};
use upright_tool::in_the_loop::run_shaken;
use upright_tool::monitor::{SerialLine, now};

use crate::target::TargetOption;
use crate::variation::with_table;
use upright_command::Failure;
use upright_command::progress::with_spinner;
use upright_command::warn_of_an_arm;

/// Shakes the hanging machine, and writes its log for `upright identify`.
///
/// Without --port, the machine is the simulated one of the rig file with its [reality]; the force is computed from the
/// file alone. With --target, the whole firmware shakes it, from power-up on, and sends the log over its serial line.
///
/// With --port, the machine is real. Its board must run the image of the rig file and be homed, with signs and
/// motor checked (`upright firmware monitor`); the links must hang still, and nobody may be within reach. Ctrl-C turns
/// the motor off.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright shake rigs/quadruple-paper.toml --log run.log
  upright shake rigs/single-quanser-ip02.toml --log run.log --target board
  upright shake my-rig-as-it-is.toml --log run.log --seconds 20 --seed 7
  upright shake my-rig.toml --log run.log --port /dev/ttyACM0       the real machine")]
pub(crate) struct ShakeCommand {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// File to write the log to
    #[arg(long, value_name = "FILE")]
    log: PathBuf,
    /// Duration (s)
    #[arg(long, default_value_t = 60, value_name = "S", value_parser = clap::value_parser!(u16).range(5..=3600))]
    seconds: u16,
    /// Seed of the excitation's phases
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where the firmware that shakes it runs [default: no firmware]
    #[arg(long, value_enum)]
    target: Option<TargetOption>,
    /// Serial port of a board (/dev/ttyACM0, COM3 …), or tcp:HOST:PORT
    #[arg(long, conflicts_with = "target")]
    port: Option<String>,
}

/// Longest wait for the motor to go off after the shaking is stopped.
const LAST_WAIT: Duration = Duration::from_millis(500);

impl ShakeCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        rig.needs_cart(CartOnly::Identification, &self.rig)?;
        warn_of_an_arm(&rig);
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
        if let Some(port) = &self.port {
            return self.over_line(rig, seconds, port);
        }
        let Some(target) = self.target else {
            return Ok(with_spinner("shaking", || shake(rig, seconds, self.seed))?);
        };
        let (_, table) = with_table(rig, &self.rig, Gains::Sampled)?;
        let built = target.built(rig, &table)?;
        Ok(with_spinner("shaking", || run_shaken(rig, &table, seconds, self.seed, built.place(self.seed)))?)
    }
    /// Shakes the machine behind a port and returns its log.
    fn over_line(&self, rig: &Rig, seconds: f64, port: &str) -> Result<Log, Failure> {
        let (_, table) = with_table(rig, &self.rig, Gains::Sampled)?;
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        let mut line = SerialLine::open(port)?;
        let mut shaking = OverLine::new(rig, &table, seconds, self.seed, now())?;
        let failed = |error: LineError| Failure::check(format!("{port}: {error}"));
        let ended = with_spinner("shaking; Ctrl-C turns the motor off", || {
            while !shaking.is_over() {
                if stop.load(Ordering::Relaxed) {
                    return Err(Failure::check(format!("{port}: stopped; no log is written")));
                }
                shaking.poll(now()).map_err(failed)?;
                exchange(&mut line, &mut shaking)?.map_err(failed)?;
            }
            Ok(())
        });
        // However the shaking ended, the motor has to be off.
        shaking.stop(now());
        let end = Instant::now() + LAST_WAIT;
        while Instant::now() < end && exchange(&mut line, &mut shaking).is_ok() && !shaking.is_off() {}
        ended?;
        Ok(shaking.finish()?)
    }
}

/// Sends pending bytes, and receives.
fn exchange(line: &mut SerialLine, shaking: &mut OverLine) -> Result<Result<(), LineError>, std::io::Error> {
    let mut buffer = [0; 4096];
    let bytes = line.exchange(&shaking.take_outgoing(), &mut buffer)?;
    Ok(shaking.receive(bytes, now()))
}
