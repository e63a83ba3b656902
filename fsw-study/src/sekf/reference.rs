//! What is known of the experiment: P1's own result, and the figures of an independent implementation in another language
//! under the same defaults.

use super::kind::Kind;

/// P1's result in words: it prints plots and no number.
pub const PAPER: &str =
    "P1 gives plots and no numbers: errors of the SEKF without bias, its RMSE below the EKF's on the whole";

/// A reference figure.
pub struct Reference {
    /// Case.
    pub case: &'static str,
    /// Filter.
    pub filter: Kind,
    /// Position RMSE, m.
    pub position_m: f64,
    /// Ratio to the EKF.
    pub ratio: f64,
    /// What ours must reach.
    pub at_least: Option<f64>,
}

const fn figure(case: &'static str, filter: Kind, position_m: f64, ratio: f64, at_least: Option<f64>) -> Reference {
    Reference { case, filter, position_m, ratio, at_least }
}

/// The figures, 1 s, 500 runs. They do not hold under other settings.
const FIGURES: [Reference; 11] = [
    figure("untuned", Kind::Ekf, 2_054.0, 1.0, None),
    figure("untuned", Kind::Sekf, 555.0, 2.11, Some(1.9)),
    figure("untuned-0.1", Kind::Sekf, 61.0, 16.1, Some(14.0)),
    figure("untuned-0.01", Kind::Sekf, 18.0, 40.0, Some(35.0)),
    figure("tuned", Kind::Ekf, 297.0, 1.0, None),
    figure("tuned", Kind::Sekf, 485.0, 0.56, None),
    figure("tuned", Kind::Aekf12, 274.0, 1.07, Some(1.05)),
    figure("tuned-wrong", Kind::Ekf, 368.0, 1.0, None),
    figure("tuned-wrong", Kind::Sekf, 501.0, 0.60, None),
    figure("tuned-wrong", Kind::Aekf12, 357.0, 1.12, None),
    figure("tuned-wrong", Kind::Aekf17, 286.0, 1.50, Some(1.45)),
];

/// The figure of a filter in a case.
#[must_use]
pub fn of(case: &str, filter: Kind) -> Option<&'static Reference> {
    FIGURES.iter().find(|figure| figure.case == case && figure.filter == filter)
}

/// The figures that ours must reach.
pub fn bars() -> impl Iterator<Item = &'static Reference> {
    FIGURES.iter().filter(|figure| figure.at_least.is_some())
}

#[cfg(test)]
mod tests {
    use super::super::cases::CASES;
    use super::*;

    #[test]
    fn every_reference_is_of_a_case_that_is_flown() {
        for figure in &FIGURES {
            assert!(CASES.iter().any(|case| case.name == figure.case), "{}", figure.case);
            assert!(figure.at_least.is_none_or(|least| least <= figure.ratio));
        }
        assert!(of("tuned", Kind::Aekf17).is_none());
    }
}
