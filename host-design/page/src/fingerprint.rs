//! Checksums of a table and of a long run of the whole firmware: two machines that agree in them compute the same bits.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use upright::board::Output;
use upright::supervision::supervisor::State;
use upright::table::{Equilibrium, Law};
use upright_closed_loop::harness::{
    Flow, Goals, HarnessError, Host, Participant, Pins, World, until, with_firmware,
};
use upright_design::rig::Rig;
use upright_design::simulate::{Goal, Scenario, Sensing, SimulationError};
use upright_design::table::{TableValues, gains_source};

/// Ticks of the run with which machines are compared.
pub const TICKS: u32 = 100_000;

/// The firmware could not be run.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct FingerprintError(#[from] HarnessError);

/// How the pull on the cart is computed: two ways in which another compiler might compute it show that the run notices
/// a difference in the last bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PullRounding {
    /// As written: each operation is rounded.
    AsWritten,
    /// One multiplication and addition are rounded together.
    Fused,
    /// The terms are added in another order.
    OtherOrder,
}

/// Checksums of a table and of a run, and what happened in that run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// SHA-256 of the table's source text.
    pub table: String,
    /// SHA-256 of every tick's output, of all bytes that the firmware sent, and of the true state of the rig; none if
    /// the firmware is not compiled for the size of the rig.
    pub run: Option<String>,
    /// Ticks spent in each state that moves the motor: balancing, raising, lowering.
    pub ticks: [u32; 3],
    /// The fault at the end: an encoder breaks in the last tenth of the run.
    pub fault: Option<String>,
}

impl Fingerprint {
    /// Designs nothing: computes with `table`, over `ticks` ticks. The rig is raised, pulled to and fro, lowered and
    /// raised again if it has the motions, and an encoder breaks.
    ///
    /// # Errors
    /// [`FingerprintError`] if the firmware refuses the table, or does not begin to balance.
    pub fn compute(
        rig: &Rig,
        table: &TableValues,
        rounding: PullRounding,
        ticks: u32,
    ) -> Result<Self, FingerprintError> {
        let period_s = rig.tick.period_s;
        let ran = with_firmware(table, |firmware| -> Result<Self, HarnessError> {
            let goals = [(3, Equilibrium::HANGING), (6, Equilibrium::UPRIGHT)]
                .map(|(tenths, to)| Goal { at_s: f64::from(tenths * ticks / 10) * period_s, to });
            let scenario = Scenario {
                sensing: Sensing::Encoders,
                goals: if table.swing_up.is_some() { goals.to_vec() } else { Vec::new() },
                ..Scenario::at_rest(rig, Law::Lqr)
            };
            let mut world = World::new(rig, table, &scenario, firmware)?;
            world.raise(None)?;
            world.goals = Goals::of(rig, &scenario);
            let (ticks, hash, spent) = (ticks as usize, Sha256::new(), [0; 3]);
            let mut run = FingerprintRun { table, rounding, period_s, ticks, hash, spent, broken: None };
            let mut host = Host::new(&scenario, period_s, world.session.pace().command_ticks);
            world.run(ticks, &mut [&mut host, &mut run])?;
            Ok(Self {
                table: String::new(),
                run: Some(hex(&run.hash.finalize())),
                ticks: run.spent,
                fault: world.session.fault().map(|fault| fault.to_string()),
            })
        });
        let mut fingerprint = match ran {
            Err(HarnessError::Simulation(SimulationError::Size { .. })) => Self::default(),
            ran => ran??,
        };
        fingerprint.table = hex(&Sha256::digest(gains_source(rig, table)));
        Ok(fingerprint)
    }
}

/// In a run of `ticks` ticks: a pull on the rig, an encoder that breaks, and what is computed.
struct FingerprintRun<'a> {
    table: &'a TableValues,
    rounding: PullRounding,
    period_s: f64,
    ticks: usize,
    hash: Sha256,
    spent: [u32; 3],
    /// What the encoder reads from when it broke.
    broken: Option<u32>,
}

impl Participant for FingerprintRun<'_> {
    fn act(&mut self, world: &mut World<'_>, _: &mut Output) -> Flow {
        let pull = pull(world.ticks() as f64 * self.period_s, self.table, self.rounding);
        match self.table.drive.pulses() {
            Some(_) => world.bench.pull(0.0, &[pull]),
            None => world.bench.pull(pull, &[]),
        }
        until(false)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        if world.ticks() >= self.ticks - self.ticks / 10
            && let Some(last) = pins.raw_counts.last_mut()
        {
            *last = *self.broken.get_or_insert(*last);
        }
        Ok(())
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        self.hash.update(format!("{:?}", world.last_output()));
        self.hash.update(world.session.last_bytes());
        world.bench.state().iter().for_each(|value| self.hash.update(value.to_bits().to_le_bytes()));
        match world.session.status().state {
            State::Balancing => self.spent[0] += 1,
            State::Raising => self.spent[1] += 1,
            State::Lowering => self.spent[2] += 1,
            _ => {}
        }
        until(false)
    }
}

/// A pull on the cart (N), or on the first joint (N·m) where pulses say where the cart is: three triangular waves,
/// which need no function that machines compute differently.
fn pull(t_s: f64, table: &TableValues, rounding: PullRounding) -> f64 {
    let wave = |period_s: f64| 2.0 * (2.0 * (t_s / period_s).fract() - 1.0).abs() - 1.0;
    let unit =
        if table.drive.pulses().is_some() { 2e-4 } else { 0.002 * f64::from(table.drive.largest_force_n()) };
    let [a, b, c] = [wave(1.3), wave(0.37), wave(0.11)].map(|wave| unit * wave);
    match rounding {
        PullRounding::AsWritten => a + b + c,
        PullRounding::Fused => unit.mul_add(wave(1.3), b) + c,
        PullRounding::OtherOrder => a + (b + c),
    }
}

fn hex(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use upright_design::design::design;
    use upright_design::table::Gains;

    use super::*;

    #[test]
    fn a_difference_in_the_last_bit_of_one_force_is_noticed() {
        for name in ["single-quanser-ip02", "single-stepper", "double-stepper", "quadruple-stepper"] {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{name}.toml"));
            let rig = Rig::from_path(&file).unwrap();
            let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
            let of = |rounding| Fingerprint::compute(&rig, &table, rounding, 10_000).unwrap();
            let (first, again) = (of(PullRounding::AsWritten), of(PullRounding::AsWritten));
            assert_eq!(first, again);
            assert!(first.ticks[0] > 8000 && first.fault.is_some(), "{first:?}");
            for planted in [PullRounding::Fused, PullRounding::OtherOrder] {
                let planted = of(planted);
                assert!(planted.run != first.run && planted.table == first.table, "{planted:?}");
            }
        }
    }
}
