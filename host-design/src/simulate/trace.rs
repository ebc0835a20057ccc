//! The record of a run.

use std::io::Write;

use crate::rig::{PlantDescription, Rig};

/// Everything that happened, tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    columns: Vec<String>,
    samples: Vec<f64>,
    states: usize,
}

/// One tick of a [`Trace`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<'a> {
    /// Time at the start of the tick (s).
    pub t: f64,
    /// Set-point (m).
    pub setpoint: f64,
    /// State at the start of the tick.
    pub state: &'a [f64],
    /// Force that the law asked for in this tick (N).
    pub requested: f64,
    /// Force on the cart during this tick, without the disturbance (N).
    pub applied: f64,
}

impl Trace {
    /// An empty record for `rig`.
    pub fn new(rig: &Rig) -> Self {
        let mut columns = vec!["t_s".to_owned(), "setpoint_m".to_owned()];
        match &rig.plant {
            PlantDescription::Chain(chain) => {
                columns.extend(["x_m".to_owned(), "xdot_m_per_s".to_owned()]);
                for link in 1..=chain.links.len() {
                    columns.extend([format!("theta{link}_rad"), format!("theta{link}dot_rad_per_s")]);
                }
            }
            PlantDescription::Model(model) => columns.extend((0..model.b.len()).map(|i| format!("state{i}"))),
        }
        columns.extend(["force_requested_n".to_owned(), "force_n".to_owned()]);
        Self { columns, samples: Vec::new(), states: rig.states() }
    }

    /// Names of the columns, with units.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    pub(super) fn push(&mut self, sample: Sample<'_>) {
        self.samples.extend([sample.t, sample.setpoint]);
        self.samples.extend(sample.state);
        self.samples.extend([sample.requested, sample.applied]);
    }

    /// All ticks in order.
    pub fn samples(&self) -> impl ExactSizeIterator<Item = Sample<'_>> {
        let states = self.states;
        self.samples.chunks_exact(self.columns.len()).map(move |row| Sample {
            t: row[0],
            setpoint: row[1],
            state: &row[2..2 + states],
            requested: row[2 + states],
            applied: row[3 + states],
        })
    }

    /// Writes the record as CSV: one header line with units, then one line per tick, numbers as shortest decimals.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_csv(&self, out: impl Write) -> std::io::Result<()> {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(&self.columns)?;
        for row in self.samples.chunks_exact(self.columns.len()) {
            csv.write_record(row.iter().map(f64::to_string))?;
        }
        csv.flush()
    }
}
