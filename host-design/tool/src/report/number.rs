//! Numbers for reading.

/// `digits` significant digits, with a power of ten for what is very large or very small.
pub(super) fn significant(x: f64, digits: usize) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    if (1e-4..1e6).contains(&rounded.abs()) {
        return minus(rounded.to_string());
    }
    let text = format!("{rounded:e}");
    let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
    let raised = |sign: char| match sign {
        '-' => '⁻',
        digit => RAISED[digit.to_digit(10).unwrap_or(0) as usize],
    };
    format!("{}·10{}", minus(digits.to_owned()), power.chars().map(raised).collect::<String>())
}

const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// Three significant digits.
pub(super) fn number(x: f64) -> String {
    significant(x, 3)
}

/// A pole, and its conjugate if there is one. A rounding residue of a pole at the origin is shown as zero.
pub(super) fn pole([re, im]: [f64; 2], digits: usize) -> String {
    if re.hypot(im) < 1e-60 {
        return "0".to_owned();
    }
    if im == 0.0 {
        return significant(re, digits);
    }
    format!("{} ± {}i", significant(re, digits), significant(im.abs(), digits))
}

/// With a typographic minus sign.
fn minus(text: String) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_to_significant_digits() {
        assert_eq!(number(1234.5), "1230");
        assert_eq!(number(-0.012345), "−0.0123");
        assert_eq!(number(1.5e-9), "1.5·10⁻⁹");
        assert_eq!(number(1e-75), "1·10⁻⁷⁵");
        assert_eq!(number(0.0), "0");
        assert_eq!(pole([0.5, -0.25], 3), "0.5 ± 0.25i");
        assert_eq!(pole([-5e-154, 0.0], 3), "0");
    }
}
