//! Telemetry as JSON and as CSV.

use std::io::Write;

use crate::client::AnyTelemetry;
use serde_json::{Value, json};

/// One object with SI units; fault and arming inhibits by name.
pub fn json(telemetry: &AnyTelemetry) -> Value {
    json!({
        "tick": telemetry.tick,
        "state": telemetry.state,
        "law": telemetry.law,
        "fault": telemetry.fault.map(|fault| fault.to_string()),
        "against_arming": telemetry.arming_inhibits.texts().collect::<Vec<_>>(),
        "against_swing_up": telemetry.swing_up_inhibits.texts().collect::<Vec<_>>(),
        "contacts": telemetry.contacts,
        "supply_v": telemetry.supply_v,
        "counts": telemetry.counts,
        "estimate": telemetry.estimate,
        "innovation": telemetry.innovation,
        "setpoint_m": telemetry.setpoint_m,
        "requested_n": telemetry.requested_n,
        "applied_n": telemetry.applied_n,
        "drive": telemetry.drive,
        "cycles": telemetry.cycles,
        "worst_cycles": telemetry.worst_cycles,
    })
}

/// A CSV file with one row per telemetry message. Every row is flushed, so the file is complete whenever the recording
/// ends.
pub struct TelemetryCsv<W: Write> {
    csv: csv::Writer<W>,
    begun: bool,
}

impl<W: Write> TelemetryCsv<W> {
    /// An empty recording.
    pub fn new(out: W) -> Self {
        Self { csv: csv::Writer::from_writer(out), begun: false }
    }

    /// The output, with all rows so far.
    pub fn get_ref(&self) -> &W {
        self.csv.get_ref()
    }

    /// Adds a row, before the first one a header.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn push(&mut self, telemetry: &AnyTelemetry) -> std::io::Result<()> {
        if !self.begun {
            let fixed =
                ["tick", "state", "fault", "setpoint_m", "requested_n", "applied_n", "drive", "cycles"];
            let head = fixed.iter().map(|name| (*name).to_owned());
            let numbered = |name: &'static str, length| (0..length).map(move |i| format!("{name}{i}"));
            let head = head
                .chain(numbered("count", telemetry.counts.len()))
                .chain(numbered("estimate", telemetry.estimate.len()))
                .chain(numbered("innovation", telemetry.innovation.len()));
            self.csv.write_record(head)?;
            self.begun = true;
        }
        let fixed = [
            telemetry.tick.to_string(),
            format!("{:?}", telemetry.state),
            telemetry.fault.map(|fault| fault.to_string()).unwrap_or_default(),
            telemetry.setpoint_m.to_string(),
            telemetry.requested_n.to_string(),
            telemetry.applied_n.to_string(),
            telemetry.drive.to_string(),
            telemetry.cycles.to_string(),
        ];
        let counts = telemetry.counts.iter().map(ToString::to_string);
        let values = telemetry.estimate.iter().chain(&telemetry.innovation).map(ToString::to_string);
        self.csv.write_record(fixed.into_iter().chain(counts).chain(values))?;
        self.csv.flush()
    }
}

impl TelemetryCsv<Vec<u8>> {
    /// Ends the recording; returns the bytes of the file.
    pub fn into_bytes(self) -> Vec<u8> {
        // Every row has been flushed, so nothing is left to fail.
        self.csv.into_inner().unwrap_or_default()
    }
}
