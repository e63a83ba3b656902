//! The work on a window while the next one is flown, a slice in each frame.

use super::design::{self, Design, EXPERTS};
use super::engine::{BATCH, Step};
use super::watch::GivenUp;
use super::window::{MAX_SIGHTS, Sight};
use super::{EPOCH_S, Lent, Modelled};
use crate::frames::{Inertial, Vec3};
use crate::link::packet::{MeasurementKind, Verdict};
use crate::math::fun::exp;
use crate::math::num::abs;
use crate::nav::estimators::models::{AXES, Noise, Onboard, Quantity};
use crate::nav::estimators::weights::{Channels, Rule};
use crate::probe::{Kernel, Probe};
use crate::time::MissionTime;

/// Readings taken in in the third frame of a window; the rest in the fourth.
const EARLY_SIGHTS: usize = 2 * BATCH;
/// Experts of a bank worked on in one frame, and the frames that takes.
const EXPERTS_PER_FRAME: usize = 2;
/// Of a window; the last frame is for the fusion.
const FRAMES_OF_EXPERTS: usize = EXPERTS.div_ceil(EXPERTS_PER_FRAME);
/// The expert whose innovations are told: it believes in the onboard model.
const MIDDLE_EXPERT: usize = EXPERTS / 2;
/// P3's units of dynamic pressure (Pa), acceleration (m/s²), range (m) and range-rate (m/s).
const CHANNEL_UNITS: Channels = [636.0, 3.711, 3.711, 3.711, 3_389_500.0, 3_546.6];

impl Modelled {
    /// This frame's part of the work on the window before.
    pub(super) fn slice(&mut self, lent: &Lent<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        let length_s = self.job.length_s();
        if length_s <= 0.0 || self.given_up().is_some() {
            return Ok(());
        }
        let vehicle = Onboard::new(lent.model, self.job.bank(), self.job.body_axes());
        let [x, y, z, vx, vy, vz] = self.engine.state();
        let radial = (x * vx + y * vy + z * vz) / Vec3::<Inertial>::new(x, y, z).norm();
        let persistence = exp(-abs(radial) * length_s / lent.parameters.log_density_length_m);
        let step = Step {
            vehicle: &vehicle,
            design: lent.design,
            parameters: lent.parameters,
            step_s: length_s,
            force_mps2: self.job.force_mps2(),
            persistence,
        };
        if self.engine.experts() > 0 {
            return self.work_on_bank(&step, probe);
        }
        match self.frame {
            0 => {
                // P1's self-calibration starts at the third step; after the first pull-in it starts better.
                let is_early = f64::from(self.epochs) * EPOCH_S < lent.design.settings.calibration_start_s;
                if is_early && matches!(lent.design.family, design::Family::Tied(_)) {
                    self.engine.forget_input();
                }
                self.predict(&step, probe)?;
            }
            1 => self.correct_by_force(&step, probe)?,
            2 => self.correct_some(0, EARLY_SIGHTS, &step, true, probe)?,
            3 => self.correct_some(EARLY_SIGHTS, MAX_SIGHTS, &step, true, probe)?,
            _ => self.finish(lent),
        }
        Ok(())
    }

    /// A bank of filters: some experts in each frame but the last, one after the other from prediction to last reading.
    #[inline(never)]
    fn work_on_bank(&mut self, step: &Step<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        let frame = usize::from(self.frame);
        if frame >= FRAMES_OF_EXPERTS {
            self.engine.fuse()?;
            self.epochs = self.epochs.saturating_add(1);
            self.publish(step.design, step.parameters);
            return Ok(());
        }
        let first = frame * EXPERTS_PER_FRAME;
        for expert in first..first + EXPERTS_PER_FRAME {
            if expert < self.engine.experts() {
                self.engine.turn_to(expert);
                self.predict(step, probe)?;
                self.correct_by_force(step, probe)?;
                self.correct_some(0, MAX_SIGHTS, step, expert == MIDDLE_EXPERT, probe)?;
            }
        }
        if frame + 1 == FRAMES_OF_EXPERTS {
            self.engine.weigh(&self.channels(step.design))?;
        }
        Ok(())
    }

    /// The readings of the window as a gating network sees them: P3 brings them to order one, and the bare form does not.
    fn channels(&self, design: &Design<'_>) -> Channels {
        let [fx, fy, fz] = self.job.specific_force_mps2().unwrap_or([0.0; AXES]);
        let value = |kind| self.job.sights.items().iter().find(|sight| sight.kind == kind).map_or(0.0, |s| s.value);
        let pressure = self.job.sights.items().iter().find(|sight| sight.kind == MeasurementKind::Pressure);
        let pressure_pa = pressure.map_or(0.0, |sight| exp(sight.value));
        let raw = [pressure_pa, fx, fy, fz, value(MeasurementKind::Range), value(MeasurementKind::RangeRate)];
        if matches!(design.family, design::Family::Bank(Rule::BareGating { .. })) {
            return raw;
        }
        let mut scaled = raw;
        scaled.iter_mut().zip(CHANNEL_UNITS).for_each(|(channel, unit)| *channel /= unit);
        scaled
    }

    #[inline(never)]
    fn predict(&mut self, step: &Step<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        self.engine.predict(step)?;
        self.acceleration_mps2 = step.vehicle.total_acceleration(&self.engine.working_state(), &self.path_parameters());
        probe.kernel_done(Kernel::FilterPredict, 1);
        Ok(())
    }

    #[inline(never)]
    fn correct_by_force(&mut self, step: &Step<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        let Some([x, y, z]) = self.job.specific_force_mps2() else { return Ok(()) };
        let sigma = step.design.force_reading_sigma(step.step_s, step.force_mps2, step.parameters);
        let sight = |axis, value| Sight {
            time: MissionTime::ZERO,
            kind: MeasurementKind::default(),
            source: 0,
            quantity: Quantity::SpecificForce { axis },
            noise: Noise::of(sigma),
            value,
            age_s: 0.5 * step.step_s,
        };
        let sights = [sight(0, x), sight(1, y), sight(2, z)];
        self.engine.correct(step, &sights, &self.acceleration_mps2, step.parameters.gate_sigma)?;
        probe.kernel_done(Kernel::FilterUpdate, AXES as u32);
        Ok(())
    }

    /// Radio and pressure from index `first` up to `end`, in batches.
    #[inline(never)]
    fn correct_some(
        &mut self,
        first: usize,
        end: usize,
        step: &Step<'_>,
        is_told: bool,
        probe: &mut impl Probe,
    ) -> Result<(), GivenUp> {
        let Self { engine, job, innovations, acceleration_mps2, .. } = self;
        let sights = job.sights.items();
        let some = sights.get(first..).unwrap_or_default();
        let some = some.get(..end.saturating_sub(first)).unwrap_or(some);
        for batch in some.chunks(BATCH) {
            let told = engine.correct(step, batch, acceleration_mps2, step.parameters.gate_sigma)?;
            for (sight, told) in batch.iter().zip(told.iter().flatten()) {
                if is_told {
                    let verdict = if told.used { Verdict::Used } else { Verdict::Gated };
                    innovations.push(sight.record(told.value, told.variance, verdict));
                }
                probe.kernel_done(Kernel::FilterUpdate, 1);
            }
        }
        Ok(())
    }
}
