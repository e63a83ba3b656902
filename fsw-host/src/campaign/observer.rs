//! Watches one flight and keeps what a campaign wants to know of it: figures, not histories.

use fsw_core::link::packet::{
    Actuator, DeployCause, Downlink, Event, EventKind, Frame, GuidanceTlm, HealthTlm, NavTlm, RejectCounters,
};
use fsw_core::planet::STANDARD_GRAVITY_MPS2;
use fsw_core::time::FRAME;
use fsw_core::units::deg;
use hil_sim::truth::Truth;
use sha2::{Digest, Sha256};

use crate::measure::{consistency, miss, truth_sample};
use crate::record::{DeployState, End, Peak, ScenarioFacts};
use crate::recorder::hash_packet;

/// What is kept of one flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flown {
    /// How it ended, see [`End::word`].
    pub outcome: &'static str,
    /// Why it is no success, one sentence.
    pub reason: Option<String>,
    /// Great-circle distance from the deploy point to the target, m.
    pub miss_m: Option<f64>,
    /// Its part along the arc, m, positive beyond the target.
    pub downrange_error_m: Option<f64>,
    /// Its part across the arc, m, positive to the right.
    pub crossrange_error_m: Option<f64>,
    /// True conditions at deployment.
    pub deploy: Option<DeployState>,
    /// What fired the parachute.
    pub deploy_cause: Option<&'static str>,
    /// Largest values along the path.
    pub peak: Peak,
    /// Bank reversals commanded.
    pub reversals: u32,
    /// Work of guidance.
    pub work: Work,
    /// The flight software said, at least once, that the target is out of reach; the last time with this miss, m.
    pub unreachable_m: Option<f64>,
    /// Times that it said so.
    pub unreachable_events: u32,
    /// The last word of the flight software: true when it was that the target is out of reach.
    pub unreachable_at_end: bool,
    /// Position error of the navigation at its last epoch, m.
    pub position_error_m: Option<f64>,
    /// Velocity error there, m/s.
    pub velocity_error_mps: Option<f64>,
    /// Mean normalised estimation error squared.
    pub nees_mean: Option<f64>,
    /// Packets rejected or lost.
    pub rejected: u32,
    /// Minor frames flown.
    pub frames: u32,
    /// Bank where the flight first fell below each speed of the grid, deg.
    pub bank_deg: Vec<Option<f64>>,
    /// SHA-256 of what the flight computer said, hexadecimal; the same as that of `fly`. None when it never came to its end.
    pub output_hash: Option<String>,
}

/// Work of guidance over the cycles that predicted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Cycles that predicted.
    pub cycles: u32,
    /// Predictor calls in all of them.
    pub predictions: u32,
    /// Most in one.
    pub max_predictions: u32,
    /// Evaluations of the equations of motion in all of them.
    pub evaluations: u32,
    /// Most in one.
    pub max_evaluations: u32,
}

impl Work {
    /// Mean number of predictor calls a cycle.
    #[must_use]
    pub fn mean_predictions(&self) -> Option<f64> {
        (self.cycles > 0).then(|| f64::from(self.predictions) / f64::from(self.cycles))
    }

    /// Mean number of evaluations a cycle.
    #[must_use]
    pub fn mean_evaluations(&self) -> Option<f64> {
        (self.cycles > 0).then(|| f64::from(self.evaluations) / f64::from(self.cycles))
    }

    fn add(&mut self, cycle: &GuidanceTlm) {
        if cycle.predictions == 0 {
            return;
        }
        self.cycles += 1;
        self.predictions += u32::from(cycle.predictions);
        self.max_predictions = self.max_predictions.max(u32::from(cycle.predictions));
        self.evaluations += u32::from(cycle.evaluations);
        self.max_evaluations = self.max_evaluations.max(u32::from(cycle.evaluations));
    }
}

/// Watches a flight.
pub struct Observer<'a> {
    facts: &'a ScenarioFacts,
    /// Speeds at which the bank is noted, m/s, descending.
    grid_mps: &'a [f64],
    flown: Flown,
    nees_sum: f64,
    nees_count: u32,
    reversal_events: u32,
    deployed: bool,
    hash: Sha256,
}

impl<'a> Observer<'a> {
    /// An observer of a flight that begins.
    #[must_use]
    pub fn new(facts: &'a ScenarioFacts, grid_mps: &'a [f64]) -> Self {
        let flown = Flown { bank_deg: Vec::with_capacity(grid_mps.len()), ..Flown::default() };
        let hash = Sha256::new();
        Self { facts, grid_mps, flown, nees_sum: 0.0, nees_count: 0, reversal_events: 0, deployed: false, hash }
    }

    /// Whether the parachute has been fired.
    #[must_use]
    pub fn deployed(&self) -> bool {
        self.deployed
    }

    /// A minor frame has been flown.
    pub fn frame(&mut self, truth: &Truth) {
        let (flow, world, peak) = (truth.flow(), &truth.case().world, &mut self.flown.peak);
        let load_g = truth.increments().delta_v_b.norm() / (FRAME.as_s() * STANDARD_GRAVITY_MPS2);
        let heat_flux_wpm2 = world.heat_flux_wpm2(flow);
        keep_largest(&mut peak.load_g, load_g);
        keep_largest(&mut peak.dynamic_pressure_pa, flow.dynamic_pressure_pa);
        keep_largest(&mut peak.heat_flux_wpm2, heat_flux_wpm2);
        if let Some(next_mps) = self.grid_mps.get(self.flown.bank_deg.len())
            && truth.speed_mps() <= *next_mps
        {
            self.flown.bank_deg.push(Some(deg(hil_sim::angle::wrap_rad(truth.bank_rad()))));
        }
    }

    /// A packet of the flight computer, and the truth as it was then.
    pub fn hear(&mut self, frame: &Frame<Downlink>, truth: &Truth) {
        hash_packet(&mut self.hash, frame);
        match &frame.packet {
            Downlink::Actuator(actuator) => self.actuator(actuator),
            Downlink::NavTlm(nav) if frame.time == truth.time() => self.navigation(nav, truth),
            Downlink::GuidanceTlm(cycle) => self.guidance(cycle),
            Downlink::HealthTlm(health) => self.health(health),
            Downlink::Event(event) => self.event(event),
            _ => {}
        }
    }

    /// The command of a frame.
    fn actuator(&mut self, actuator: &Actuator) {
        self.flown.frames = actuator.frame;
        self.deployed |= actuator.discretes & Actuator::MORTAR_FIRE != 0;
    }

    /// Counters.
    fn health(&mut self, health: &HealthTlm) {
        self.flown.rejected = rejected(&health.rejects);
    }

    /// An estimate of the present truth.
    fn navigation(&mut self, nav: &NavTlm, truth: &Truth) {
        let sample = consistency(0.0, nav, &truth.packet());
        let norm = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        self.flown.position_error_m = Some(norm(sample.position_error_m));
        self.flown.velocity_error_mps = Some(norm(sample.velocity_error_mps));
        if let Some(nees) = sample.nees {
            self.nees_sum += nees;
            self.nees_count += 1;
        }
    }

    /// A guidance cycle.
    fn guidance(&mut self, cycle: &GuidanceTlm) {
        self.flown.work.add(cycle);
        self.flown.reversals = self.flown.reversals.max(u32::from(cycle.reversals));
    }

    /// Something happened.
    fn event(&mut self, event: &Event) {
        match event.kind {
            EventKind::Reversal { .. } => self.reversal_events += 1,
            EventKind::TargetUnreachable { miss_m } => {
                self.flown.unreachable_m = Some(f64::from(miss_m));
                self.flown.unreachable_events += 1;
                self.flown.unreachable_at_end = true;
            }
            EventKind::TargetReachable => self.flown.unreachable_at_end = false,
            EventKind::ParachuteFired { cause, .. } => {
                self.flown.deploy_cause = Some(match cause {
                    DeployCause::Trigger => "trigger",
                    DeployCause::Floor => "floor",
                    DeployCause::MinimumSpeed => "minimum speed",
                    DeployCause::BoxFloor => "lowest altitude of the box",
                });
            }
            _ => {}
        }
    }

    /// The flight is over.
    #[must_use]
    pub fn finish(mut self, end: &End, truth: &Truth) -> Flown {
        self.flown.outcome = end.word();
        self.flown.reversals = self.flown.reversals.max(self.reversal_events);
        self.flown.nees_mean = (self.nees_count > 0).then(|| self.nees_sum / f64::from(self.nees_count));
        self.flown.output_hash = Some(super::hexadecimal(&self.hash.finalize()));
        self.flown.bank_deg.resize(self.grid_mps.len(), None);
        if *end == End::Deployed {
            let sample = truth_sample(self.facts, truth.time(), &truth.packet(), None);
            let miss = miss(self.facts, &sample);
            self.flown.miss_m = Some(miss.miss_m);
            self.flown.downrange_error_m = Some(miss.downrange_m);
            self.flown.crossrange_error_m = Some(miss.crossrange_m);
            self.flown.deploy = Some(crate::summary::deploy_state(&sample));
        }
        self.flown.reason = crate::summary::why_no_success(end, self.flown.deploy.as_ref(), &self.facts.deploy);
        self.flown
    }
}

fn keep_largest(largest: &mut f64, value: f64) {
    if value > *largest {
        *largest = value;
    }
}

/// Everything that was rejected or lost, whatever the cause.
fn rejected(r: &RejectCounters) -> u32 {
    let causes = [r.overflow, r.cobs, r.crc, r.decode, r.lost, r.duplicate, r.reordered, r.late, r.early, r.range];
    let others = [r.not_finite, r.status, r.missed_frames, r.flooded];
    causes.iter().chain(&others).fold(0, |sum, n| sum.saturating_add(*n))
}
