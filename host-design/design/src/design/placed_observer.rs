//! An observer with chosen poles (D. G. Luenberger, *IEEE Trans. Automatic Control* 16, 1971).

use crate::numerics::{Matrix, Real, Singular, solve, solve_right};

/// The predictor gain L, s×p, of an observer for p sensors and s = 2 p states with these continuous poles, [re, im] in
/// 1/s, two per sensor. Also the relative error of L in the equation that it satisfies.
///
/// With several sensors, many L have the same poles. This one makes the measured errors `ε = C e` independent of each
/// other: with the sampled poles p and q of its sensor, each satisfies `ε⁺⁺ = (p + q) ε⁺ - p q ε`. In the coordinates
/// `O x`, `O = [C; C Ad]`, the plant is `y⁺⁺ = A₀ y + A₁ y⁺`; with diagonal matrices S of the sums and P of the
/// products, `O L = [L₁; L₂]` is `L₁ = A₁ - S`, `L₂ = A₀ + A₁ L₁ + P`.
///
/// # Errors
/// [`Singular`] if two successive measurements do not determine the state.
pub(super) fn place_observer<R: Real>(
    ad: &Matrix<R>,
    c: &Matrix<R>,
    poles: &[[f64; 2]],
    period: &R,
) -> Result<(Matrix<R>, R), Singular> {
    let p = c.rows();
    let next = c * ad;
    let o = c.above(&next);
    let a_0_a_1 = solve_right(&(&next * ad), &o)?;
    let (a_0, a_1) = (a_0_a_1.block(0, 0, p, p), a_0_a_1.block(0, p, p, p));
    let (sums, products): (Vec<R>, Vec<R>) = poles.chunks(2).map(|two| sum_and_product(two, period)).unzip();
    let (sums, products) = (Matrix::from_diagonal(&sums), Matrix::from_diagonal(&products));
    let l_1 = &a_1 - &sums;
    let l_2 = &(&a_0 + &(&a_1 * &l_1)) + &products;
    let l = solve(&o, &l_1.above(&l_2))?;

    let error = ad - &(&l * c);
    let once = c * &error;
    let twice = &once * &error;
    let missed = &(&twice - &(&sums * &once)) + &(&products * c);
    Ok((l, missed.largest_entry() / &twice.largest_entry()))
}

/// Sum and product of two sampled poles `e^(pT)`, which are real or conjugates.
fn sum_and_product<R: Real>(poles: &[[f64; 2]], period: &R) -> (R, R) {
    let sampled = |&[re, im]: &[f64; 2]| {
        let (size, angle) = ((R::from_f64(re) * period).exp(), R::from_f64(im) * period);
        [size.clone() * &angle.cos(), size * &angle.sin()]
    };
    let [p, q] = [sampled(&poles[0]), sampled(&poles[1])];
    let product = p[0].clone() * &q[0] - &(p[1].clone() * &q[1]);
    (p[0].clone() + &q[0], product)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::design::design;
    use crate::numerics::{Complex, Wide, eigenvalues};
    use crate::rig::Rig;

    /// The double with an observer that has these poles.
    fn rig(poles: &str) -> Rig {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/double-quanser-dbpen.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        Rig::from_toml(&text.replace("[kalman]\n", &format!("[kalman]\nobserver_poles = {poles}\n")), &file)
            .unwrap()
    }

    #[test]
    fn the_observer_has_the_poles_that_the_rig_file_gives() {
        let wanted = [[-40.0, 30.0], [-40.0, -30.0], [-60.0, 0.0], [-60.0, 0.0], [-70.0, 0.0], [-90.0, 0.0]];
        let rig = rig(&format!("{wanted:?}"));
        let found = design(&rig).unwrap().double;
        let kalman = found.kalman.unwrap();
        let mut error = found.ad.clone();
        for (sensor, of) in rig.sensors().iter().enumerate() {
            for i in 0..error.rows() {
                error.row_mut(i)[of.state] -= kalman.l_predictor[(i, sensor)];
            }
        }
        let poles = eigenvalues(&error.map(|&x| Wide::from_f64(x))).unwrap();
        for [re, im] in wanted {
            let (size, angle) = ((re * rig.tick.period_s).exp(), im * rig.tick.period_s);
            let wanted =
                Complex { re: Wide::from_f64(size * angle.cos()), im: Wide::from_f64(size * angle.sin()) };
            let distance = |pole: &Complex<Wide>| {
                let [re, im] = [pole.re.clone() - &wanted.re, pole.im.clone() - &wanted.im];
                Complex { re, im }.modulus().to_f64()
            };
            // Rounding to f64 moves the double pole by its square root.
            assert!(poles.iter().map(distance).fold(f64::MAX, f64::min) < 1e-6, "{re} {im}");
        }
        let filtered = &found.ad * &kalman.l_filter;
        assert!((&filtered - &kalman.l_predictor).largest_entry() < 1e-12);
    }

    /// The Kalman filter's are the smallest of all observers'.
    #[test]
    fn the_innovation_of_the_placed_observer_varies_more_than_that_of_the_kalman_filter() {
        let placed = rig("[[-300, 0], [-300, 0], [-300, 0], [-300, 0], [-300, 0], [-300, 0]]");
        let mut kalman = placed.clone();
        kalman.kalman.as_mut().unwrap().observer_poles.clear();
        let variances = |rig: &Rig| design(rig).unwrap().double.kalman.unwrap().innovation_variances;
        let pairs: Vec<_> =
            variances(&placed).entries().iter().copied().zip(variances(&kalman).entries().to_vec()).collect();
        assert!(pairs.iter().all(|(placed, kalman)| placed > kalman), "{pairs:?}");
    }
}
