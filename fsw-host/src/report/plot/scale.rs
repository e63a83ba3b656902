//! Axes: ranges that fit the data, ticks at 1, 2, 5 · 10ⁿ, labels with the digits that the step needs.

use super::{Layer, Panel, Point, finite};

/// An axis: what it shows, and which part must or may be seen.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// The exact range, if it is not fitted to the data.
    pub fixed: Option<(f64, f64)>,
    /// Values that must be inside the fitted range.
    pub include: Vec<f64>,
    /// The fitted range is symmetric about zero.
    pub symmetric: bool,
    /// Ticks at multiples of this step (degrees like 30 or 45).
    pub step: Option<f64>,
    /// The whole axis is drawn without labels (a panel above another of the same x).
    pub silent: bool,
    /// Values have the other sign of what the labels show: the axis runs backwards.
    pub negated: bool,
    /// Values are decimal logarithms: labels show the numbers.
    pub decades: bool,
}

impl Axis {
    /// An axis fitted to the data.
    #[must_use]
    pub fn fit(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// An axis with a given range.
    #[must_use]
    pub fn fixed(label: impl Into<String>, from: f64, to: f64) -> Self {
        Self { fixed: Some((from, to)), ..Self::fit(label) }
    }

    /// The fitted range contains this value.
    #[must_use]
    pub fn including(mut self, value: f64) -> Self {
        self.include.push(value);
        self
    }

    /// The fitted range is symmetric about zero.
    #[must_use]
    pub const fn symmetric(mut self) -> Self {
        self.symmetric = true;
        self
    }

    /// Ticks at multiples of `step`.
    #[must_use]
    pub const fn every(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Values are decimal logarithms, ticks at powers of ten.
    #[must_use]
    pub const fn decades(mut self) -> Self {
        self.decades = true;
        self.step = Some(1.0);
        self
    }

    /// Values are given with the other sign, so that the axis runs backwards.
    #[must_use]
    pub const fn negated(mut self) -> Self {
        self.negated = true;
        self
    }

    /// The label of one of the `ticks`.
    #[must_use]
    pub fn label_of(&self, value: f64, ticks: &[f64]) -> String {
        if self.silent {
            String::new()
        } else if self.decades {
            let exponent = value.round();
            number(10f64.powf(exponent), (-exponent).clamp(0.0, 9.0) as usize)
        } else {
            tick_label(if self.negated { -value } else { value }, ticks)
        }
    }

    /// No tick labels and no title.
    #[must_use]
    pub const fn silent(mut self) -> Self {
        self.silent = true;
        self
    }

    /// The range to draw, from the data's values on this axis.
    #[must_use]
    pub fn range(&self, values: impl Iterator<Item = f64>) -> (f64, f64) {
        if let Some((from, to)) = self.fixed.filter(|(a, b)| a.is_finite() && b.is_finite() && b > a) {
            return (from, to);
        }
        let all = values.chain(self.include.iter().copied()).filter(|v| v.is_finite());
        let (mut low, mut high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if self.symmetric {
            high = low.abs().max(high.abs());
            low = -high;
        }
        // A flat curve still needs a height; a curve that fills the height exactly looks cut off.
        let flat = high - low < 1e-9 * high.abs().max(1.0);
        let pad = if flat { 0.5 * high.abs().max(1.0) } else { 0.05 * (high - low) };
        let touches_zero = |v: f64| v == 0.0 && !flat && !self.symmetric;
        (if touches_zero(low) { low } else { low - pad }, if touches_zero(high) { high } else { high + pad })
    }

    /// Ticks inside a range, about `count` of them.
    #[must_use]
    pub fn ticks(&self, (from, to): (f64, f64), count: usize) -> Vec<f64> {
        let fitting = self.step.filter(|s| *s > 0.0 && (to - from) / s <= 2.0 * count as f64 + 2.0);
        let at = |step: f64| -> Vec<f64> {
            let first = (from / step - 1e-9).ceil();
            let ticks = (0..=8 * count).map(|i| (first + i as f64) * step);
            ticks.take_while(|tick| *tick <= to + 1e-9 * step).map(|t| if t == 0.0 { 0.0 } else { t }).collect()
        };
        if let Some(step) = fitting {
            return at(step);
        }
        // An axis with fewer than three ticks cannot be read: the next finer steps then.
        let raw = (to - from) / count.max(1) as f64;
        let steps = [1.0, 0.5, 0.25].map(|share| nice_step(share * raw));
        steps.into_iter().map(at).find(|ticks| ticks.len() > 2).unwrap_or_else(|| at(nice_step(0.25 * raw)))
    }
}

/// The smallest of 1, 2, 5 · 10ⁿ that is not below `raw`.
fn nice_step(raw: f64) -> f64 {
    if !(raw.is_finite() && raw > 0.0) {
        return 1.0;
    }
    let decade = 10f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|s| *s >= raw * 0.999).unwrap_or(10.0 * decade)
}

/// A tick label: no more digits than neighbouring ticks need to differ.
fn tick_label(value: f64, ticks: &[f64]) -> String {
    let step = ticks.windows(2).map(|w| (w[1] - w[0]).abs()).fold(f64::INFINITY, f64::min);
    let largest = ticks.iter().fold(0.0f64, |m, t| m.max(t.abs()));
    if largest >= 1e6 {
        return format!("{value:.1e}");
    }
    let digits = if step.is_finite() && step > 0.0 { (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) } else { 1.0 };
    number(value, digits as usize)
}

/// A number with thin spaces between thousands and a true minus sign; a dash for what is not a number.
#[must_use]
pub fn number(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{:.*}", digits, value.abs());
    let (whole, fraction) = text.split_once('.').map_or((text.as_str(), None), |(w, f)| (w, Some(f)));
    let mut grouped = String::new();
    for (i, c) in whole.chars().enumerate() {
        if i > 0 && whole.len() > 4 && (whole.len() - i).is_multiple_of(3) {
            grouped.push('\u{202f}');
        }
        grouped.push(c);
    }
    let is_zero = text.chars().all(|c| matches!(c, '0' | '.'));
    let sign = if value < 0.0 && !is_zero { "−" } else { "" };
    fraction.map_or_else(|| format!("{sign}{grouped}"), |f| format!("{sign}{grouped}.{f}"))
}

/// All values that a fitted axis must show: `pick` chooses x or y.
pub fn values<'a>(panel: &'a Panel, pick: &'a dyn Fn(&Point) -> f64) -> impl Iterator<Item = f64> + 'a {
    panel.layers.iter().flat_map(move |layer| -> Box<dyn Iterator<Item = f64> + 'a> {
        match layer {
            Layer::Line { points, .. } | Layer::Dots { points, .. } | Layer::Area { corners: points, .. } => {
                Box::new(points.iter().filter(|p| finite(p)).map(pick))
            }
            Layer::Band { edges, .. } => Box::new(
                edges.iter().flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]).filter(finite).map(|p| pick(&p)),
            ),
            _ => Box::new(std::iter::empty()),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::fit("");
        assert_eq!(axis.ticks((0.0, 10.0), 5), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(axis.ticks((-0.13, 0.13), 3), [-0.1, 0.0, 0.1]);
        assert_eq!(axis.clone().every(45.0).ticks((-100.0, 100.0), 5), [-90.0, -45.0, 0.0, 45.0, 90.0]);
    }

    #[test]
    fn a_range_is_never_empty() {
        for values in [vec![], vec![3.0], vec![f64::NAN], vec![0.0, 0.0], vec![1e12, 1e12]] {
            let (from, to) = Axis::fit("").range(values.clone().into_iter());
            assert!(to > from, "{values:?} gave {from}..{to}");
        }
    }

    #[test]
    fn labels_have_the_digits_that_the_step_needs() {
        assert_eq!(tick_label(0.5, &[0.0, 0.5]), "0.5");
        assert_eq!(tick_label(-200.0, &[-200.0, 0.0]), "−200");
        assert_eq!(number(12345.6, 1), "12\u{202f}345.6");
        assert_eq!(number(-0.04, 1), "0.0");
        assert_eq!(number(f64::NAN, 1), "–");
    }
}
