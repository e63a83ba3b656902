//! Readings as they come, kept for the end of the window.

use super::window::Sight;
use super::{EPOCH_S, Lent, Modelled};
use crate::frames::{Inertial, Vec3};
use crate::link::packet::{MeasurementKind, Verdict};
use crate::math::fun::{exp, ln, sqrt};
use crate::math::num::max;
use crate::model::orbiter::SourceState;
use crate::nav::estimators::models::{AXES, Noise, Quantity};
use crate::nav::filter::pressure::Pitot;
use crate::nav::filter::{FRAMES_PER_EPOCH, radio};
use crate::sensors::Batch;
use crate::time::{FRAME, MissionTime};

/// White noise that a pressure reading has at least, as a share: no transducer and no pitot formula is exact.
const MIN_PRESSURE_SHARE: f64 = 1e-3;

impl Modelled {
    /// Readings of this frame.
    #[inline(never)]
    pub(super) fn gather(&mut self, batch: &Batch, sources: &mut [SourceState], lent: &Lent<'_>) {
        let frames_left = FRAMES_PER_EPOCH.saturating_sub(1).saturating_sub(self.frame);
        let age_s = f64::from(frames_left) * FRAME.as_s();
        if let Some(p) = &batch.pressure {
            self.gather_pressure(p.time, p.stagnation_pa, age_s, lent);
        }
        for (measured, state) in batch.radio.iter().zip(sources.iter_mut()) {
            let Some(m) = measured else { continue };
            let found = state.at(&lent.model.planet, m.time);
            let quantities = found.map(|(r_s, v_s)| {
                let (source_m, source_mps) = (r_s.to_array(), v_s.to_array());
                (Quantity::Range { source_m }, Quantity::RangeRate { source_m, source_mps }, r_s)
            });
            let nowhere = Quantity::Range { source_m: [0.0; AXES] };
            let (range, rate, seen) = match quantities {
                Ok((range, rate, r_s)) => (range, rate, self.sees(state, &r_s, lent)),
                Err(_) => (nowhere, nowhere, false),
            };
            for (kind, quantity, value, sigma) in [
                (MeasurementKind::Range, range, m.range_m, lent.parameters.range_noise_m),
                (MeasurementKind::RangeRate, rate, m.range_rate_mps, lent.parameters.range_rate_noise_mps),
            ] {
                let noise = Noise::of(sigma);
                self.take(Sight { time: m.time, kind, source: m.source, quantity, noise, value, age_s }, seen);
            }
        }
    }

    fn sees(&self, state: &SourceState, r_s: &Vec3<Inertial>, lent: &Lent<'_>) -> bool {
        let [x, y, z, ..] = self.now;
        let r_i = Vec3::new(x, y, z);
        let lowest_sine = radio::lowest_sine(lent.parameters);
        (r_i - *r_s).unit().is_some_and(|u| radio::is_visible(state, &r_i, r_s, &u, lowest_sine))
    }

    /// A stagnation pressure, as its logarithm: what is known of its noise is relative, and it is linear in altitude then.
    fn gather_pressure(&mut self, time: MissionTime, value_pa: f64, age_s: f64, lent: &Lent<'_>) {
        let [x, y, z, vx, vy, vz] = self.now;
        let planet = &lent.model.planet;
        let altitude_m = Vec3::<Inertial>::new(x, y, z).norm() - planet.radius_m;
        let spin = planet.rotation_radps;
        let speed_mps = Vec3::<Inertial>::new(vx + y * spin, vy - x * spin, vz).norm();
        let pitot = Pitot::at(lent.model, altitude_m, speed_mps);
        let [log_density, _] = self.path_parameters();
        let density = lent.model.atmosphere.density(altitude_m) * exp(log_density);
        let dynamic_pa = 0.5 * density * speed_mps * speed_mps;
        let p = lent.parameters;
        let offset = p.pressure_offset_sigma_pa / max(value_pa, p.pressure_min_dynamic_pa);
        let constant = p.pressure_scale_sigma * p.pressure_scale_sigma + offset * offset;
        let share = sqrt(p.pressure_noise * p.pressure_noise + lent.design.as_white(constant) / EPOCH_S);
        let (static_square, coefficient) = (pitot.static_square(), pitot.coefficient);
        let sight = Sight {
            time,
            kind: MeasurementKind::Pressure,
            source: 0,
            quantity: Quantity::LogPressure { static_square, coefficient },
            noise: Noise::of(max(share, MIN_PRESSURE_SHARE)),
            value: ln(max(value_pa, f64::MIN_POSITIVE)),
            age_s,
        };
        self.take(sight, dynamic_pa >= p.pressure_min_dynamic_pa && value_pa > 0.0);
    }

    fn take(&mut self, sight: Sight, valid: bool) {
        if valid && sight.value.is_finite() {
            self.window.sights.push(sight);
        } else {
            self.innovations.push(sight.record(0.0, 0.0, Verdict::OutOfValidity));
        }
    }
}
