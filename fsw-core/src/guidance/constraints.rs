//! Peaks of load, heat flux and dynamic pressure along a predicted path, and what they leave of the bank.

use crate::link::parameters::ConstraintParameters;
use crate::math::num::max;
use crate::model::OnboardModel;
use crate::model::entry::Flow;
use crate::model::loads::{dynamic_pressure_pa, heat_flux_wpm2, sensed_load_mps2};

/// Number of constraints: sensed load, heat flux, dynamic pressure, in this order everywhere.
pub const CONSTRAINTS: usize = 3;

/// Drag acceleration (m/s²), then sensed load (m/s²), heat flux (W/m²) and dynamic pressure (Pa) in a flow. P4 eq. 8 and 10
/// as corrected; the load is the sensed one, √(L² + D²).
#[inline(always)]
#[must_use]
pub fn loads(model: &OnboardModel, flow: &Flow<f64>) -> [f64; 1 + CONSTRAINTS] {
    let pressure = dynamic_pressure_pa(flow.density_kgpm3, flow.speed_mps);
    let per_coefficient = 2.0 * pressure * model.constants().half_area_per_mass_m2pkg;
    let load = per_coefficient * sensed_load_mps2(flow.drag_coefficient, flow.lift_coefficient);
    let heat = heat_flux_wpm2(flow.density_kgpm3, flow.speed_mps, model.vehicle.nose_radius_m);
    [per_coefficient * flow.drag_coefficient, load, heat, pressure]
}

/// Highest value of each load along a path sampled at equal steps; a peak between two samples is taken from the parabola
/// through the three samples around it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    highest: [f64; CONSTRAINTS],
    last: [f64; CONSTRAINTS],
    before: [f64; CONSTRAINTS],
}

impl Peaks {
    /// Peaks of a path that starts with these loads.
    #[must_use]
    pub fn starting(loads: [f64; CONSTRAINTS]) -> Self {
        Self { highest: loads, last: loads, before: loads }
    }

    /// Adds the next sample.
    pub fn push(&mut self, loads: [f64; CONSTRAINTS]) {
        let samples = self.highest.iter_mut().zip(&mut self.last).zip(&mut self.before).zip(&loads);
        for (((highest, last), before), new) in samples {
            // Rising: the new sample may be the highest. Falling after a rise: the top lies around the last one.
            if *new > *last {
                *highest = max(*highest, *new);
            } else if *last > *before {
                *highest = max(*highest, top(*before, *last, *new));
            }
            *before = *last;
            *last = *new;
        }
    }

    /// Highest load, heat flux and dynamic pressure so far.
    #[must_use]
    pub fn highest(&self) -> [f64; CONSTRAINTS] {
        self.highest
    }

    /// Margins to the limits: 1 − peak / limit.
    #[must_use]
    pub fn margins(&self, limits: &ConstraintParameters) -> [f64; CONSTRAINTS] {
        let [load, heat, pressure] = self.highest;
        [1.0 - load / limits.load_mps2, 1.0 - heat / limits.heat_flux_wpm2, 1.0 - pressure / limits.dynamic_pressure_pa]
    }

    /// How hard the tightest limit is used: peak over limit, above 1 when exceeded.
    #[must_use]
    pub fn worst_use(&self, limits: &ConstraintParameters) -> f64 {
        self.margins(limits).iter().fold(0.0, |worst, margin| max(worst, 1.0 - margin))
    }
}

/// Top of the parabola through three equidistant samples of which the middle one is the highest.
fn top(before: f64, middle: f64, after: f64) -> f64 {
    let half_difference = 0.5 * (after - before);
    middle + 0.5 * half_difference * half_difference / (2.0 * middle - before - after)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: ConstraintParameters =
        ConstraintParameters { load_mps2: 100.0, heat_flux_wpm2: 1e6, dynamic_pressure_pa: 1e4 };

    #[test]
    fn a_peak_between_two_samples_is_found() {
        // 80 − (t − 5.3)²: samples at whole seconds miss the top by 0.09, the parabola does not.
        let at = |t: f64| [80.0 - (t - 5.3) * (t - 5.3), 0.0, 0.0];
        let mut peaks = Peaks::starting(at(0.0));
        for t in 1..12 {
            peaks.push(at(f64::from(t)));
        }
        assert!((peaks.highest()[0] - 80.0).abs() < 1e-12);
    }

    #[test]
    fn a_path_that_only_rises_or_falls_has_its_peak_at_an_end() {
        let mut rising = Peaks::starting([1.0; 3]);
        let mut falling = Peaks::starting([9.0; 3]);
        for k in 2..9 {
            rising.push([f64::from(k); 3]);
            falling.push([10.0 - f64::from(k); 3]);
        }
        assert_eq!(rising.highest(), [8.0; 3]);
        assert_eq!(falling.highest(), [9.0; 3]);
    }

    #[test]
    fn margins_and_worst_use_follow_the_limits() {
        let peaks = Peaks::starting([80.0, 1.1e6, 5e3]);
        let margins = peaks.margins(&LIMITS);
        assert!(
            (margins[0] - 0.2).abs() < 1e-12 && (margins[1] + 0.1).abs() < 1e-12 && (margins[2] - 0.5).abs() < 1e-12
        );
        assert!((peaks.worst_use(&LIMITS) - 1.1).abs() < 1e-12);
    }
}
