//! Sums over the entries of a case, and the means that they become.

use super::case::{Failure, FilterResult, Moment, Rmse, Trace};
use super::filters::STATE;
use super::run::{Note, Outcome};

/// Sums over entries.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    result: FilterResult,
    first: Trace,
    ended: u64,
    squares: [f64; STATE],
    nees: (f64, u64),
    indefinite: u64,
    watched: u64,
    /// By the index of the instant: time, entries, squares, variances.
    history: Vec<(f64, u64, [f64; STATE], [f64; STATE])>,
}

pub(super) fn add(sum: &mut [f64; STATE], more: impl Iterator<Item = f64>) {
    sum.iter_mut().zip(more).for_each(|(sum, x)| *sum += x);
}

impl Sums {
    pub(super) fn add(&mut self, outcome: &Outcome, divergence_m: f64) {
        if self.result.runs == 0 {
            self.result.label.clone_from(&outcome.label);
            self.first = Trace::of(outcome);
        }
        self.result.runs += 1;
        self.indefinite += outcome.indefinite;
        self.watched += outcome.watched;
        match (&outcome.failure, outcome.notes.split_last()) {
            (None, Some((end, before))) => {
                self.end(end, outcome.nees, divergence_m);
                self.remember(before);
            }
            (failure, _) => {
                self.result.diverged += 1;
                self.result.failed += 1;
                self.stop(failure.clone().unwrap_or_else(|| (0.0, "it saw nothing".to_owned())));
                self.remember(&outcome.notes);
            }
        }
    }

    fn end(&mut self, end: &Note, nees: Option<f64>, divergence_m: f64) {
        self.ended += 1;
        add(&mut self.squares, end.error.iter().map(|e| e * e));
        let distance = end.error.iter().take(3).map(|e| e * e).sum::<f64>().sqrt();
        // Written so that what is no number counts as far.
        let is_near = distance <= divergence_m;
        self.result.diverged += u64::from(!is_near);
        if let Some(nees) = nees {
            self.nees = (self.nees.0 + nees, self.nees.1 + 1);
        }
    }

    fn stop(&mut self, (time_s, words): (f64, String)) {
        let so_far = self.result.failure.get_or_insert(Failure { words, first_s: time_s, last_s: time_s });
        so_far.first_s = so_far.first_s.min(time_s);
        so_far.last_s = so_far.last_s.max(time_s);
    }

    fn remember(&mut self, notes: &[Note]) {
        for (at, note) in notes.iter().enumerate() {
            if self.history.len() <= at {
                self.history.push((note.time_s, 0, [0.0; STATE], [0.0; STATE]));
            }
            if let Some((_, count, squares, variances)) = self.history.get_mut(at) {
                *count += 1;
                add(squares, note.error.iter().map(|e| e * e));
                add(variances, note.variance.iter().copied());
            }
        }
    }

    pub(super) fn result(self) -> FilterResult {
        let Self { mut result, first, ended, squares, nees, indefinite, watched, history } = self;
        if result.runs == 1 {
            result.first = first;
        }
        result.rmse = Rmse::of_squares(squares.map(|sum| sum / ended as f64));
        result.nees = (nees.1 > 0).then(|| nees.0 / nees.1 as f64);
        result.indefinite_share = if watched == 0 { 0.0 } else { indefinite as f64 / watched as f64 };
        // Means over the longer flights alone would be another thing than the ones before.
        let most = history.first().map_or(0, |first| first.1);
        let is_common = |(_, count, ..): &&(f64, u64, [f64; STATE], [f64; STATE])| 20 * *count >= 19 * most;
        let moment = |&(time_s, count, squares, variances): &(f64, u64, [f64; STATE], [f64; STATE])| Moment {
            time_s,
            rmse: squares.map(|sum| (sum / count as f64).sqrt()),
            sigma: variances.map(|sum| (sum / count as f64).sqrt()),
        };
        result.history = history.iter().take_while(is_common).map(moment).collect();
        result
    }
}

impl Trace {
    fn of(outcome: &Outcome) -> Self {
        let notes = &outcome.notes;
        Self {
            time_s: notes.iter().map(|note| note.time_s).collect(),
            errors: notes.iter().map(|note| note.error).collect(),
            sigmas: notes.iter().map(|note| note.variance.map(f64::sqrt)).collect(),
            weights: outcome.weights.clone(),
        }
    }
}
