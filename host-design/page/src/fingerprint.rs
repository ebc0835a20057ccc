//! Checksums of a table and of a long run of the whole firmware: two machines that agree in them compute the same bits.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::{Equilibrium, Law};
use upright_closed_loop::harness::{Harness, HarnessError, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing, SimulationError};
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
        let ran = with_firmware(table, |firmware| -> Result<Self, HarnessError> {
            let scenario = Scenario { sensing: Sensing::Encoders, ..Scenario::at_rest(rig, Law::Lqr) };
            let harness = Harness::new(rig, table, &scenario, firmware)?;
            run(harness, rig, table, (rounding, ticks))
        });
        let mut fingerprint = match ran {
            Err(HarnessError::Simulation(SimulationError::Size { .. })) => Self::default(),
            ran => ran??,
        };
        fingerprint.table = hex(&Sha256::digest(gains_source(rig, table)));
        Ok(fingerprint)
    }
}

fn run(
    mut harness: Harness<'_>,
    rig: &Rig,
    table: &TableValues,
    (rounding, ticks): (PullRounding, u32),
) -> Result<Fingerprint, HarnessError> {
    let mut output = harness.raise(None)?;
    let goals: Vec<(usize, Equilibrium)> = match &table.swing_up {
        Some(_) => [(3, Equilibrium::HANGING), (6, Equilibrium::UPRIGHT)]
            .map(|(tenths, to)| ((tenths * ticks / 10) as usize, to))
            .to_vec(),
        None => Vec::new(),
    };
    let keep_alive = (KEEP_ALIVE.as_secs_f64() / rig.tick.period_s).max(1.0) as u32;
    let (mut hash, mut spent, mut broken) = (Sha256::new(), [0; 3], None);
    for tick in 0..ticks {
        if !harness.ask_for(tick as usize, &goals) && tick.is_multiple_of(keep_alive) {
            harness.session.send(Request::KeepAlive);
        }
        let pull = pull(f64::from(tick) * rig.tick.period_s, table, rounding);
        match table.drive.pulses() {
            Some(_) => harness.bench.pull(0.0, &[pull]),
            None => harness.bench.pull(pull, &[]),
        }
        harness.bench.tick(output.drive);
        let mut inputs = harness.inputs();
        if tick >= ticks - ticks / 10
            && let Some(last) = inputs.raw_counts.last_mut()
        {
            *last = *broken.get_or_insert(*last);
        }
        output = harness.session.tick(&inputs)?;
        hash.update(format!("{output:?}"));
        hash.update(harness.session.last_bytes());
        harness.bench.state().iter().for_each(|value| hash.update(value.to_bits().to_le_bytes()));
        match harness.session.status().state {
            State::Balancing => spent[0] += 1,
            State::Raising => spent[1] += 1,
            State::Lowering => spent[2] += 1,
            _ => {}
        }
        harness.session.forget_received();
    }
    let fault = harness.session.fault().map(|fault| fault.to_string());
    Ok(Fingerprint { table: String::new(), run: Some(hex(&hash.finalize())), ticks: spent, fault })
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
