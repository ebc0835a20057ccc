//! The stored motions of a rig: knots from which the motions are computed again, to the last bit.

use std::fmt::Write as _;
use std::io::ErrorKind;
use std::path::{Path as FilePath, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use sha2::{Digest, Sha256};

use super::SwingUpError;
use super::problem::Knots;
use upright_design::rig::{LinkEncoder, Rig, TurnErrors};

/// Both motions as they are stored in the file beside the rig file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stored {
    /// Name of the rig.
    rig: String,
    /// [`request_hash`] of the rig and its `[swing_up]`.
    hash: String,
    pub(crate) raise: StoredKnots,
    pub(crate) lower: StoredKnots,
}

/// Knots of one motion.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StoredKnots {
    /// Ticks from one knot to the next.
    pub(crate) ticks: usize,
    /// Force, then the states of each knot.
    knots: Vec<Vec<f64>>,
}

impl StoredKnots {
    pub(crate) fn new(ticks: usize, knots: &Knots) -> Self {
        let rows = knots.u.iter().zip(&knots.x);
        Self {
            ticks,
            knots: rows.map(|(&u, x)| [u].into_iter().chain(x.iter().copied()).collect()).collect(),
        }
    }

    /// The knots; none if they are invalid or do not have `states` states.
    pub(crate) fn knots(&self, states: usize) -> Option<Knots> {
        let fits = self.knots.len() > 1 && self.knots.iter().all(|row| row.len() == states + 1);
        let finite = self.knots.iter().flatten().all(|value| value.is_finite());
        (fits && finite && (1..=1000).contains(&self.ticks)).then(|| Knots {
            x: self.knots.iter().map(|row| row[1..].to_vec()).collect(),
            u: self.knots.iter().map(|row| row[0]).collect(),
        })
    }

    /// Writes the knots as the next member of a JSON object, one knot per line.
    pub(crate) fn write(&self, text: &mut String, name: &str) {
        // Writing into a string cannot fail.
        let _ = write!(text, ",\n\"{name}\": {{ \"ticks\": {}, \"knots\": [", self.ticks);
        for (index, row) in self.knots.iter().enumerate() {
            let values: Vec<String> = row.iter().map(f64::to_string).collect();
            let _ = write!(text, "{}\n[{}]", if index == 0 { "" } else { "," }, values.join(","));
        }
        text.push_str("\n] }");
    }
}

/// The beginning of a file of stored motions: a JSON object that is not closed yet.
pub(crate) fn header(rig: &str, hash: &str) -> String {
    format!("{{\n\"rig\": {},\n\"hash\": {}", json!(rig), json!(hash))
}

/// Hash of everything that a search depends on: the values of the rig file, `[swing_up]` included, but not the zeros of
/// magnetic sensors, the age of readings, and for how long the links are stilled after a fall, which no motion depends
/// on; the zero of a potentiometer says where its dead band is.
pub(crate) fn request_hash(rig: &Rig) -> String {
    let mut rig = rig.clone();
    rig.limits.stilling_s = None;
    for link in rig.chain_mut().into_iter().flat_map(|chain| &mut chain.links) {
        (link.sensor_delay_s, link.part, link.errors) = (0.0, None, TurnErrors::default());
        if let Some(LinkEncoder::Absolute { zero_counts, travel_rad: None, .. }) = &mut link.encoder {
            *zero_counts = 0;
        }
    }
    // Serialising plain structs of numbers and strings into memory cannot fail.
    let values = serde_json::to_vec(&(&rig, &rig.swing_up)).expect("a rig is representable as JSON");
    Sha256::digest(values).iter().take(8).map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a file of stored motions; `command` is the one that writes it.
pub(crate) fn read<T: DeserializeOwned>(file: PathBuf, command: &'static str) -> Result<T, SwingUpError> {
    let bad = |file, reason| SwingUpError::BadFile { file, reason, command };
    match std::fs::read_to_string(&file) {
        Ok(text) => serde_json::from_str(&text).map_err(|error| bad(file, error.to_string())),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(SwingUpError::NoFile { file, command }),
        Err(error) => Err(bad(file, error.to_string())),
    }
}

impl Stored {
    pub(crate) fn new(rig: &Rig, raise: StoredKnots, lower: StoredKnots) -> Self {
        Self { rig: rig.name.clone(), hash: request_hash(rig), raise, lower }
    }

    /// The file beside a rig file: `rigs/my-rig.swing-up.json` for `rigs/my-rig.toml`.
    pub fn path_beside(rig_file: &FilePath) -> PathBuf {
        rig_file.with_extension("swing-up.json")
    }

    /// Reads the file beside a rig file.
    ///
    /// # Errors
    /// [`SwingUpError::NoFile`] if there is none; [`SwingUpError::BadFile`] if it cannot be used.
    pub fn beside(rig_file: &FilePath) -> Result<Self, SwingUpError> {
        read(Self::path_beside(rig_file), "swing-up")
    }

    /// Whether these motions were planned for exactly these values of the rig file.
    pub fn is_of(&self, rig: &Rig) -> bool {
        self.hash == request_hash(rig)
    }

    /// The motions as JSON, one knot per line.
    pub fn to_json(&self) -> String {
        let mut text = header(&self.rig, &self.hash);
        for (name, motion) in [("raise", &self.raise), ("lower", &self.lower)] {
            motion.write(&mut text, name);
        }
        text.push_str("\n}\n");
        text
    }
}
