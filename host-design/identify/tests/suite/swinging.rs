//! Tables of a simulated double pendulum with a clamped cart, from equations of motion that share no code with the
//! library.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::PathBuf;

use upright_design::rig::Rig;
use upright_identify::{
    AngleReference, AngleZero, Identification, IdentifyError, Reading, RecordingTable, Recordings, Settings,
    identify_recordings,
};

/// Gravity (m/s²).
const GRAVITY: f64 = 9.81;
/// Integration step (s).
const STEP_S: f64 = 2.5e-4;
/// Mass (kg) and length (m) of each link, two uniform rods; of the file, they are a few percent off.
const LINKS: [[f64; 2]; 2] = [[0.10, 0.25], [0.08, 0.20]];

/// A machine and what happens to it.
#[derive(Clone, Copy)]
pub(crate) struct Swing {
    /// Number of links; the second one of a single pendulum weighs nothing.
    pub(crate) links: usize,
    /// Angles from hanging at the start (rad).
    pub(crate) start: [f64; 2],
    /// Dry friction of each joint (N·m).
    pub(crate) dry: f64,
    /// Time during which a hand damps the first link.
    pub(crate) held_s: [f64; 2],
    /// Angle of the first link at which it hits something (rad).
    pub(crate) stop: f64,
    pub(crate) seconds: f64,
}

impl Swing {
    pub(crate) fn of(links: usize) -> Self {
        // A double pendulum that starts higher is chaotic: no numbers predict it over 2 s.
        let start = if links == 1 { [1.6, 0.0] } else { [1.2, 0.9] };
        Self { links, start, dry: 2e-4, held_s: [0.0; 2], stop: f64::INFINITY, seconds: 10.0 }
    }

    /// The angles of both links from hanging (rad), every [`STEP_S`].
    fn angles(&self) -> Vec<[f64; 2]> {
        let [[m1, l1], [m2, l2]] = LINKS;
        let (a2, j2) = if self.links > 1 { (m2 * l2 / 2.0, m2 * l2 * l2 / 3.0) } else { (0.0, 1.0) };
        let carried = if self.links > 1 { m2 } else { 0.0 };
        let (a1, j1) = (m1 * l1 / 2.0 + carried * l1, m1 * l1 * l1 / 3.0 + carried * l1 * l1);
        let rates = |y: [f64; 4], hand: f64| {
            let [p, q, v, w] = y;
            let dry = |rate: f64| self.dry * (rate / 0.01).tanh() + 1e-5 * rate;
            let torque = [dry(v) + hand * v, dry(w - v)];
            let (b, s) = (l1 * a2 * (p - q).cos(), l1 * a2 * (p - q).sin());
            let r1 = torque[1] - torque[0] - s * w * w - GRAVITY * a1 * p.sin();
            let r2 = -torque[1] + s * v * v - GRAVITY * a2 * q.sin();
            let det = j1 * j2 - b * b;
            [v, w, (j2 * r1 - b * r2) / det, (j1 * r2 - b * r1) / det]
        };
        let mut y = [self.start[0], if self.links > 1 { self.start[1] } else { 0.0 }, 0.0, 0.0];
        let add = |y: [f64; 4], k: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| y[i] + h * k[i]);
        let mut all = Vec::new();
        for step in 0..(self.seconds / STEP_S) as usize {
            all.push([y[0], y[1]]);
            let time = step as f64 * STEP_S;
            let hand = if (self.held_s[0]..self.held_s[1]).contains(&time) { 5e-3 } else { 0.0 };
            let k1 = rates(y, hand);
            let k2 = rates(add(y, k1, STEP_S / 2.0), hand);
            let k3 = rates(add(y, k2, STEP_S / 2.0), hand);
            let k4 = rates(add(y, k3, STEP_S), hand);
            y = [0, 1, 2, 3].map(|i| y[i] + STEP_S / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            if y[0] > self.stop && y[2] > 0.0 {
                y[2] *= -0.5;
            }
        }
        all
    }

    /// Rows of the time (s) and the angles from hanging (rad), at the times that `times` gives for each row, rounded to
    /// 4096 counts per turn of each joint.
    pub(crate) fn rows(&self, times: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
        let angles = self.angles();
        let count = TAU / 4096.0;
        let mut rows = Vec::new();
        for index in 0.. {
            let at = times(index) / STEP_S;
            let Some(pair) = angles.get(at as usize..at as usize + 2) else { return rows };
            let mut below = 0.0;
            let mut row = vec![times(index)];
            for link in 0..self.links {
                let angle = pair[0][link] + at.fract() * (pair[1][link] - pair[0][link]);
                let before =
                    if link == 0 { 0.0 } else { pair[0][0] + at.fract() * (pair[1][0] - pair[0][0]) };
                below += count * ((angle - before) / count).round();
                row.push(below);
            }
            rows.push(row);
        }
        rows
    }
}

/// A rig file of so many links, whose masses and lengths are a few percent off.
pub(crate) fn file(links: usize) -> Rig {
    let mut text = "name = \"swing\"\ncart = { mass_kg = 1, encoder_step_m = 1e-5 }\n\
        actuator = { force_limit_n = 1 }\nlink = [\n"
        .to_owned();
    for [mass, length] in &LINKS[..links] {
        writeln!(
            text,
            "{{ mass_kg = {mass}, length_m = {}, encoder_counts_per_rev = 4096 }},",
            1.06 * length
        )
        .unwrap();
    }
    Rig::from_toml(&(text + "]\n"), "swing.toml".as_ref()).unwrap()
}

/// The names of a table of so many links.
pub(crate) fn names(links: usize) -> String {
    (1..=links).fold("time_s".to_owned(), |names, link| format!("{names},angle_{link}_rad"))
}

/// A table of rows, with these names.
pub(crate) fn table(names: &str, rows: &[Vec<f64>]) -> String {
    let line = |row: &Vec<f64>| row.iter().map(|value| format!("{value:.6}")).collect::<Vec<_>>().join(",");
    rows.iter().fold(names.to_owned() + "\n", |text, row| text + &line(row) + "\n")
}

/// How the tables are to be read: absolute angles from hanging, of a clamped cart.
pub(crate) fn reading() -> Reading {
    Reading {
        angles: Some(AngleReference::Absolute),
        zero: Some(AngleZero::Hanging),
        is_clamped: true,
        ..Reading::default()
    }
}

/// What is identified from a table.
pub(crate) fn identified(rig: &Rig, text: &str, reading: &Reading) -> Result<Identification, IdentifyError> {
    let file = PathBuf::from("swing.csv");
    let links = rig.chain().unwrap().links.len();
    let table = RecordingTable::from_text(text, reading, links)
        .map_err(|source| IdentifyError::Table { file: file.clone(), source })?;
    let recordings = Recordings::Tables(vec![(file, table)], reading.clone());
    identify_recordings(rig, None, &recordings, None, &Settings::default(), &|_| ())
}

/// Second over first moment of the first link of a single pendulum (m): 2/3 of its length.
pub(crate) fn reduced_length(found: &Identification) -> [f64; 2] {
    use upright_identify::ParameterKind::SecondMoment;
    let estimate = found.estimate(SecondMoment(0)).unwrap();
    let moment = LINKS[0][0] * 1.06 * LINKS[0][1] / 2.0;
    [estimate.new / moment, estimate.deviation / moment]
}

/// The true one.
pub(crate) const REDUCED_LENGTH: f64 = LINKS[0][1] * 2.0 / 3.0;

/// From hanging to upright, as a table whose zero is there.
pub(crate) fn from_upright(row: &[f64]) -> Vec<f64> {
    row.iter().enumerate().map(|(column, value)| if column == 0 { *value } else { value + PI }).collect()
}
