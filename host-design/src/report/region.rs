//! From which starts the loop recovers.

use upright::table::Law;

use super::runs::law_name;
use crate::figure::{Axis as FigureAxis, Figure, HeatMap, Panel};
use crate::rig::Rig;
use crate::table::TableValues;
use crate::verify::{Axis, Horizon, Map, Unverifiable, attraction_map};

/// Starts along each axis of the map.
const POINTS: usize = 31;
const ANGLE: usize = 2;
const RATE: usize = 3;

/// Maps over angle and rate of the first joint, all on the same axes.
pub(super) fn figures(rig: &Rig, table: &TableValues, laws: &[Law]) -> Result<Vec<Figure>, Unverifiable> {
    let mut ranges = [0.0f64; 2];
    for &law in laws {
        for (range, (state, largest)) in ranges.iter_mut().zip([(ANGLE, 0.8), (RATE, 8.0)]) {
            *range = range.max(2.2 * extent(rig, table, law, state, largest)?);
        }
    }
    let axis = |state: usize, end: f64| Axis { state, range: [-end, end], points: POINTS };
    let axes = [axis(ANGLE, ranges[0]), axis(RATE, ranges[1])];
    laws.iter()
        .map(|&law| {
            let map = attraction_map(rig, table, law, axes, &Horizon::default(), &|| {})?;
            let title = format!("{}: region of attraction, {}", rig.name, law_name(law));
            Ok(figure(title, &map))
        })
        .collect()
}

/// How far the start may be off in one state alone, roughly: at least a hundredth of `largest`.
fn extent(rig: &Rig, table: &TableValues, law: Law, state: usize, largest: f64) -> Result<f64, Unverifiable> {
    const TRIED: usize = 13;
    let still = Axis { state: if state == ANGLE { RATE } else { ANGLE }, range: [0.0, 0.0], points: 1 };
    let mut end = largest;
    loop {
        let moved = Axis { state, range: [0.0, end], points: TRIED };
        let map = attraction_map(rig, table, law, [moved, still], &Horizon::default(), &|| {})?;
        let recovered = map.settled_s.concat().iter().take_while(|settled| settled.is_some()).count();
        if recovered >= 4 || end < 1e-2 * largest {
            return Ok(end * recovered.max(1) as f64 / (TRIED - 1) as f64);
        }
        end *= recovered.max(1) as f64 / 4.0;
    }
}

fn figure(title: String, map: &Map) -> Figure {
    let centres = |axis: &Axis| -> Vec<f64> {
        let [low, high] = axis.range.map(f64::to_degrees);
        (0..axis.points).map(|i| low + (high - low) * i as f64 / (axis.points - 1) as f64).collect()
    };
    let heat = HeatMap {
        name: "at rest within".to_owned(),
        unit: "s".to_owned(),
        columns: centres(&map.across),
        rows: centres(&map.down),
        values: map.settled_s.clone(),
    };
    let axes =
        Panel::new(FigureAxis::linear("θ1 at the start (°)"), FigureAxis::linear("θ1' at the start (°/s)"));
    Figure::narrow(title).with(Panel { heat: Some(heat), ..axes.high(400) })
}
