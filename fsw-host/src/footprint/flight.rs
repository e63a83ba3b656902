//! One undispersed flight under a given bank history, with a bank that turns at once: what the vehicle itself can do.

use hil_sim::dynamics::{Motion, World};

use crate::measure::miss;
use crate::record::{Peak, ScenarioFacts, TruthSample};

/// Step of the integration, s; over 300 s the fourth-order rule errs by centimetres.
const STEP_S: f64 = 0.1;

/// Where and how a flight came to deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Reached {
    /// Downrange from the target, m, positive beyond it.
    pub downrange_m: f64,
    /// Crossrange from the arc to the target, m, positive to the right.
    pub crossrange_m: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// Time, s.
    pub time_s: f64,
    /// Largest values along the path.
    pub peak: Peak,
}

/// What all flights share.
pub struct Course<'a> {
    /// Planet, air and vehicle.
    pub world: &'a World,
    /// Target, deployment and limits.
    pub facts: &'a ScenarioFacts,
    /// Longest flight, s.
    pub time_limit_s: f64,
}

impl Course<'_> {
    /// Flies until the trigger speed or the altitude floor, whichever comes first; none when neither does in time.
    #[must_use]
    pub fn fly(&self, entry: &Motion, bank_rad: impl Fn(f64) -> f64) -> Option<Reached> {
        let (world, deploy) = (self.world, &self.facts.deploy);
        let mut motion = *entry;
        let mut peak = Peak::default();
        let mut before = self.distance(&motion);
        let steps = (self.time_limit_s / STEP_S).ceil() as u32;
        for k in 0..steps {
            let bank = bank_rad(self.speed_mps(&motion));
            let next = world.step(&motion, STEP_S, |_| bank);
            let flow = world.flow(&next.r_i, &next.v_i);
            peak.load_g = peak.load_g.max(world.load_g(&flow));
            peak.heat_flux_wpm2 = peak.heat_flux_wpm2.max(world.heat_flux_wpm2(&flow));
            peak.dynamic_pressure_pa = peak.dynamic_pressure_pa.max(flow.dynamic_pressure_pa);
            let after = self.distance(&next);
            // The entry itself may be slower than the trigger, high above the air: only a descent ends the flight.
            if after <= 0.0 && before > 0.0 || flow.altitude_m <= deploy.floor_altitude_m {
                let share = (before / (before - after)).clamp(0.0, 1.0);
                let length_s = STEP_S * if share.is_finite() { share } else { 1.0 };
                let end = world.step(&motion, length_s, |_| bank);
                return Some(self.reached(&end, f64::from(k) * STEP_S + length_s, peak));
            }
            (motion, before) = (next, after);
        }
        None
    }

    fn speed_mps(&self, motion: &Motion) -> f64 {
        (motion.v_i - hil_sim::dynamics::surface_velocity(&motion.r_i, &self.world.planet)).norm()
    }

    /// How far from deployment, in the unit of whatever is nearer to it.
    fn distance(&self, motion: &Motion) -> f64 {
        let deploy = &self.facts.deploy;
        let altitude_m = motion.r_i.norm() - self.world.planet.radius_m;
        (self.speed_mps(motion) - deploy.speed_mps).min(altitude_m - deploy.floor_altitude_m)
    }

    fn reached(&self, motion: &Motion, time_s: f64, peak: Peak) -> Reached {
        let state = motion.planet_relative(time_s, &self.world.planet);
        let sample = TruthSample {
            longitude_rad: state.longitude_rad,
            latitude_rad: state.latitude_rad,
            ..TruthSample::default()
        };
        let miss = miss(self.facts, &sample);
        Reached {
            downrange_m: miss.downrange_m,
            crossrange_m: miss.crossrange_m,
            altitude_m: state.radius_m - self.world.planet.radius_m,
            speed_mps: state.speed_mps,
            time_s,
            peak,
        }
    }
}
