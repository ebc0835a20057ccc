//! Numbers formatted for people to read.
//!
//! ```
//! use upright_design::number::significant;
//!
//! assert_eq!(significant(0.0123456, 3), "0.0123");
//! assert_eq!(significant(1.5e-9, 3), "1.5e-9");
//! ```

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
/// origin plus rounding error and is shown as 0. An imaginary part below 1e-30 of the pole is the rounding error of
/// equal real poles, and is left out.
pub fn poles(poles: &[[f64; 2]], digits: usize) -> Vec<String> {
    let text = |&[re, im]: &[f64; 2]| {
        if re.hypot(im) < 1e-60 {
            Some("0".to_owned())
        } else if im.abs() < 1e-30 * re.abs() {
            Some(significant(re, digits))
        } else {
            (im > 0.0).then(|| format!("{}±{}i", significant(re, digits), significant(im, digits)))
        }
    };
    poles.iter().filter_map(text).collect()
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

    #[test]
    fn equal_real_poles_have_no_imaginary_part() {
        let equal = [[-4.0, 2.0914e-38], [-4.0, -2.0914e-38], [-4.0, 0.0], [-4.0, 1e-7], [-4.0, -1e-7]];
        assert_eq!(poles(&equal, 3), ["-4", "-4", "-4", "-4±1e-7i"]);
    }
}
