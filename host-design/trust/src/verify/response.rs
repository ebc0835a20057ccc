//! The loop at one frequency.

use nalgebra::Complex;

use super::loop_model::LoopModel;

/// The loop broken at the plant's input, at one frequency, with L(z) = - (controller · plant).
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// S = 1 / (1 + L): from a disturbance of what the drive holds to all that it holds.
    pub s: Complex<f64>,
    /// T = L / (1 + L).
    pub t: Complex<f64>,
    /// From an impulse on each of the plant's states to what the drive holds.
    pub kick_to_force: Vec<Complex<f64>>,
}

impl Response {
    /// L = T / S.
    pub fn l(&self) -> Complex<f64> {
        self.t / self.s
    }

    /// Phase of L above that of -1 (rad, -π to π): what may be lost where |L| = 1.
    pub(super) fn lag(&self) -> f64 {
        let l = -self.l();
        l.im.atan2(l.re)
    }
}

impl LoopModel<f64> {
    /// The response at `omega` rad per tick (0 to π), by one solve of `(z I - M)ᵀ h = Cᵀ`; none on a pole.
    pub fn response(&self, omega: f64) -> Option<Response> {
        let z = Complex::new(omega.cos(), omega.sin());
        let n = self.matrix.rows();
        // The matrix with the right-hand side as its last column, stored by rows.
        let mut rows: Vec<Vec<Complex<f64>>> = (0..n)
            .map(|i| {
                let entry = |j: usize| {
                    let diagonal = if i == j { z } else { Complex::new(0.0, 0.0) };
                    diagonal - self.matrix[(j, i)]
                };
                (0..n).map(entry).chain([Complex::new(self.held_output[(0, i)], 0.0)]).collect()
            })
            .collect();
        for k in 0..n {
            let pivot = (k..n).max_by(|&i, &j| rows[i][k].norm_sqr().total_cmp(&rows[j][k].norm_sqr()))?;
            rows.swap(k, pivot);
            let (upper, lower) = rows.split_at_mut(k + 1);
            let pivot_row = &upper[k];
            if pivot_row[k].norm_sqr() == 0.0 {
                return None;
            }
            for row in lower {
                let factor = row[k] / pivot_row[k];
                if factor.norm_sqr() > 0.0 {
                    for (entry, pivot) in row[k..].iter_mut().zip(&pivot_row[k..]) {
                        *entry -= factor * pivot;
                    }
                }
            }
        }
        let mut h = vec![Complex::new(0.0, 0.0); n];
        for i in (0..n).rev() {
            let known: Complex<f64> = (i + 1..n).map(|j| rows[i][j] * h[j]).sum();
            h[i] = (rows[i][n] - known) / rows[i][i];
        }
        let t: Complex<f64> = -(0..n).map(|i| h[i] * self.force_input[(i, 0)]).sum::<Complex<f64>>();
        h.truncate(self.states);
        Some(Response { s: Complex::new(1.0, 0.0) - t, t, kick_to_force: h })
    }
}
