//! [`Weights`]: how much each expert of a bank is believed, by one of five rules.
//!
//! | rule | source | what it remembers |
//! |---|---|---|
//! | [`Rule::Gating`] | P3 eqs. 17, 23–25 (Chaer, Bishop, Ghosh 1997) on readings brought to order one | a slope aᵢ for each expert |
//! | [`Rule::BareGating`] | the same as it is printed, exponentials and densities as they are | the same |
//! | [`Rule::BareProduct`] | Magill 1965 as it is printed: wᵢ ← wᵢ pᵢ | the product |
//! | [`Rule::Bayes`] | Magill in logarithms, with a floor if wanted | ln wᵢ |
//! | [`Rule::Switching`] | interacting multiple model (Blom, Bar-Shalom 1988), equal chances of a switch | ln wᵢ |
//!
//! The two bare rules are there to be compared with: they leave the range of numbers within seconds. They say so by a
//! [`WeightError`], at which the last sound weights stay, and every update after it is refused. No weight is ever a NaN.

use crate::math::fun::{exp, ln};
use crate::slot::Slot;

/// Readings that a gating network looks at: P3's dynamic pressure, three forces, range and range-rate.
pub const CHANNELS: usize = 6;

/// Readings of an instant as a gating network sees them; those that are not there are zero.
pub type Channels = [f64; CHANNELS];

/// How weights follow from densities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// Softmax of a linear map of the readings, which learns by gradient.
    Gating {
        /// Learning rate η, above zero.
        rate: f64,
    },
    /// The same without a logarithm and without care.
    BareGating {
        /// Learning rate η, above zero.
        rate: f64,
    },
    /// Product of densities, never normalised.
    BareProduct,
    /// Bayes' rule.
    Bayes {
        /// Smaller weights are raised to it: 0 and more, less than 1 over the number of experts.
        floor: f64,
    },
    /// Bayes' rule for a truth that may switch from expert to expert.
    Switching {
        /// Probability that it does not in a step: from 1 over the number of experts to 1.
        stay: f64,
    },
}

/// Why there are no weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WeightError {
    /// The rule's constant is out of its range.
    BadRule,
    /// A sum of exponentials or products is beyond the largest number.
    Overflow,
    /// All of them are below the smallest number.
    Underflow,
    /// A density, a reading or a slope is not finite.
    NotFinite,
    /// No expert is left.
    NoExpert,
}

impl core::fmt::Display for WeightError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::BadRule => "the constant of the weights' rule is out of range",
            Self::Overflow => "the weights have left the range of numbers upwards",
            Self::Underflow => "the weights have left the range of numbers downwards",
            Self::NotFinite => "a density or a reading is not finite",
            Self::NoExpert => "no expert of the bank is left",
        })
    }
}

impl core::error::Error for WeightError {}

/// Weights of `K` experts, which sum to one.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights<const K: usize> {
    rule: Rule,
    present: [bool; K],
    weights: [f64; K],
    /// ln wᵢ; of the bare product, the product itself.
    memory: [f64; K],
    slopes: [Channels; K],
    failure: Slot<WeightError>,
}

impl<const K: usize> Weights<K> {
    /// Of no expert, all zero bytes: stands where no bank has begun yet.
    pub const NONE: Self = Self {
        rule: Rule::Gating { rate: 0.0 },
        present: [false; K],
        weights: [0.0; K],
        memory: [0.0; K],
        slopes: [[0.0; CHANNELS]; K],
        failure: Slot::Empty,
    };

    /// Equal weights for the first `count` of the `K` experts; the others are not there.
    ///
    /// # Errors
    /// `count` is 0 or above `K`, or the rule's constant is out of range.
    pub fn new(rule: Rule, count: usize) -> Result<Self, WeightError> {
        if count == 0 || count > K {
            return Err(WeightError::NoExpert);
        }
        let share = 1.0 / as_f64(count);
        let is_sound = match rule {
            Rule::Gating { rate } | Rule::BareGating { rate } => rate > 0.0 && rate.is_finite(),
            Rule::BareProduct => true,
            Rule::Bayes { floor } => (0.0..share).contains(&floor),
            Rule::Switching { stay } => (share..=1.0).contains(&stay),
        };
        if !is_sound {
            return Err(WeightError::BadRule);
        }
        let mut present = [false; K];
        present.iter_mut().take(count).for_each(|p| *p = true);
        let weights = present.map(|is| if is { share } else { 0.0 });
        let memory = if rule == Rule::BareProduct { weights } else { weights.map(ln) };
        Ok(Self { rule, present, weights, memory, slopes: [[0.0; CHANNELS]; K], failure: Slot::Empty })
    }

    /// The weights: of experts that are not there, zero.
    #[must_use]
    pub const fn values(&self) -> &[f64; K] {
        &self.weights
    }

    /// Whether an expert is there.
    #[must_use]
    pub fn is_present(&self, expert: usize) -> bool {
        self.present.get(expert).copied().unwrap_or(false)
    }

    /// Why there are no weights any more.
    #[must_use]
    pub const fn failure(&self) -> Option<WeightError> {
        self.failure.get().copied()
    }

    /// An expert is out for good; the others share its weight in proportion.
    pub fn retire(&mut self, expert: usize) {
        if let Some(present) = self.present.get_mut(expert) {
            *present = false;
        }
        let left = |all: &[f64; K], present: &[bool; K]| -> f64 {
            all.iter().zip(present).map(|(w, is)| if *is { *w } else { 0.0 }).sum()
        };
        let sum = left(&self.weights, &self.present);
        let share = 1.0 / as_f64(self.count());
        for (weight, present) in self.weights.iter_mut().zip(&self.present) {
            *weight = match (*present, sum > 0.0) {
                (false, _) => 0.0,
                (true, true) => *weight / sum,
                (true, false) => share,
            };
        }
        if self.count() == 0 {
            self.failure.put(WeightError::NoExpert);
        }
    }

    /// Takes in the logarithms of the densities with which the experts expected what was read, and the readings themselves
    /// (for the gating rules alone).
    ///
    /// # Errors
    /// There are no weights from here on; [`Self::values`] keeps the last ones.
    pub fn update(&mut self, log_densities: &[f64; K], channels: &Channels) -> Result<(), WeightError> {
        if let Some(failure) = self.failure() {
            return Err(failure);
        }
        let outcome = self.after(log_densities, channels);
        match outcome {
            Ok(weights) => self.weights = weights,
            Err(failure) => self.failure.put(failure),
        }
        outcome.map(|_| ())
    }

    /// How much of expert `j` remains of it when the truth may have switched: λ in mixture = λ·(expert) + (1 − λ)·(fused).
    ///
    /// The mixing of the interacting multiple model, μᵢⱼ = πᵢⱼ wᵢ / cⱼ, with πᵢᵢ = s and πᵢⱼ = ε for all others: as the
    /// off-diagonal is one number, the mixture over all experts is one of the expert with the fused estimate.
    #[must_use]
    pub fn kept(&self, expert: usize) -> f64 {
        let Rule::Switching { stay } = self.rule else { return 1.0 };
        let switch = self.switch(stay);
        let weight = self.weights.get(expert).copied().unwrap_or(0.0);
        let predicted = (stay - switch) * weight + switch;
        if predicted > 0.0 { (stay - switch) * weight / predicted } else { 1.0 }
    }

    fn count(&self) -> usize {
        self.present.iter().filter(|is| **is).count()
    }

    /// Probability ε of a switch to each of the others.
    fn switch(&self, stay: f64) -> f64 {
        if self.count() > 1 { (1.0 - stay) / as_f64(self.count() - 1) } else { 0.0 }
    }

    fn after(&mut self, densities: &[f64; K], channels: &Channels) -> Result<[f64; K], WeightError> {
        let is_number = |l: &f64| !l.is_nan() && *l < f64::INFINITY;
        let present = self.present;
        if !densities.iter().zip(&present).all(|(l, is)| !is || is_number(l)) {
            return Err(WeightError::NotFinite);
        }
        match self.rule {
            Rule::Gating { rate } => {
                let before = self.scores(channels)?;
                let g = softmax(&before, &present)?;
                let h = softmax(&sums(&before, densities), &present)?;
                self.learn(rate, &h, &g, channels);
                softmax(&self.scores(channels)?, &present)
            }
            Rule::BareGating { rate } => {
                let g = shares(&self.scores(channels)?.map(exp), &present)?;
                let mut joint = g;
                joint.iter_mut().zip(densities).for_each(|(g, l)| *g *= exp(*l));
                let h = shares(&joint, &present)?;
                self.learn(rate, &h, &g, channels);
                shares(&self.scores(channels)?.map(exp), &present)
            }
            Rule::BareProduct => {
                self.memory.iter_mut().zip(densities).for_each(|(product, l)| *product *= exp(*l));
                shares(&self.memory, &present)
            }
            Rule::Bayes { floor } => {
                let weights = softmax(&sums(&self.memory, densities), &present)?;
                let weights = raised(&weights, floor, &present);
                self.remember(&weights, floor, densities);
                Ok(weights)
            }
            Rule::Switching { stay } => {
                let switch = self.switch(stay);
                let predicted = self.weights.map(|w| ln((stay - switch) * w + switch));
                softmax(&sums(&predicted, densities), &present)
            }
        }
    }

    /// ln wᵢ for the next instant. Without a floor they go on from what they were, so that a weight below the smallest number
    /// is not lost; the largest is kept near zero.
    fn remember(&mut self, weights: &[f64; K], floor: f64, densities: &[f64; K]) {
        if floor > 0.0 {
            self.memory = weights.map(ln);
            return;
        }
        self.memory = sums(&self.memory, densities);
        let largest = largest(&self.memory, &self.present);
        self.memory.iter_mut().for_each(|l| *l -= largest);
    }

    /// uᵢ = zᵀ aᵢ, P3 eq. 17.
    fn scores(&self, channels: &Channels) -> Result<[f64; K], WeightError> {
        let scores = self.slopes.map(|slope| slope.iter().zip(channels).map(|(a, z)| a * z).sum::<f64>());
        if scores.iter().all(|u| u.is_finite()) { Ok(scores) } else { Err(WeightError::NotFinite) }
    }

    /// aᵢ ← aᵢ + η (hᵢ − gᵢ) z, P3 eq. 23 with the sign that its eq. 24 gives (printed with −a).
    fn learn(&mut self, rate: f64, h: &[f64; K], g: &[f64; K], channels: &Channels) {
        for (slope, (h, g)) in self.slopes.iter_mut().zip(h.iter().zip(g)) {
            slope.iter_mut().zip(channels).for_each(|(a, z)| *a += rate * (h - g) * z);
        }
    }
}

#[allow(clippy::cast_precision_loss, reason = "a bank has less than 2⁵³ experts")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

fn sums<const K: usize>(a: &[f64; K], b: &[f64; K]) -> [f64; K] {
    let mut sum = *a;
    sum.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    sum
}

fn largest<const K: usize>(of: &[f64; K], present: &[bool; K]) -> f64 {
    of.iter().zip(present).fold(f64::NEG_INFINITY, |m, (l, is)| if *is && *l > m { *l } else { m })
}

/// Numbers in proportion to exponentials, which sum to one; the largest is taken out before, so that none is too large.
fn softmax<const K: usize>(logs: &[f64; K], present: &[bool; K]) -> Result<[f64; K], WeightError> {
    let largest = largest(logs, present);
    if !largest.is_finite() {
        return Err(if largest > 0.0 { WeightError::NotFinite } else { WeightError::Underflow });
    }
    shares(&logs.map(|l| exp(l - largest)), present)
}

/// Numbers in proportion to these, which sum to one.
fn shares<const K: usize>(of: &[f64; K], present: &[bool; K]) -> Result<[f64; K], WeightError> {
    let mut shares = *of;
    shares.iter_mut().zip(present).filter(|(_, is)| !**is).for_each(|(s, _)| *s = 0.0);
    let sum: f64 = shares.iter().sum();
    if sum.is_nan() {
        return Err(WeightError::NotFinite);
    }
    if sum >= f64::INFINITY {
        return Err(WeightError::Overflow);
    }
    // A subnormal sum has lost its digits, and its shares would no longer sum to one.
    if sum < f64::MIN_POSITIVE {
        return Err(WeightError::Underflow);
    }
    Ok(shares.map(|s| s / sum))
}

/// No weight below the floor; sums to one again.
fn raised<const K: usize>(weights: &[f64; K], floor: f64, present: &[bool; K]) -> [f64; K] {
    let mut raised = *weights;
    for (weight, is) in raised.iter_mut().zip(present) {
        *weight = if *is && *weight < floor { floor } else { *weight };
    }
    let sum: f64 = raised.iter().sum();
    raised.map(|w| w / sum)
}

#[cfg(test)]
#[path = "weights_tests.rs"]
mod tests;
