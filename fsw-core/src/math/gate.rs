//! Innovation gates: is a measurement plausible, given what the filter expects of it?

use super::fun::sqrt;
use super::num::abs;

/// Verdict of a gate on one scalar innovation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// Innovation over its standard deviation, with sign; 0 when it could not be formed.
    pub ratio: f64,
    /// True when the measurement may be used.
    pub accepted: bool,
}

/// Gates a scalar innovation at `gate_sigma` standard deviations; `variance` is the filter's own innovation variance.
///
/// A variance that is not positive, or any number that is not finite, is rejected with ratio 0.
#[must_use]
pub fn sigma_gate(innovation: f64, variance: f64, gate_sigma: f64) -> Gate {
    let usable = innovation.is_finite() && variance > 0.0 && variance.is_finite();
    let ratio = if usable { innovation / sqrt(variance) } else { 0.0 };
    Gate { ratio, accepted: usable && abs(ratio) <= gate_sigma }
}

/// Gates the normalised square of a vector innovation (νᵀ S⁻¹ ν) of `dimension` components: accepted when it is not above the
/// chi-square quantile with the same one-sided normal deviate `deviate` (3.09 for 99.9 %).
#[must_use]
pub fn chi_square_gate(normalised_square: f64, dimension: u8, deviate: f64) -> bool {
    normalised_square >= 0.0 && normalised_square <= chi_square_quantile(dimension, deviate)
}

/// Quantile of the chi-square distribution with `dimension` degrees of freedom at the standard-normal deviate `deviate`
/// (one-sided: 1.645 is 95 %), by Wilson and Hilferty's cube: within 4 % of the exact value for 1 to 30 degrees at 95–99.9 %.
#[must_use]
pub fn chi_square_quantile(dimension: u8, deviate: f64) -> f64 {
    if dimension == 0 {
        return 0.0;
    }
    let k = f64::from(dimension);
    let spread = 2.0 / (9.0 * k);
    let root = 1.0 - spread + deviate * sqrt(spread);
    k * root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gate_opens_at_its_limit_and_keeps_the_sign() {
        assert_eq!(sigma_gate(-6.0, 4.0, 3.0), Gate { ratio: -3.0, accepted: true });
        assert_eq!(sigma_gate(6.1, 4.0, 3.0), Gate { ratio: 3.05, accepted: false });
    }

    #[test]
    fn what_cannot_be_judged_is_rejected() {
        for (innovation, variance) in [(f64::NAN, 1.0), (1.0, 0.0), (1.0, -1.0), (1.0, f64::NAN), (1.0, f64::INFINITY)]
        {
            assert_eq!(sigma_gate(innovation, variance, 5.0), Gate { ratio: 0.0, accepted: false });
        }
        assert!(!sigma_gate(0.0, 1.0, f64::NAN).accepted);
        assert!(!chi_square_gate(f64::NAN, 3, 3.0) && !chi_square_gate(-1.0, 3, 3.0));
    }

    #[test]
    fn chi_square_quantiles_are_within_four_percent_of_the_tables() {
        // Standard tables: (degrees of freedom, one-sided deviate, quantile) at 95 %, 99 % and 99.9 %.
        let tabulated = [
            (1, 1.6449, 3.841),
            (2, 1.6449, 5.991),
            (6, 1.6449, 12.592),
            (30, 1.6449, 43.773),
            (1, 2.3263, 6.635),
            (6, 2.3263, 16.812),
            (1, 3.0902, 10.828),
            (3, 3.0902, 16.266),
            (6, 3.0902, 22.458),
        ];
        for (dimension, deviate, exact) in tabulated {
            let quantile = chi_square_quantile(dimension, deviate);
            assert!((quantile / exact - 1.0).abs() < 0.04, "{dimension} {deviate}: {quantile} for {exact}");
        }
        assert!(chi_square_gate(12.0, 6, 1.6449) && !chi_square_gate(13.2, 6, 1.6449));
    }
}
