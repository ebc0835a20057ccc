//! Numbers as the page shows them.

use upright_design::number;

/// `digits` significant digits, with a power of ten for what is very large or very small.
pub(super) fn significant(x: f64, digits: usize) -> String {
    typeset(&number::significant(x, digits))
}

/// Three significant digits.
pub(super) fn number(x: f64) -> String {
    significant(x, 3)
}

/// Poles, each conjugate pair once.
pub(super) fn poles(poles: &[[f64; 2]], digits: usize) -> Vec<String> {
    number::poles(poles, digits).iter().map(|pole| typeset(pole)).collect()
}

/// Typesets minus signs and powers of ten.
fn typeset(plain: &str) -> String {
    let (mut text, mut raised) = (String::new(), false);
    for symbol in plain.chars() {
        let digit = symbol.to_digit(10).and_then(|digit| RAISED.get(digit as usize));
        raised &= symbol == '-' || digit.is_some();
        match (symbol, digit) {
            ('e', _) => {
                text.push_str("·10");
                raised = true;
            }
            ('-', _) => text.push(if raised { '⁻' } else { '−' }),
            ('±', _) => text.push_str(" ± "),
            (_, Some(&digit)) if raised => text.push(digit),
            _ => text.push(symbol),
        }
    }
    text
}

const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_typeset() {
        assert_eq!(number(1234.5), "1230");
        assert_eq!(number(-0.012345), "−0.0123");
        assert_eq!(number(1.5e-9), "1.5·10⁻⁹");
        assert_eq!(number(1e-75), "1·10⁻⁷⁵");
        assert_eq!(number(0.0), "0");
        let pair = [[0.5, -0.25], [0.5, 0.25], [-5e-154, 0.0], [-2e-5, 1e7]];
        assert_eq!(poles(&pair, 3), ["0.5 ± 0.25i", "0", "−2·10⁻⁵ ± 1·10⁷i"]);
    }
}
