//! Numbers formatted for people to read.

/// `x` rounded to `digits` significant digits.
pub fn rounded(x: f64, digits: usize) -> f64 {
    format!("{x:.*e}", digits.saturating_sub(1)).parse().unwrap_or(x)
}

/// `x` as text with `digits` significant digits; in exponent form if its magnitude is below 1e-4 or at least 1e6.
pub fn significant(x: f64, digits: usize) -> String {
    let rounded = rounded(x, digits);
    if rounded == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// Poles `[re, im]` as text, each conjugate pair once, as `re±imi`. A pole of magnitude below 1e-60 is a pole at the
/// origin plus rounding error and is shown as 0.
pub fn poles(poles: &[[f64; 2]], digits: usize) -> Vec<String> {
    let upper = poles.iter().filter(|pole| pole[1] >= 0.0);
    upper
        .map(|&[re, im]| {
            if re.hypot(im) < 1e-60 {
                "0".to_owned()
            } else if im == 0.0 {
                significant(re, digits)
            } else {
                format!("{}±{}i", significant(re, digits), significant(im, digits))
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_to_significant_digits() {
        assert_eq!(significant(1234.5, 3), "1230");
        assert_eq!(significant(-0.012345, 3), "-0.0123");
        assert_eq!(significant(1.5e-9, 3), "1.5e-9");
        assert_eq!(significant(1e-75, 3), "1e-75");
        assert_eq!(significant(999_999.9, 3), "1e6");
        assert_eq!(significant(0.0, 3), "0");
    }

    #[test]
    fn a_conjugate_pair_is_named_once() {
        assert_eq!(
            poles(&[[0.5, 0.25], [0.5, -0.25], [-5e-154, 0.0], [0.9, 0.0]], 3),
            ["0.5±0.25i", "0", "0.9"]
        );
    }
}
