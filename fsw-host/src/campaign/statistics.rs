//! Statistics with their uncertainty: shares, percentiles, rank correlation.

/// Two-sided 95 % quantile of the normal law.
const Z_95: f64 = 1.959_963_984_540_054;

/// A share of runs with its 95 % bounds, percent.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Share {
    /// Percent of the runs.
    pub value: f64,
    /// Lower 95 % bound.
    pub low: f64,
    /// Upper 95 % bound.
    pub high: f64,
}

/// The share `hits` of `of` with the bounds of Wilson (1927), J. Amer. Statist. Assoc. 22, 209.
#[must_use]
pub fn wilson(hits: u64, of: u64) -> Option<Share> {
    if of == 0 {
        return None;
    }
    let (n, z2) = (of as f64, Z_95 * Z_95);
    let p = hits as f64 / n;
    let centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z_95 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    // At the ends the formula gives them exactly, less rounding.
    let low = if hits == 0 { 0.0 } else { (centre - half).max(0.0) };
    let high = if hits == of { 1.0 } else { (centre + half).min(1.0) };
    Some(Share { value: 100.0 * p, low: 100.0 * low, high: 100.0 * high })
}

/// A percentile with the 95 % bounds that order statistics give without any assumption on the law.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Percentile {
    /// Estimate, interpolated between the two nearest order statistics.
    pub value: f64,
    /// Lower bound; none when the sample is too small to have one.
    pub low: Option<f64>,
    /// Upper bound; none when the sample is too small to have one.
    pub high: Option<f64>,
}

impl Percentile {
    /// Lower and upper bound.
    #[must_use]
    pub fn bounds(&self) -> [Option<f64>; 2] {
        [self.low, self.high]
    }
}

/// The quantile `q` of an ascending sample.
#[must_use]
pub fn percentile(sorted: &[f64], q: f64) -> Option<Percentile> {
    let value = quantile(sorted, q)?;
    let (low, high) = bounding_ranks(sorted.len(), q);
    let at = |rank: Option<usize>| rank.and_then(|rank| sorted.get(rank)).copied();
    Some(Percentile { value, low: at(low), high: at(high) })
}

/// The quantile `q` of an ascending sample, linear between order statistics.
#[must_use]
pub fn quantile(sorted: &[f64], q: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let position = q.clamp(0.0, 1.0) * last as f64;
    let below = position.floor() as usize;
    let (a, b) = (sorted.get(below)?, sorted.get((below + 1).min(last))?);
    Some(a + (position - below as f64) * (b - a))
}

/// Indices (from 0) of the order statistics that bound a quantile with at least 97.5 % on each side: the largest with
/// P(B ≤ index) ≤ 2.5 % and the smallest with P(B ≤ index) ≥ 97.5 %, B binomial (n, q) the number of values below it.
/// Source: Conover, Practical Nonparametric Statistics, confidence interval of a quantile.
fn bounding_ranks(n: usize, q: f64) -> (Option<usize>, Option<usize>) {
    let (mut low, mut high) = (None, None);
    let mut below = 0.0;
    for k in 0..n {
        below += binomial(n, k, q);
        if below <= 0.025 {
            low = Some(k);
        }
        if below >= 0.975 {
            high = Some(k);
            break;
        }
    }
    (low, high)
}

/// Probability of `k` hits of `n`, by the logarithm of the gamma function.
fn binomial(n: usize, k: usize, q: f64) -> f64 {
    if q <= 0.0 || q >= 1.0 {
        return f64::from(u8::from((q <= 0.0 && k == 0) || (q >= 1.0 && k == n)));
    }
    let (n, k) = (n as f64, k as f64);
    let choose = libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
    (choose + k * q.ln() + (n - k) * (-q).ln_1p()).exp()
}

/// The values that are there, ascending.
#[must_use]
pub fn ascending(values: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Mean of a sample.
#[must_use]
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation of a sample about its mean.
#[must_use]
pub fn deviation(values: &[f64]) -> Option<f64> {
    let mean = mean(values)?;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}

/// Rank correlation of Spearman; none when either side does not vary.
#[must_use]
pub fn spearman(x: &[f64], y: &[f64]) -> Option<f64> {
    pearson(&ranks(x), &ranks(y))
}

/// Correlation of two samples of one length.
#[must_use]
pub fn pearson(x: &[f64], y: &[f64]) -> Option<f64> {
    let (mx, my) = (mean(x)?, mean(y)?);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (a, b) in x.iter().zip(y) {
        xx += (a - mx) * (a - mx);
        yy += (b - my) * (b - my);
        xy += (a - mx) * (b - my);
    }
    (xx > 0.0 && yy > 0.0).then(|| xy / (xx * yy).sqrt())
}

/// Rank of every value, ties sharing their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut from = 0;
    while from < order.len() {
        let tied = order[from..].iter().take_while(|i| values[**i] == values[order[from]]).count();
        let rank = from as f64 + 0.5 * (tied - 1) as f64;
        order[from..from + tied].iter().for_each(|i| ranks[*i] = rank);
        from += tied;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_of_a_share_are_those_of_the_published_example() {
        // Newcombe (1998), Statist. Med. 17, 857, table I, method 3: 81/263 and 1/29.
        let share = wilson(81, 263).unwrap();
        assert!((share.low - 25.53).abs() < 0.01 && (share.high - 36.62).abs() < 0.01, "{share:?}");
        let share = wilson(1, 29).unwrap();
        assert!((share.low - 0.61).abs() < 0.01 && (share.high - 17.18).abs() < 0.01, "{share:?}");
        assert_eq!(wilson(0, 0), None);
        assert_eq!(wilson(7, 7).unwrap().high, 100.0);
        assert_eq!(wilson(0, 7).unwrap().low, 0.0);
    }

    #[test]
    fn the_bounds_of_a_median_of_a_hundred_are_the_40th_and_61st_value() {
        // Conover, Practical Nonparametric Statistics: n = 100, p = 0.5 at 95 %.
        let sorted: Vec<f64> = (1..=100).map(f64::from).collect();
        let median = percentile(&sorted, 0.5).unwrap();
        assert_eq!((median.value, median.low, median.high), (50.5, Some(40.0), Some(61.0)));
        let far = percentile(&sorted, 0.99).unwrap();
        assert_eq!(far.high, None);
        assert!(far.low.is_some_and(|low| low >= 95.0));
        assert_eq!(percentile(&[], 0.5), None);
    }

    #[test]
    fn bounds_hold_the_true_quantile_at_least_as_often_as_they_say() {
        let mut stream = hil_sim::noise::Stream::new(3, 0, "percentile bounds");
        let inside = (0..400).filter(|_| {
            let mut sample: Vec<f64> = (0..200).map(|_| stream.uniform()).collect();
            sample.sort_by(f64::total_cmp);
            let p = percentile(&sample, 0.9).unwrap();
            p.low.is_none_or(|low| low <= 0.9) && p.high.is_none_or(|high| high >= 0.9)
        });
        // 95 % of 400 less three standard deviations.
        assert!(inside.count() >= 367);
    }

    #[test]
    fn rank_correlation_sees_any_monotonic_relation_and_shares_ties() {
        let x = [1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!(spearman(&x, &x.map(|v: f64| v.exp())), Some(1.0));
        assert_eq!(spearman(&x, &[9.0, 7.0, 5.0, 5.0, 5.0]).map(|r| r < -0.8), Some(true));
        assert_eq!(spearman(&x, &[2.0; 5]), None);
        assert_eq!(ranks(&[3.0, 1.0, 3.0]), [1.5, 0.0, 1.5]);
    }
}
