//! The table's values for the compensation of known friction.

use nalgebra::SMatrix;
use upright::table::FrictionMap;

use super::any_size::{MAX_SENSORS, MAX_STATES, widest};
use super::error::{NoTable, finite};
use crate::design::{Design, continuous_plant, zero_order_hold};
use crate::numerics::{Matrix, solve};
use crate::rig::Rig;

/// Share of the cart's friction that is compensated: if too much is compensated, the cart wanders.
const OF_CART: f64 = 0.9;

/// The values for `[friction]` of the rig; none without.
///
/// The force fed forward for a friction f is `share · (u_s + K x_s) f`, where x_s and u_s are the state and the force
/// at rest under f = 1 with the cart at 0. Without it, a loop that does not know f would pull the links back from x_s.
///
/// # Errors
/// [`NoTable::Range`] if a value does not fit.
pub(super) fn friction_map(
    rig: &Rig,
    design: &Design<f64>,
) -> Result<Option<FrictionMap<MAX_STATES, MAX_SENSORS>>, NoTable> {
    let (Some(known), Ok(plant)) = (&rig.friction, continuous_plant::<f64>(rig)) else { return Ok(None) };
    let states = plant.a.rows();
    let inputs = plant.b.beside(&plant.torque_inputs);
    let axes = inputs.cols();
    let effect = zero_order_hold(&plant.a, &inputs, &rig.tick.period_s).1;
    let at_rest = at_rest(&plant.a, &plant.b, &plant.torque_inputs);
    let laws = design.sampled.in_table();
    let fed_forward = |axis: usize, k: Option<&Matrix<f64>>| match (axis, k, &at_rest) {
        (0, Some(_), _) => -1.0,
        (joint, Some(k), Some(at_rest)) => {
            let column = joint - 1;
            let feedback: f64 = (0..states - 1).map(|i| k[(0, i + 1)] * at_rest[(i, column)]).sum();
            0.01 * known.fed_forward_percent * (at_rest[(states - 1, column)] + feedback)
        }
        _ => 0.0,
    };
    let coulomb = |axis: usize| match axis {
        0 => OF_CART * known.cart_n,
        joint => known.joint_n_m.of_joint(joint - 1),
    };
    let width = |axis: usize| if axis == 0 { known.cart_speed_m_per_s } else { known.joint_rate_rad_per_s };
    let mut map = FrictionMap {
        axes: SMatrix::zeros(),
        effect: widest::<f64, MAX_STATES, MAX_SENSORS>(&effect).map(|value| value as f32),
    };
    for axis in 0..axes.min(MAX_SENSORS) {
        let [lqr, pole_placement] =
            laws.map(|gains| fed_forward(axis, gains.map(|gains| &gains.k))).into_array();
        let values = [coulomb(axis), coulomb(axis) / width(axis), lqr, pole_placement];
        for (row, value) in values.into_iter().enumerate() {
            map.axes[(row, axis)] = finite("a value of [friction]", value as f32)?;
        }
    }
    Ok(Some(map))
}

/// The rest position under a torque of 1 N·m in a joint, one column per joint: all states except the cart's position,
/// then the force. None without gravity, where links rest anywhere.
fn at_rest(a: &Matrix<f64>, b: &Matrix<f64>, torques: &Matrix<f64>) -> Option<Matrix<f64>> {
    let states = a.rows();
    // 0 = A x + B u + G, with the cart at 0.
    let system = a.block(0, 1, states, states - 1).beside(b);
    solve(&system, &-torques).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaning_link_carries_the_torque() {
        // States x, v, θ, ω of a cart with an inverted pendulum: θ̈ = 10 θ - u + 2 τ, ẍ = u - θ.
        let a = Matrix::from_f64_rows(&[
            vec![0.0, 1.0, 0.0, 0.0],
            vec![0.0, 0.0, -1.0, 0.0],
            vec![0.0, 0.0, 0.0, 1.0],
            vec![0.0, 0.0, 10.0, 0.0],
        ]);
        let b = Matrix::column(&[0.0, 1.0, 0.0, -1.0]);
        let torque = Matrix::column(&[0.0, 0.0, 0.0, 2.0]);
        let found = at_rest(&a, &b, &torque).unwrap();
        // v = 0, θ = u, ω = 0 and 9 θ = -2.
        for (row, wanted) in [0.0, -2.0 / 9.0, 0.0, -2.0 / 9.0].into_iter().enumerate() {
            assert!((found[(row, 0)] - wanted).abs() < 1e-12, "{row}");
        }
    }
}
