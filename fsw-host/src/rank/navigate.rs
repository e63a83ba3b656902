//! A filter over a recorded flight, open loop: the same bytes for all.

use fsw_core::link::packet::GivenUpCause;
use fsw_core::link::parameters::NavigationMode;
use fsw_core::nav::{NavContext, Navigator};

use crate::bound::STRIDE;
use crate::measure::{NEES_BAND_95, consistency};
use crate::recorded::Recorded;

/// Whether filters are judged after this frame: ten times a second.
pub(super) fn is_judged(frame: usize) -> bool {
    frame.is_multiple_of(STRIDE)
}

/// What a filter did on a recorded flight.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Squared error of position (m²) and velocity ((m/s)²), ten a second.
    pub errors: Vec<[f64; 2]>,
    /// Normalised error squared where there is a covariance.
    pub nees: Vec<f64>,
    /// Shares of those within the central 95 %.
    pub inside: usize,
    /// Epochs whose covariance was not positive definite.
    pub indefinite: usize,
    /// Times that the flight software found the full covariance not finite, and restarted it.
    pub restarted: u16,
    /// Estimates with a number that is not finite.
    pub not_finite: usize,
    /// When the filter was given up, s, and why.
    pub given_up: Option<(f64, GivenUpCause)>,
}

/// Flies a filter over a recorded flight, up to the opening of the parachute.
#[must_use]
pub fn navigate(flight: &Recorded, mode: NavigationMode) -> Track {
    let config = &flight.config;
    let context = |bank_accel_radps2| NavContext {
        model: &flight.model,
        parameters: &config.navigation,
        estimators: &config.estimators,
        sources: &config.sources,
        mode,
        bank_accel_radps2,
    };
    let mut navigator = Box::new(Navigator::new());
    navigator.start(&config.initial_knowledge, &context(0.0));
    let mut track = Track::default();
    let mut bank_accel = 0.0;
    for (k, now, batch, truth) in flight.accepted() {
        let estimate = navigator.step(now, &batch, &context(bank_accel));
        bank_accel = flight.bank_accel_radps2.get(k - 1).copied().unwrap_or(0.0);
        track.not_finite += usize::from(!(estimate.r_i.is_finite() && estimate.v_i.is_finite()));
        if track.given_up.is_none() {
            track.given_up = navigator.counters().given_up.map(|cause| (now.as_s(), cause));
        }
        if is_judged(k) {
            let told = consistency(now.as_s(), &navigator.telemetry(), truth);
            let square = |error: [f64; 3]| error.iter().map(|e| e * e).sum::<f64>();
            track.errors.push([square(told.position_error_m), square(told.velocity_error_mps)]);
            match told.nees {
                Some(nees) => {
                    track.inside += usize::from((NEES_BAND_95[0]..=NEES_BAND_95[1]).contains(&nees));
                    track.nees.push(nees);
                }
                None => track.indefinite += 1,
            }
        }
    }
    track.restarted = navigator.counters().covariance_restored;
    track
}
