//! Export of a log for other programs, as CSV and as MCAP.

use std::io::{self, Write};

use upright::table::checksum::crc32;

use crate::log::{CONTACTS, DriveScale, Log};

/// First and last bytes of an MCAP file; the format is described at <https://mcap.dev/spec>.
const MCAP: &[u8; 8] = b"\x89MCAP0\r\n";
/// Record types of an MCAP file (opcodes).
const HEADER: u8 = 1;
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const DATA_END: u8 = 15;
/// Id of the file's only schema, and of its only channel.
const ONLY: [u8; 2] = 1u16.to_le_bytes();

impl Log {
    /// Writes every tick as CSV: its number and time, each channel's deviation from hanging in counts and in its unit,
    /// the drive as duty, force or pulses, supply and contacts. `steps` holds the travel per count of each channel (m,
    /// rad).
    ///
    /// # Errors
    /// Those of writing to `out`.
    pub fn write_csv(&self, steps: &[f64], out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "tick,time_s,{}", self.columns().join(","))?;
        self.rows(steps, |number, time_ns, values| {
            writeln!(out, "{number},{:.6},{}", time_ns as f64 * 1e-9, values.join(","))
        })
    }

    /// Writes every tick as a message of an MCAP file, in JSON with the columns of [`write_csv`](Self::write_csv) as
    /// keys. Time is 0 at the first tick.
    ///
    /// # Errors
    /// Those of writing to `out`.
    pub fn write_mcap(&self, steps: &[f64], out: &mut dyn Write) -> io::Result<()> {
        let columns = self.columns();
        let properties: Vec<String> =
            columns.iter().map(|column| format!("\"{column}\":{{\"type\":\"number\"}}")).collect();
        let schema = format!(
            "{{\"type\":\"object\",\"properties\":{{\"tick\":{{\"type\":\"number\"}},{}}}}}",
            properties.join(",")
        );
        let library = concat!("upright ", env!("CARGO_PKG_VERSION"));
        let mut bytes = MCAP.to_vec();
        record(&mut bytes, HEADER, &[&text(""), &text(library)]);
        record(&mut bytes, SCHEMA, &[&ONLY, &text("upright.Tick"), &text("jsonschema"), &text(&schema)]);
        // The last field is the metadata map, which is empty.
        record(&mut bytes, CHANNEL, &[&ONLY, &ONLY, &text("tick"), &text("json"), &[0; 4]]);
        self.rows(steps, |number, time_ns, values| {
            let named: Vec<String> =
                columns.iter().zip(values).map(|(column, value)| format!("\"{column}\":{value}")).collect();
            let data = format!("{{\"tick\":{number},{}}}", named.join(","));
            let time = time_ns.to_le_bytes();
            record(&mut bytes, MESSAGE, &[&ONLY, &number.to_le_bytes(), &time, &time, data.as_bytes()]);
            Ok(())
        })?;
        let crc = crc32(0, &bytes);
        record(&mut bytes, DATA_END, &[&crc.to_le_bytes()]);
        // No summary section: readers scan the messages.
        record(&mut bytes, FOOTER, &[&[0; 20]]);
        bytes.extend(MCAP);
        out.write_all(&bytes)
    }

    /// Names of the values that [`rows`](Self::rows) passes on.
    fn columns(&self) -> Vec<String> {
        let joints = 1..self.channels();
        let mut columns = vec!["x_counts".to_owned()];
        columns.extend(joints.clone().map(|joint| format!("joint{joint}_counts")));
        columns.push("x_m".to_owned());
        columns.extend(joints.map(|joint| format!("joint{joint}_rad")));
        let drive = match self.header.drive {
            DriveScale::Duty => "duty",
            DriveScale::Force(_) => "force_n",
            DriveScale::Steps(_) => "pulses",
        };
        columns.push(drive.to_owned());
        columns.push("supply_v".to_owned());
        columns.extend(CONTACTS.map(|contact| contact.replace(' ', "_")));
        columns
    }

    /// Calls `each` for every tick, with its number, the time since the first tick (ns), and all its values.
    fn rows(
        &self,
        steps: &[f64],
        mut each: impl FnMut(u32, u64, &[String]) -> io::Result<()>,
    ) -> io::Result<()> {
        let first = self.ticks().first().map_or(0, |tick| tick.number);
        for (tick, counts) in self.ticks().iter().zip(self.deviations().chunks(self.channels())) {
            let mut values: Vec<String> = counts.iter().map(i64::to_string).collect();
            values
                .extend(counts.iter().zip(steps).map(|(&count, step)| format!("{:.7}", count as f64 * step)));
            values.push(format!("{:.6}", self.drive(tick)));
            values.push(format!("{:.3}", f64::from(tick.supply_mv) * 1e-3));
            values.extend((0..CONTACTS.len()).map(|bit| (tick.contacts >> bit & 1).to_string()));
            let time_ns = u64::from(tick.number - first) * u64::from(self.header.period_ns);
            each(tick.number, time_ns, &values)?;
        }
        Ok(())
    }
}

/// Appends a record of an MCAP file: its type, the length of its fields in bytes, and the fields.
fn record(bytes: &mut Vec<u8>, kind: u8, fields: &[&[u8]]) {
    let length: usize = fields.iter().map(|field| field.len()).sum();
    bytes.push(kind);
    bytes.extend((length as u64).to_le_bytes());
    fields.iter().for_each(|field| bytes.extend(*field));
}

/// A string, preceded by its length in bytes.
fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LogHeader, Tick};

    fn log() -> Log {
        let mut log = Log::new(LogHeader {
            rig: "one".to_owned(),
            hash: 1,
            period_ns: 2_000_000,
            drive: DriveScale::Duty,
            hanging: vec![0, 65_535],
        });
        for number in [7, 9] {
            let tick = Tick { number, drive: -32767, supply_mv: 12_000, contacts: 5 };
            log.push(tick, &[number as u16, 1]);
        }
        log
    }

    #[test]
    fn an_mcap_file_is_a_sequence_of_whole_records() {
        let mut out = Vec::new();
        log().write_mcap(&[0.5, 0.25], &mut out).unwrap();
        let mut rest = out.strip_prefix(MCAP).and_then(|rest| rest.strip_suffix(MCAP)).unwrap();
        let mut records = Vec::new();
        while let Some((kind, after)) = rest.split_first() {
            let (length, after) = after.split_first_chunk::<8>().unwrap();
            let (content, after) = after.split_at(u64::from_le_bytes(*length) as usize);
            records.push((*kind, content));
            rest = after;
        }
        let kinds: Vec<u8> = records.iter().map(|record| record.0).collect();
        assert_eq!(kinds, [HEADER, SCHEMA, CHANNEL, MESSAGE, MESSAGE, DATA_END, FOOTER]);
        let schema = &records[1].1[2 + 4 + 12 + 4 + 10 + 4..];
        let schema: serde_json::Value = serde_json::from_slice(schema).unwrap();
        let message = records[4].1;
        assert_eq!(message[6..14], 4_000_000u64.to_le_bytes());
        let message: serde_json::Value = serde_json::from_slice(&message[22..]).unwrap();
        assert_eq!(
            (&message["tick"], &message["x_m"], &message["upper_limit"]),
            (&9.into(), &4.5.into(), &0.into())
        );
        assert!(message.as_object().unwrap().keys().eq(schema["properties"].as_object().unwrap().keys()));
    }
}
