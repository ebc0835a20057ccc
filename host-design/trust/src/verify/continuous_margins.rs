//! Margins of a continuous loop with the whole state known.

use core::f64::consts::PI;

use nalgebra::Complex;

use super::Margins;

/// Number of frequencies per decade, from 1e-3 to 1e5 rad/s.
const PER_DECADE: i32 = 5000;

/// Margins of the loop broken at the force, from the poles alone: with one input
///
/// ```text
/// S(s) = det(s I - A) / det(s I - A + B K) = Π (s - open) / Π (s - closed),   L = 1/S - 1
/// ```
///
/// All poles as [re, im] (1/s). There is no tick, so the delay margin in ticks is none.
pub fn continuous_margins(open: &[[f64; 2]], closed: &[[f64; 2]]) -> Margins {
    let factor = |omega: f64, pole: &[f64; 2]| Complex::new(-pole[0], omega - pole[1]);
    let sensitivity = |omega: f64| -> Complex<f64> {
        let ratios =
            open.iter().zip(closed).map(|(open, closed)| factor(omega, open) / factor(omega, closed));
        ratios.product()
    };
    let l = |omega: f64| Complex::new(1.0, 0.0) / sensitivity(omega) - 1.0;
    let omegas: Vec<f64> = (-3 * PER_DECADE..=5 * PER_DECADE)
        .map(|i| 10f64.powf(f64::from(i) / f64::from(PER_DECADE)))
        .collect();

    let largest = |of: &dyn Fn(Complex<f64>) -> f64| {
        let values = omegas.iter().map(|&omega| (of(sensitivity(omega)), omega));
        values.fold((0.0, 0.0), |best, next| if next.0 > best.0 { next } else { best })
    };
    let (peak_sensitivity, peak_at) = largest(&|s| s.norm_sqr().sqrt());
    let (peak_complementary_sensitivity, _) = largest(&|s| (s - 1.0).norm_sqr().sqrt());
    let (disk, disk_at) = largest(&|s| (s * 2.0 - 1.0).norm_sqr().sqrt());

    // The real factors g with 1 + g L = 0 at some frequency.
    let factors: Vec<f64> = zeros(&omegas, |omega| l(omega).im)
        .into_iter()
        .chain([0.0])
        .map(|omega| -1.0 / l(omega).re)
        .filter(|&gain| gain > 0.0)
        .collect();
    let crossovers = zeros(&omegas, |omega| l(omega).norm_sqr() - 1.0);
    let lag = |omega: f64| {
        let opposite = -l(omega);
        opposite.im.atan2(opposite.re)
    };
    let least = |values: &mut dyn Iterator<Item = f64>| values.min_by(f64::total_cmp);
    Margins {
        lowest_gain: factors.iter().copied().filter(|&gain| gain < 1.0).fold(0.0, f64::max),
        highest_gain: least(&mut factors.iter().copied().filter(|&gain| gain > 1.0)),
        phase_margin_rad: least(&mut crossovers.iter().map(|&omega| lag(omega).abs())),
        delay_margin_s: least(&mut crossovers.iter().map(|&omega| lag(omega).rem_euclid(2.0 * PI) / omega)),
        delay_margin_ticks: None,
        crossovers_rad_per_s: crossovers,
        peak_sensitivity,
        peak_sensitivity_rad_per_s: peak_at,
        peak_complementary_sensitivity,
        disk_margin: 2.0 / disk,
        disk_margin_rad_per_s: disk_at,
    }
}

/// The frequencies where `f` changes sign, by bisection between neighbouring frequencies.
fn zeros(omegas: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
    let brackets = omegas.windows(2).filter(|pair| f(pair[0]) * f(pair[1]) < 0.0);
    brackets
        .map(|pair| {
            let (mut low, mut high) = (pair[0], pair[1]);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if f(middle) * f(low) > 0.0 { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_of_an_unstable_first_order_loop_are_those_on_paper() {
        // L = 4 / (s - 1): closed pole -3. Crossover at √15, phase margin acos(1/4), stable for gains above 1/4.
        let margins = continuous_margins(&[[1.0, 0.0]], &[[-3.0, 0.0]]);
        let phase = 0.25f64.acos();
        assert!((margins.phase_margin_rad.unwrap() - phase).abs() < 1e-9);
        assert!((margins.delay_margin_s.unwrap() - phase / 15f64.sqrt()).abs() < 1e-9);
        assert_eq!((margins.lowest_gain, margins.highest_gain), (0.25, None));
        // |S| = |jω - 1| / |jω + 3| grows towards 1.
        assert!((margins.peak_sensitivity - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_third_order_loop_has_its_gain_margin_where_the_phase_is_half_a_turn() {
        // L = 1 / s (s + 1)²: -1 is reached at ω = 1 with a gain of 2.
        let closed = [
            [-1.754_877_666_246_692_8, 0.0],
            [-0.122_561_166_876_653_6, 0.744_861_766_619_744_2],
            [-0.122_561_166_876_653_6, -0.744_861_766_619_744_2],
        ];
        let margins = continuous_margins(&[[0.0, 0.0], [-1.0, 0.0], [-1.0, 0.0]], &closed);
        assert!((margins.highest_gain.unwrap() - 2.0).abs() < 1e-6);
        assert_eq!(margins.lowest_gain, 0.0);
        assert!((margins.phase_margin_rad.unwrap().to_degrees() - 21.4).abs() < 0.1);
    }
}
