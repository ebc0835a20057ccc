//! A design as one JSON object.

use host_design::design::{Certified, Feedback, Laws, Poles};
use host_design::numerics::Matrix;
use host_design::rig::Rig;
use host_design::table::TableValues;
use serde_json::{Value, json};

pub(super) fn design(rig: &Rig, certified: &Certified, table: Option<&TableValues>) -> Value {
    let design = &certified.double;
    let [continuous, sampled] = &certified.poles;
    let (continuous, mut sampled) = (laws(&design.continuous, continuous), laws(&design.sampled, sampled));
    let mut of_the_tick = json!({ "Ad": rows(&design.ad), "Bd": rows(&design.bd) });
    if let (Some(object), Some(laws)) = (of_the_tick.as_object_mut(), sampled.as_object_mut()) {
        object.append(laws);
    }
    json!({
        "rig": rig.name,
        "hash": format!("{:016x}", rig.hash()),
        "states": rig.states(),
        "tick_s": rig.tick.period_s,
        "delay_ticks": rig.tick.delay_ticks,
        "plant": { "A": rows(&design.a), "B": rows(&design.b) },
        "continuous": continuous,
        "sampled": of_the_tick,
        "table": table,
        "certificate": { "bits": certified.bits },
    })
}

fn laws(laws: &Laws<f64>, poles: &[Option<Poles>; 2]) -> Value {
    let [lqr, pole_placement] = poles;
    json!({ "lqr": law(&laws.lqr, lqr), "pole_placement": law(&laws.pole_placement, pole_placement) })
}

fn law(law: &Option<Feedback<f64>>, poles: &Option<Poles>) -> Value {
    law.as_ref().map_or(Value::Null, |law| json!({ "K": rows(&law.k), "N": law.n, "poles": poles }))
}

fn rows(matrix: &Matrix<f64>) -> Vec<&[f64]> {
    matrix.row_slices().collect()
}
