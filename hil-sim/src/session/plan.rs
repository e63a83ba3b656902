//! [`Plan`]: what a session tells the flight computer, and what goes wrong in it.

use fsw_core::link::parameters::{InitialKnowledge, ParameterBlock};

use crate::noise::Stream;
use crate::scenario::{Fault, Scenario};

/// The filter factors its initial variances: exact knowledge is told as nearly exact (m, m/s, rad).
const LEAST_SIGMA: f64 = 1e-6;

/// What a session needs to know besides the plant.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Parameter blocks in the order of the digest.
    pub blocks: Vec<ParameterBlock>,
    /// Longest flight, s.
    pub time_limit_s: f64,
    /// Faults of the sensors and of the uplink; both happen here.
    pub faults: Vec<Fault>,
    /// Randomness of corrupted packets.
    pub noise: Stream,
    /// Whether true states that the flight software does not use are sent too, for a recorder on the way.
    pub truth_tap: bool,
}

impl Plan {
    /// The plan of one run of a scenario.
    #[must_use]
    pub fn new(scenario: &Scenario, knowledge: InitialKnowledge, noise: Stream) -> Self {
        let mut blocks = scenario.parameter_blocks();
        let knowledge = InitialKnowledge {
            position_sigma_m: knowledge.position_sigma_m.max(LEAST_SIGMA),
            velocity_sigma_mps: knowledge.velocity_sigma_mps.max(LEAST_SIGMA),
            attitude_sigma_rad: knowledge.attitude_sigma_rad.max(LEAST_SIGMA),
            ..knowledge
        };
        let at = blocks.iter().position(|b| matches!(b, ParameterBlock::Navigation(_))).unwrap_or(blocks.len());
        blocks.insert(at, ParameterBlock::InitialKnowledge(knowledge));
        Self { blocks, time_limit_s: scenario.time_limit_s, faults: scenario.fault.clone(), noise, truth_tap: true }
    }
}
