//! Runs on all threads, taken in the order of their numbers, so that sums come out the same on any number of threads.

use rayon::prelude::*;

/// Runs that are held at once: enough to feed every thread, little enough for any memory.
const HELD: u64 = 256;

/// Does `one` for each run from 0 to `runs` − 1 on all threads and hands the results to `take` in that order.
pub fn for_each<T: Send>(runs: u64, one: impl Fn(u64) -> T + Sync, mut take: impl FnMut(u64, T)) {
    let mut first = 0;
    while first < runs {
        let last = runs.min(first + HELD);
        let results: Vec<T> = (first..last).into_par_iter().map(&one).collect();
        (first..last).zip(results).for_each(|(run, result)| take(run, result));
        first = last;
    }
}

/// All results in the order of the runs.
#[must_use]
pub fn collect<T: Send>(runs: u64, one: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let mut all = Vec::new();
    for_each(runs, one, |_, result| all.push(result));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_runs_on_any_number_of_threads() {
        let squares = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| collect(600, |run| run * run))
        };
        let expected: Vec<u64> = (0..600).map(|run| run * run).collect();
        assert_eq!((squares(1), squares(4)), (expected.clone(), expected));
    }
}
