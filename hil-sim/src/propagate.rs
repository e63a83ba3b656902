//! Open-loop flights: constant bank, perfect actuator, and a stop located by root finding.

use fsw_core::frames::{PlanetFixed, PlanetRelative, Vec3, great_circle_rad};

use crate::dynamics::{Motion, World};

/// Step of the integration, s.
const STEP_S: f64 = 0.02;
/// Bisections of one step: 0.02 s / 2^30 is 2e-11 s.
const BISECTIONS: usize = 30;

/// Where a flight stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// Descending or climbing through an altitude, m.
    AltitudeM(f64),
    /// Planet-relative speed crosses a value, m/s.
    SpeedMps(f64),
    /// A time after the epoch, s.
    TimeS(f64),
    /// Great-circle distance from the entry point at the reference radius, m.
    RangeM(f64),
}

/// One instant of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time after the epoch, s.
    pub time_s: f64,
    /// Planet-relative state.
    pub state: PlanetRelative,
    /// Altitude over the reference sphere, m.
    pub altitude_m: f64,
    /// Great-circle distance from the entry point at the reference radius, m.
    pub range_m: f64,
    /// Sensed load, g.
    pub load_g: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
    /// Convective heat flux, W/m².
    pub heat_flux_wpm2: f64,
    /// Density, kg/m³.
    pub density_kgpm3: f64,
    /// Mach number.
    pub mach: f64,
}

/// A largest value and when it was reached.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peak {
    /// The value.
    pub value: f64,
    /// Time after the epoch, s.
    pub time_s: f64,
}

/// Largest values along a flight, each refined by a parabola through the three samples around it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// Sensed load, g.
    pub load_g: Peak,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: Peak,
    /// Convective heat flux, W/m².
    pub heat_flux_wpm2: Peak,
}

/// An open-loop flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Samples from the epoch to the stop, the stop last.
    pub samples: Vec<Sample>,
    /// The state at the stop, or at the end of the time allowed.
    pub end: Sample,
    /// Peaks.
    pub peaks: Peaks,
    /// Whether the stop was reached within the time allowed and above the ground.
    pub reached: bool,
}

/// Flies at constant bank until the stop, the time limit, or the ground (altitude 0, unless the stop lies lower).
///
/// `sample_every_s` spaces the samples kept; it is rounded to whole steps of 20 ms.
#[must_use]
pub fn propagate(
    world: &World,
    entry: &Motion,
    bank_rad: f64,
    until: Until,
    max_time_s: f64,
    sample_every_s: f64,
) -> Flight {
    let course = Course { world, bank_rad, start_p: entry.planet_relative(0.0, &world.planet).to_cartesian().0 };
    let every = ((sample_every_s / STEP_S).round().max(1.0)) as u64;
    let ground = match until {
        Until::AltitudeM(stop) if stop <= 0.0 => f64::NEG_INFINITY,
        _ => 0.0,
    };
    let mut motion = *entry;
    let mut now = course.sample(0.0, &motion);
    let mut samples = vec![now];
    let mut peaks = PeakFinder::default();
    peaks.push(&now);
    if until.distance(&now) == 0.0 && matches!(until, Until::TimeS(_) | Until::RangeM(_)) {
        return Flight { samples, end: now, peaks: peaks.peaks(), reached: true };
    }
    let steps = (max_time_s / STEP_S).ceil().max(0.0) as u64;
    let end_of_step = |k: u64| (((k + 1) as f64) * STEP_S).min(max_time_s);
    for k in 0..steps {
        let time_s = k as f64 * STEP_S;
        let step_s = end_of_step(k) - time_s;
        let next = course.advance(&motion, step_s);
        let after = course.sample(time_s + step_s, &next);
        if until.crossed(&now, &after) {
            let end = course.locate(&motion, time_s, step_s, until, &now);
            peaks.push(&end);
            samples.push(end);
            return Flight { samples, end, peaks: peaks.peaks(), reached: true };
        }
        (motion, now) = (next, after);
        peaks.push(&now);
        if (k + 1) % every == 0 {
            samples.push(now);
        }
        if now.altitude_m <= ground {
            break;
        }
    }
    if samples.last() != Some(&now) {
        samples.push(now);
    }
    Flight { samples, end: now, peaks: peaks.peaks(), reached: false }
}

impl Until {
    /// Signed distance to the stop; the flight stops where it changes sign.
    fn distance(&self, sample: &Sample) -> f64 {
        match *self {
            Self::AltitudeM(stop) => sample.altitude_m - stop,
            Self::SpeedMps(stop) => sample.state.speed_mps - stop,
            Self::TimeS(stop) => sample.time_s - stop,
            Self::RangeM(stop) => sample.range_m - stop,
        }
    }

    fn crossed(&self, before: &Sample, after: &Sample) -> bool {
        let (a, b) = (self.distance(before), self.distance(after));
        (a > 0.0 && b <= 0.0) || (a < 0.0 && b >= 0.0)
    }
}

/// What stays the same during a flight.
struct Course<'a> {
    world: &'a World,
    bank_rad: f64,
    start_p: Vec3<PlanetFixed>,
}

impl Course<'_> {
    fn advance(&self, motion: &Motion, step_s: f64) -> Motion {
        self.world.step(motion, step_s, |_| self.bank_rad)
    }

    fn sample(&self, time_s: f64, motion: &Motion) -> Sample {
        let planet = &self.world.planet;
        let state = motion.planet_relative(time_s, planet);
        let flow = self.world.flow(&motion.r_i, &motion.v_i);
        Sample {
            time_s,
            state,
            altitude_m: flow.altitude_m,
            range_m: planet.radius_m * great_circle_rad(&self.start_p, &state.to_cartesian().0),
            load_g: self.world.load_g(&flow),
            dynamic_pressure_pa: flow.dynamic_pressure_pa,
            heat_flux_wpm2: self.world.heat_flux_wpm2(&flow),
            density_kgpm3: flow.density_kgpm3,
            mach: self.world.mach(&flow),
        }
    }

    /// The stop inside one step: bisection over the length of that step.
    fn locate(&self, motion: &Motion, time_s: f64, step_s: f64, until: Until, before: &Sample) -> Sample {
        let (mut low, mut high) = (0.0, step_s);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            let sample = self.sample(time_s + middle, &self.advance(motion, middle));
            if until.crossed(before, &sample) {
                high = middle;
            } else {
                low = middle;
            }
        }
        self.sample(time_s + high, &self.advance(motion, high))
    }
}

/// Follows three quantities and refines their largest values.
#[derive(Default)]
struct PeakFinder {
    last: [[Peak; 3]; 2],
    best: [Peak; 3],
    count: usize,
}

impl PeakFinder {
    fn push(&mut self, sample: &Sample) {
        let values = [sample.load_g, sample.dynamic_pressure_pa, sample.heat_flux_wpm2];
        let now = values.map(|value| Peak { value, time_s: sample.time_s });
        for (i, best) in self.best.iter_mut().enumerate() {
            if now[i].value > best.value {
                *best = now[i];
            }
            if self.count >= 2 {
                let top = vertex(self.last[0][i], self.last[1][i], now[i]);
                if let Some(top) = top.filter(|top| top.value > best.value) {
                    *best = top;
                }
            }
        }
        self.last = [self.last[1], now];
        self.count += 1;
    }

    fn peaks(&self) -> Peaks {
        let [load_g, dynamic_pressure_pa, heat_flux_wpm2] = self.best;
        Peaks { load_g, dynamic_pressure_pa, heat_flux_wpm2 }
    }
}

/// Vertex of the parabola through three points when the middle one is the largest.
fn vertex(a: Peak, b: Peak, c: Peak) -> Option<Peak> {
    let (d0, d1) = (b.time_s - a.time_s, c.time_s - b.time_s);
    if !(b.value > a.value && b.value >= c.value && d0 > 0.0 && d1 > 0.0) {
        return None;
    }
    let (s0, s1) = ((b.value - a.value) / d0, (c.value - b.value) / d1);
    let curvature = (s1 - s0) / (d0 + d1);
    let slope = (s0 * d1 + s1 * d0) / (d0 + d1);
    let offset = -0.5 * slope / curvature;
    Some(Peak { value: b.value + 0.5 * slope * offset, time_s: b.time_s + offset })
}

#[cfg(test)]
mod tests;
