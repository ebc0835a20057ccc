//! The runs as data for the animation of the page.

use serde::Serialize;

use super::runs::Scene;
use crate::figure::{CHROMATIC, curve_colour, reference_colour};
use upright_design::plant::absolute_angles;
use upright_design::rig::{PlantDescription, Rig};

/// Everything the script of the page needs.
#[derive(Serialize)]
pub(super) struct Animation {
    /// Lengths of the links (m); empty for a model, which is not drawn.
    lengths: Vec<f64>,
    /// Ends of the rail (m).
    rail: [f64; 2],
    /// Colours of the links, repeated if there are more links.
    colours: Vec<String>,
    cart_colour: String,
    scenes: Vec<SceneFrames>,
}

#[derive(Serialize)]
struct SceneFrames {
    id: &'static str,
    end: f64,
    runs: Vec<Frames>,
}

/// A run, sampled at equal intervals.
#[derive(Serialize)]
struct Frames {
    law: &'static str,
    /// Time between two frames (s).
    every: f64,
    /// Cart (m).
    x: Vec<f64>,
    /// Requested set-point (m).
    target: Vec<f64>,
    /// Angle of each link from the vertical, frame by frame (rad).
    angles: Vec<Vec<f64>>,
    /// How it falls, if it does.
    fall: Option<String>,
}

/// Shortest time between two frames (s).
const FRAME: f64 = 0.02;

impl Animation {
    pub(super) fn of(rig: &Rig, scenes: &[Scene]) -> Self {
        // The way of an arm is unrolled.
        let (lengths, rail, arc) = match &rig.plant {
            PlantDescription::Chain(chain) => {
                let (arc, lengths) = (chain.arc_m(), chain.links.iter().map(|link| link.length_m));
                (lengths.collect(), chain.cart.travel_m.map(|end| arc * end), arc)
            }
            PlantDescription::Model(_) => (Vec::new(), [0.0, 0.0], 1.0),
        };
        let stride = (FRAME / rig.tick.period_s).round().max(1.0) as usize;
        let every = stride as f64 * rig.tick.period_s;
        let links = lengths.len();
        let frames = |scene: &Scene| SceneFrames {
            id: scene.id,
            end: scene
                .runs
                .iter()
                .filter_map(|run| run.trace.samples().last().map(|sample| sample.t))
                .fold(0.0, f64::max),
            runs: scene
                .runs
                .iter()
                .map(|run| {
                    let is_finite = |state: &[f64]| state.iter().all(|value| value.is_finite());
                    let samples = run.trace.samples().step_by(stride).filter(|s| is_finite(s.state));
                    let samples: Vec<_> = samples.collect();
                    let shown = if links > 0 { samples.as_slice() } else { &[] };
                    Frames {
                        law: run.law.title(),
                        every,
                        x: shown.iter().map(|s| rounded(arc * s.state[0])).collect(),
                        target: shown.iter().map(|s| rounded(arc * s.target)).collect(),
                        angles: shown
                            .iter()
                            .map(|s| absolute_angles(s.state).map(rounded).collect())
                            .collect(),
                        fall: run.summary.fall.as_ref().map(|fall| rig.words(&fall.to_string())),
                    }
                })
                .collect(),
        };
        Self {
            lengths,
            rail,
            colours: (0..CHROMATIC).map(curve_colour).collect(),
            cart_colour: reference_colour(),
            scenes: scenes.iter().map(frames).collect(),
        }
    }

    /// As JSON that is safe within a `<script>`.
    pub(super) fn json(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string(self)?.replace('<', "\\u003c"))
    }
}

/// Rounds to a hundredth of a millimetre or of a milliradian: no screen shows more.
fn rounded(x: f64) -> f64 {
    (x * 1e5).round() / 1e5
}
