//! The record of a run.

use std::io::Write;

use crate::rig::{CartInput, PlantDescription, Rig};

/// The record of a run, tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    columns: Vec<String>,
    rows: Vec<f64>,
    states: usize,
}

/// Values of one tick; `S` holds a vector of states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<S> {
    /// Time at the start of the tick (s).
    pub t: f64,
    /// Commanded set-point (m).
    pub target: f64,
    /// Governed set-point, which the law follows (m).
    pub setpoint: f64,
    /// Force that the law requests in this tick (N); acceleration (m/s²) where the drive imposes that.
    pub requested: f64,
    /// Force on the cart at the start of this tick, without the disturbance (N); the acceleration that the drive is
    /// given (m/s²).
    pub force: f64,
    /// True state at the start of the tick.
    pub state: S,
    /// The controller's estimate of the state.
    pub estimate: S,
}

/// Columns before the states.
const LEADING: usize = 5;

impl Trace {
    /// An empty record for `rig` with room for `ticks` ticks.
    pub fn new(rig: &Rig, ticks: usize) -> Self {
        let states: Vec<String> = match &rig.plant {
            PlantDescription::Chain(chain) => {
                let links = (1..=chain.links.len())
                    .flat_map(|link| [format!("theta{link}_rad"), format!("theta{link}dot_rad_per_s")]);
                ["x_m".to_owned(), "xdot_m_per_s".to_owned()].into_iter().chain(links).collect()
            }
            PlantDescription::Model(model) => (0..model.b.len()).map(|i| format!("state{i}")).collect(),
        };
        let [requested, input] = match rig.actuator.input() {
            CartInput::Force => ["force_requested_n", "force_n"],
            CartInput::Acceleration => ["acceleration_requested_m_per_s2", "acceleration_m_per_s2"],
        };
        let leading: [&str; LEADING] = ["t_s", "target_m", "setpoint_m", requested, input];
        let estimates = states.iter().map(|name| format!("{name}_estimated"));
        let columns: Vec<String> =
            leading.map(str::to_owned).into_iter().chain(states.clone()).chain(estimates).collect();
        // The record of a very long run grows during the run.
        let rows = Vec::with_capacity((ticks + 1).min(200_000) * columns.len());
        Self { columns, rows, states: states.len() }
    }

    /// Names of the columns, with units.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Appends one tick to the record.
    pub fn push(&mut self, sample: &Sample<&[f64]>) {
        self.rows.extend([sample.t, sample.target, sample.setpoint, sample.requested, sample.force]);
        self.rows.extend(sample.state);
        self.rows.extend(sample.estimate);
    }

    /// All ticks in order.
    pub fn samples(&self) -> impl ExactSizeIterator<Item = Sample<&[f64]>> {
        let states = self.states;
        self.rows.chunks_exact(self.columns.len()).map(move |row| Sample {
            t: row[0],
            target: row[1],
            setpoint: row[2],
            requested: row[3],
            force: row[4],
            state: &row[LEADING..LEADING + states],
            estimate: &row[LEADING + states..],
        })
    }

    /// Writes the record as CSV: one header line with units, then one line per tick, numbers as shortest decimals.
    ///
    /// # Errors
    /// The errors of `out`.
    pub fn write_csv(&self, out: impl Write) -> std::io::Result<()> {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(&self.columns)?;
        for row in self.rows.chunks_exact(self.columns.len()) {
            csv.write_record(row.iter().map(f64::to_string))?;
        }
        csv.flush()
    }
}
