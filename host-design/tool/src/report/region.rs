//! Map of the region of attraction.

use upright::table::Law;

use crate::figure::{Axis, Figure, HeatMap, Panel};
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_trust::verify::{Horizon, Map, MapAxis, VerifyError, attraction_map};

const ANGLE: usize = 2;
const RATE: usize = 3;
/// Approximate largest angle (rad) and rate (rad/s) of the map.
const LARGEST: [f64; 2] = [0.8, 8.0];

/// Map over angle and rate of the first joint, wide enough to show the whole region, with `points` starts along each
/// axis.
pub(super) fn figure(rig: &Rig, table: &TableValues, law: Law, points: usize) -> Result<Figure, VerifyError> {
    const WIDER: f64 = 1.6;
    let axis = |state: usize, largest: f64| -> Result<MapAxis, VerifyError> {
        let end = 1.4 * extent(rig, table, law, state, largest)?;
        Ok(MapAxis { state, range: [-end, end], points })
    };
    let mut axes = [axis(ANGLE, LARGEST[0])?, axis(RATE, LARGEST[1])?];
    let map = loop {
        let map = attraction_map(rig, table, law, axes, &Horizon::default(), &|| {})?;
        if !reaches_edge(&map) || axes[0].range[1] > LARGEST[0] || axes[1].range[1] > LARGEST[1] {
            break map;
        }
        axes = axes.map(|axis| MapAxis { range: axis.range.map(|end| WIDER * end), ..axis });
    };
    let title = format!("{}: region of attraction, {}", rig.name, law.title());
    Ok(drawn(title, &map))
}

/// Whether the loop recovers from some start on the edge of the map, so that the region may extend beyond.
fn reaches_edge(map: &Map) -> bool {
    let rows = &map.settled_s;
    let sides = rows.iter().flat_map(|row| row.first().into_iter().chain(row.last()));
    let ends = rows.first().into_iter().chain(rows.last()).flatten();
    sides.chain(ends).any(Option::is_some)
}

/// Approximate largest deviation in one state alone from which the loop recovers; the search starts at `largest` and
/// ends below a hundredth of it.
fn extent(rig: &Rig, table: &TableValues, law: Law, state: usize, largest: f64) -> Result<f64, VerifyError> {
    const TRIED: usize = 13;
    let still = MapAxis { state: if state == ANGLE { RATE } else { ANGLE }, range: [0.0, 0.0], points: 1 };
    let mut end = largest;
    loop {
        let moved = MapAxis { state, range: [0.0, end], points: TRIED };
        let map = attraction_map(rig, table, law, [moved, still], &Horizon::default(), &|| {})?;
        let recovered = map.settled_s.concat().iter().take_while(|settled| settled.is_some()).count();
        if recovered >= 4 || end < 1e-2 * largest {
            return Ok(end * recovered.max(1) as f64 / (TRIED - 1) as f64);
        }
        end *= recovered.max(1) as f64 / 4.0;
    }
}

fn drawn(title: String, map: &Map) -> Figure {
    let centres = |axis: &MapAxis| -> Vec<f64> {
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
    let axes = Panel::new(Axis::linear("θ1 at the start (°)"), Axis::linear("θ1' at the start (°/s)"));
    Figure::narrow(title).with(Panel { heat: Some(heat), ..axes.high(400) })
}
