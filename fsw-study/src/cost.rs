//! Cost of a filter on the host, as time. Instructions of the flight processor are in [`crate::m7`].

use std::hint::black_box;
use std::time::Instant;

/// Nanoseconds of one of `steps` steps of `flight`, the fastest of `flights`: what disturbs a measurement only adds to it.
#[must_use]
pub fn fastest_ns<T>(flights: usize, steps: usize, mut flight: impl FnMut() -> T) -> f64 {
    let once = |_| {
        let start = Instant::now();
        black_box(flight());
        start.elapsed().as_secs_f64() * 1e9 / steps.max(1) as f64
    };
    (0..flights.max(1)).map(once).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flight_is_flown_and_one_is_told() {
        let mut flown = 0;
        let ns = fastest_ns(3, 10, || flown += 1);
        assert!(flown == 3 && ns.is_finite() && ns >= 0.0);
    }
}
