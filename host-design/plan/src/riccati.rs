//! The linear-quadratic problem along a trajectory, solved by a Riccati recursion.

use upright_design::numerics::Matrix;

/// One step of the problem, in deviations z (m entries) and one input w:
/// cost `½ zᵀ Q z + qᵀ z + ½ r w² + g w`, next `z⁺ = A z + B w + d`.
pub(crate) struct Stage {
    pub(crate) q: Matrix<f64>,
    pub(crate) q_linear: Vec<f64>,
    pub(crate) r: f64,
    pub(crate) r_linear: f64,
    pub(crate) a: Matrix<f64>,
    pub(crate) b: Vec<f64>,
    pub(crate) d: Vec<f64>,
}

/// Deviations z (steps + 1) and inputs w (steps) of the minimum.
pub(crate) struct Minimum {
    pub(crate) z: Vec<Vec<f64>>,
    pub(crate) w: Vec<f64>,
}

/// The minimum from z = 0, with the cost `½ zᵀ Q z + qᵀ z` of the last state. None if numbers overflow or the cost has
/// no minimum.
pub(crate) fn minimise(stages: &[Stage], last_q: &Matrix<f64>, last_q_linear: &[f64]) -> Option<Minimum> {
    let m = last_q_linear.len();
    let (mut p, mut p_linear) = (last_q.clone(), last_q_linear.to_vec());
    let mut next = Matrix::zeros(m, m);
    let mut feedback: Vec<(Vec<f64>, f64)> = Vec::with_capacity(stages.len());
    for stage in stages.iter().rev() {
        let pa = &p * &stage.a;
        let pb = times(&p, &stage.b);
        let h = stage.r + dot(&stage.b, &pb);
        // p + P d
        let ahead: Vec<f64> = times(&p, &stage.d).iter().zip(&p_linear).map(|(pd, p)| pd + p).collect();
        let mut k = times_transposed(&pa, &stage.b);
        k.iter_mut().for_each(|k| *k /= h);
        let k_0 = (stage.r_linear + dot(&stage.b, &ahead)) / h;
        // Q + Aᵀ P A - h Kᵀ K, of which the upper triangle is computed.
        for i in 0..m {
            let row = &mut next.row_mut(i)[i..];
            row.copy_from_slice(&stage.q.row(i)[i..]);
            for l in 0..m {
                let factor = stage.a[(l, i)];
                if factor != 0.0 {
                    add(row, factor, &pa.row(l)[i..]);
                }
            }
            for j in i..m {
                row[j - i] -= h * k[i] * k[j];
            }
        }
        for i in 0..m {
            for j in i + 1..m {
                next[(j, i)] = next[(i, j)];
            }
        }
        let through = times_transposed(&stage.a, &ahead);
        for j in 0..m {
            p_linear[j] = stage.q_linear[j] + through[j] - h * k[j] * k_0;
        }
        core::mem::swap(&mut p, &mut next);
        if !h.is_finite() || h <= 0.0 {
            return None;
        }
        feedback.push((k, k_0));
    }
    let (mut z, mut w) = (vec![vec![0.0; m]], Vec::with_capacity(stages.len()));
    for (stage, (k, k_0)) in stages.iter().zip(feedback.iter().rev()) {
        let at = &z[z.len() - 1];
        let input = -dot(k, at) - k_0;
        let next = times(&stage.a, at);
        let next = next.iter().zip(&stage.b).zip(&stage.d).map(|((az, b), d)| az + b * input + d).collect();
        w.push(input);
        z.push(next);
    }
    let finite = w.iter().chain(z.iter().flatten()).all(|value| value.is_finite());
    finite.then_some(Minimum { z, w })
}

/// M v.
pub(crate) fn times(m: &Matrix<f64>, v: &[f64]) -> Vec<f64> {
    m.row_slices().map(|row| dot(row, v)).collect()
}

/// Mᵀ v.
fn times_transposed(m: &Matrix<f64>, v: &[f64]) -> Vec<f64> {
    // As for any sum of f64, the neutral element is -0.
    let mut product = vec![-0.0; m.cols()];
    m.row_slices().zip(v).for_each(|(row, &v)| add(&mut product, v, row));
    product
}

/// `to + factor · from`, entry by entry.
#[inline]
pub(crate) fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    let from = &from[..to.len()];
    for j in 0..to.len() {
        to[j] += factor * from[j];
    }
}

/// aᵀ b.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A double integrator with a gap of 1 in its first step, brought back towards 0 by the cost of the last state: no
    /// change of an input lowers the cost of the minimum.
    #[test]
    fn no_other_input_costs_less() {
        let stage = |gap: f64| Stage {
            q: Matrix::from_diagonal(&[0.1, 0.2]),
            q_linear: vec![0.01, -0.02],
            r: 0.5,
            r_linear: 0.1,
            a: Matrix::from_f64_rows(&[vec![1.0, 0.5], vec![0.0, 1.0]]),
            b: vec![0.125, 0.5],
            d: vec![gap, 0.0],
        };
        let stages = [stage(1.0), stage(0.0), stage(0.0)];
        let (last, last_linear) = (Matrix::from_diagonal(&[10.0, 10.0]), vec![0.3, 0.0]);
        let cost = |w: &[f64]| {
            let (mut z, mut sum) = (vec![0.0, 0.0], 0.0);
            for (stage, w) in stages.iter().zip(w) {
                sum += 0.5 * dot(&z, &times(&stage.q, &z)) + dot(&stage.q_linear, &z);
                sum += 0.5 * stage.r * w * w + stage.r_linear * w;
                let next = times(&stage.a, &z);
                z = (0..2).map(|i| next[i] + stage.b[i] * w + stage.d[i]).collect();
            }
            sum + 0.5 * dot(&z, &times(&last, &z)) + dot(&last_linear, &z)
        };
        let found = minimise(&stages, &last, &last_linear).unwrap();
        for step in 0..3 {
            for change in [-1e-3, 1e-3] {
                let mut other = found.w.clone();
                other[step] += change;
                assert!(cost(&other) > cost(&found.w) + 1e-9, "{step} {change}");
            }
        }
    }
}
