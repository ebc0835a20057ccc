//! Power spectra of recorded runs.

use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use serde::Serialize;

/// Samples in a segment: 8.192 s at 1 kHz.
pub const SEGMENT: usize = 8192;

/// One-sided power spectral density of a signal at equally spaced frequencies from 0 to half the sampling rate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spectrum {
    /// Spacing of the frequencies (Hz).
    pub spacing_hz: f64,
    /// Density at each frequency (unit² per Hz).
    pub density: Vec<f64>,
}

/// Where the power of a signal lies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bandwidth {
    /// Mean frequency, weighted by power (Hz).
    pub mean_hz: f64,
    /// Half of the power lies below (Hz).
    pub median_hz: f64,
    /// 95 % of the power lies below (Hz).
    pub most_hz: f64,
}

impl Spectrum {
    /// Welch's estimate (P. D. Welch, *IEEE Trans. Audio Electroacoust.* 15, 1967): [`SEGMENT`] samples at a time,
    /// each segment minus its mean and under a Hann window, overlapping by half; the mean of their periodograms.
    /// `None` if the signal is shorter than a segment.
    pub fn welch(signal: &[f64], sample_s: f64) -> Option<Self> {
        let window: Vec<f64> =
            (0..SEGMENT).map(|i| (core::f64::consts::PI * i as f64 / SEGMENT as f64).sin().powi(2)).collect();
        let power: f64 = window.iter().map(|weight| weight * weight).sum();
        let transform = RealTransform::new();
        let mut input = vec![0.0; SEGMENT];
        let mut density = vec![0.0; SEGMENT / 2 + 1];
        let mut segments = 0.0;
        for segment in signal.windows(SEGMENT).step_by(SEGMENT / 2) {
            let mean = segment.iter().sum::<f64>() / SEGMENT as f64;
            for ((input, value), weight) in input.iter_mut().zip(segment).zip(&window) {
                *input = weight * (value - mean);
            }
            for (sum, bin) in density.iter_mut().zip(transform.spectrum(&input)) {
                *sum += bin.norm_sqr();
            }
            segments += 1.0;
        }
        if segments == 0.0 {
            return None;
        }
        let last = density.len() - 1;
        for (i, density) in density.iter_mut().enumerate() {
            // All frequencies but the first and the last stand for their negative ones, too.
            let sides = if i == 0 || i == last { 1.0 } else { 2.0 };
            *density *= sides * sample_s / (power * segments);
        }
        Some(Self { spacing_hz: 1.0 / (SEGMENT as f64 * sample_s), density })
    }

    /// Variance of the signal (unit²): the integral of the density.
    pub fn variance(&self) -> f64 {
        self.density.iter().sum::<f64>() * self.spacing_hz
    }

    /// Frequency (Hz) and root of the density (unit per √Hz), averaged over twelfths of an octave: for drawing.
    pub fn amplitudes(&self) -> Vec<[f64; 2]> {
        let band = |i: usize| (12.0 * (i as f64).log2()).floor();
        let indices: Vec<usize> = (1..self.density.len()).collect();
        let bands = indices.chunk_by(|&a, &b| band(a) == band(b));
        bands
            .map(|band| {
                let sum: f64 = band.iter().map(|&i| self.density[i]).sum();
                let middle = band.iter().sum::<usize>() as f64 / band.len() as f64;
                [middle * self.spacing_hz, (sum / band.len() as f64).sqrt()]
            })
            .collect()
    }

    /// Where the power lies.
    pub fn bandwidth(&self) -> Bandwidth {
        let total: f64 = self.density.iter().sum();
        let below = |share: f64| {
            let mut sum = 0.0;
            let reached = self.density.iter().position(|density| {
                sum += density;
                sum >= share * total
            });
            reached.unwrap_or(0) as f64 * self.spacing_hz
        };
        let moment: f64 = self.density.iter().enumerate().map(|(i, density)| i as f64 * density).sum();
        Bandwidth { mean_hz: moment / total * self.spacing_hz, median_hz: below(0.5), most_hz: below(0.95) }
    }
}

/// Fourier transform of [`SEGMENT`] real samples, from a complex one of half the length: its real inputs are the even
/// samples, its imaginary ones the odd samples (W. H. Press et al., *Numerical Recipes*, §12.3). The algorithm is named
/// here, because a planner would compile all algorithms into the program.
struct RealTransform {
    half: Radix4<f64>,
    /// `exp(-2πi k / SEGMENT) / 2` of `k` from 1 to `SEGMENT / 4 - 1`.
    twiddles: Vec<Complex<f64>>,
}

impl RealTransform {
    fn new() -> Self {
        let twiddle = |k: usize| {
            let angle = -2.0 * core::f64::consts::PI / SEGMENT as f64 * k as f64;
            Complex::new(angle.cos(), angle.sin()) * 0.5
        };
        Self {
            half: Radix4::new(SEGMENT / 2, FftDirection::Forward),
            twiddles: (1..SEGMENT / 4).map(twiddle).collect(),
        }
    }

    /// The transform at the frequencies from 0 to half the sampling rate.
    fn spectrum(&self, samples: &[f64]) -> Vec<Complex<f64>> {
        let mut bins: Vec<_> = samples.as_chunks().0.iter().map(|&[re, im]| Complex::new(re, im)).collect();
        self.half.process(&mut bins);
        let first = bins[0];
        bins[0] = Complex::new(first.re + first.im, 0.0);
        bins.push(Complex::new(first.re - first.im, 0.0));
        let last = bins.len() - 1;
        for (twiddle, k) in self.twiddles.iter().zip(1..) {
            let (sum, difference) = (bins[k] + bins[last - k], bins[k] - bins[last - k]);
            let re = sum.im * twiddle.re + difference.re * twiddle.im;
            let im = sum.im * twiddle.im - difference.re * twiddle.re;
            bins[k] = Complex::new(0.5 * sum.re + re, 0.5 * difference.im + im);
            bins[last - k] = Complex::new(0.5 * sum.re - re, im - 0.5 * difference.im);
        }
        bins[last / 2] = bins[last / 2].conj();
        bins
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transform_is_the_sum_that_defines_it() {
        let samples: Vec<f64> = (0..SEGMENT).map(|i| ((i * i) as f64 * 0.37).sin() + 0.1).collect();
        let found = RealTransform::new().spectrum(&samples);
        assert_eq!(found.len(), SEGMENT / 2 + 1);
        for k in [0, 1, 1234, SEGMENT / 4, SEGMENT / 4 + 1, SEGMENT / 2 - 1, SEGMENT / 2] {
            let turn = |i: usize| -2.0 * core::f64::consts::PI * ((i * k) % SEGMENT) as f64 / SEGMENT as f64;
            let terms =
                samples.iter().enumerate().map(|(i, x)| Complex::new(turn(i).cos(), turn(i).sin()) * x);
            let wanted: Complex<f64> = terms.sum();
            assert!((found[k] - wanted).norm() < 1e-9, "{k}: {} {wanted}", found[k]);
        }
    }

    #[test]
    fn a_sine_has_its_power_at_its_frequency() {
        let sine = |i: usize| 3.0 * (2.0 * core::f64::consts::PI * 12.5 * 1e-3 * i as f64).sin() + 7.0;
        let signal: Vec<f64> = (0..40_000).map(sine).collect();
        let spectrum = Spectrum::welch(&signal, 1e-3).unwrap();
        assert!((spectrum.variance() / 4.5 - 1.0).abs() < 1e-3, "{}", spectrum.variance());
        let Bandwidth { mean_hz, median_hz, most_hz } = spectrum.bandwidth();
        for frequency in [mean_hz, median_hz, most_hz] {
            assert!((frequency - 12.5).abs() < 2.0 * spectrum.spacing_hz, "{frequency}");
        }
    }

    #[test]
    fn white_noise_is_flat_and_keeps_its_variance() {
        // A linear congruential sequence (Knuth's MMIX): white enough for this.
        let mut seed = 1u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let signal: Vec<f64> = (0..400_000).map(|_| next()).collect();
        let spectrum = Spectrum::welch(&signal, 1e-3).unwrap();
        assert!((spectrum.variance() * 12.0 - 1.0).abs() < 0.02);
        let bandwidth = spectrum.bandwidth();
        assert!((bandwidth.mean_hz - 250.0).abs() < 3.0 && (bandwidth.most_hz - 475.0).abs() < 3.0);
        assert_eq!(Spectrum::welch(&signal[..SEGMENT - 1], 1e-3), None);
    }
}
