//! A printed number compared with ours.

use serde::Serialize;

/// Number of digits that the paper prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Digits {
    /// Digits after the decimal point.
    Decimals(usize),
    /// Significant digits.
    Significant(usize),
}

/// How ours compares with what is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// Rounded to as many digits as printed, it is the same number.
    EveryDigit,
    /// Rounded to as many digits as printed, it differs by this many units of the last printed digit.
    UnitsOfLastDigit(u64),
    /// The paper does not print it.
    NotPrinted,
}

/// One line of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedValue {
    /// What it is, as in `A[2,3]` (counted from 1) or `K[9] of the LQR`, with its unit if it has a simple one.
    pub quantity: String,
    /// What ours was computed from.
    pub from: &'static str,
    /// As the paper prints it, without insignificant zeros.
    pub printed: Option<&'static str>,
    /// Ours, in SI units.
    pub ours: f64,
    /// Ours minus the printed number.
    pub deviation: Option<f64>,
    /// How they compare.
    pub verdict: Agreement,
}

impl ComparedValue {
    /// Compares `ours` with a number that the paper prints to this many `digits`.
    pub fn printed(
        quantity: impl Into<String>,
        from: &'static str,
        printed: &'static str,
        digits: Digits,
        ours: f64,
    ) -> Self {
        let value = value_of(printed);
        let unit = digits.unit(value);
        let units = ((digits.round(ours) - value) / unit).abs().round();
        let verdict =
            if units == 0.0 { Agreement::EveryDigit } else { Agreement::UnitsOfLastDigit(units as u64) };
        Self {
            quantity: quantity.into(),
            from,
            printed: Some(printed),
            ours,
            deviation: Some(ours - value),
            verdict,
        }
    }

    /// A number that follows from the paper's formulas but is not printed in it.
    pub fn not_printed(quantity: impl Into<String>, from: &'static str, ours: f64) -> Self {
        let quantity = quantity.into();
        Self { quantity, from, printed: None, ours, deviation: None, verdict: Agreement::NotPrinted }
    }

    /// Whether every printed digit came out.
    pub fn is_exact(&self) -> bool {
        self.verdict == Agreement::EveryDigit
    }
}

/// The value of a number printed as text; NaN if the text is not a number.
pub(crate) fn value_of(text: &str) -> f64 {
    text.parse().unwrap_or(f64::NAN)
}

impl Digits {
    /// `value` with as many digits as printed.
    fn round(self, value: f64) -> f64 {
        value_of(&match self {
            Digits::Decimals(decimals) => format!("{value:.decimals$}"),
            Digits::Significant(digits) => format!("{value:.*e}", digits.saturating_sub(1)),
        })
    }

    /// The weight of the last printed digit of `value`.
    fn unit(self, value: f64) -> f64 {
        match self {
            Digits::Decimals(decimals) => 0.1f64.powi(decimals as i32),
            Digits::Significant(digits) => {
                let leading = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
                10f64.powf(leading - digits as f64 + 1.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_agrees_up_to_half_a_unit_of_its_last_printed_digit() {
        let verdict = |ours| ComparedValue::printed("K", "", "-578.51", Digits::Decimals(2), ours).verdict;
        assert_eq!(verdict(-578.5051), Agreement::EveryDigit);
        assert_eq!(verdict(-578.5049), Agreement::UnitsOfLastDigit(1));
        assert_eq!(verdict(578.51), Agreement::UnitsOfLastDigit(115_702));
        let verdict =
            |ours| ComparedValue::printed("A", "", "-1659.85", Digits::Significant(6), ours).verdict;
        assert_eq!(verdict(-1659.852), Agreement::EveryDigit);
        assert_eq!(verdict(-1659.862), Agreement::UnitsOfLastDigit(1));
    }
}
