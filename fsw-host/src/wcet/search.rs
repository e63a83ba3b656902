//! A seeded search for the worst minor frame: evolution over entries, air, sensors, faults and patterns of packets.
//!
//! A (1 + λ) strategy on genes between 0 and 1: each round breeds candidates from the worst input so far by changing a
//! few of its genes (the step shrinks when a round brings nothing), and a share of them afresh. The same seed and the
//! same costs give the same search.

use std::fmt::Write as _;

use hil_sim::session::BYTES_PER_FRAME;

use super::flights::{HardFlight, SOURCES, fault};
use crate::error::HostError;

/// Genes of the entry and the air.
const WORLD_GENES: usize = 10;
/// Genes of one fault.
const FAULT_GENES: usize = 5;
/// Faults of a candidate.
const FAULTS: usize = 5;
/// All genes.
pub const GENES: usize = WORLD_GENES + FAULTS * FAULT_GENES;
/// Candidates of a round; they fly in one boot.
pub const ROUND: usize = 6;
/// One candidate of so many is bred afresh.
const FRESH: u64 = 4;
/// Widest and narrowest change of a gene.
const STEP: [f64; 2] = [0.5, 0.02];

/// An input, as numbers between 0 and 1.
pub type Genome = [f64; GENES];

/// A small generator (`SplitMix64`), so that a search depends on nothing but its seed.
#[derive(Clone, Debug)]
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn uniform(&mut self) -> f64 {
        (self.roll() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The state of a search.
#[derive(Clone, Debug)]
pub struct Search {
    dice: Dice,
    step: f64,
    /// The worst input so far and its cost.
    pub worst: Option<(Genome, u32)>,
}

impl Search {
    /// A search that has tried nothing.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { dice: Dice(seed), step: STEP[0], worst: None }
    }

    /// The candidates of the next round, `count` of them.
    pub fn breed(&mut self, count: usize) -> Vec<Genome> {
        (0..count).map(|_| self.candidate()).collect()
    }

    fn candidate(&mut self) -> Genome {
        let fresh = self.dice.roll().is_multiple_of(FRESH);
        match self.worst {
            Some((parent, _)) if !fresh => parent.map(|gene| {
                // About four genes change.
                if self.dice.uniform() < 4.0 / GENES as f64 {
                    (gene + self.step * (2.0 * self.dice.uniform() - 1.0)).clamp(0.0, 1.0)
                } else {
                    gene
                }
            }),
            _ => std::array::from_fn(|_| self.dice.uniform()),
        }
    }

    /// Learns what the candidates of a round cost.
    pub fn learn(&mut self, costs: &[(Genome, u32)]) {
        let before = self.worst.map(|(_, cost)| cost);
        for candidate in costs {
            if self.worst.is_none_or(|(_, worst)| candidate.1 > worst) {
                self.worst = Some(*candidate);
            }
        }
        let better = self.worst.map(|(_, cost)| cost) > before;
        self.step = if better { (self.step * 1.5).min(STEP[0]) } else { (self.step * 0.8).max(STEP[1]) };
    }
}

/// A number between two ends.
fn between([low, high]: [f64; 2], gene: f64) -> f64 {
    // Three decimals are enough for any of them, and make a file that can be read.
    ((low + (high - low) * gene) * 1e3).round() / 1e3
}

/// The fields of a scenario that a genome stands for.
#[must_use]
pub fn fields(genome: &Genome) -> Vec<String> {
    let (world, faults) = genome.split_at(WORLD_GENES);
    let ends = [
        ("entry.flight_path_angle_deg", [-18.0, -11.0]),
        ("entry.speed_mps", [5200.0, 5800.0]),
        ("entry.altitude_km", [115.0, 135.0]),
        ("entry.heading_deg", [82.0, 88.0]),
        ("atmosphere.density_scale", [0.5, 1.8]),
        ("atmosphere.perturbation.sigma", [0.0, 0.2]),
        ("control.initial_bank_deg", [-90.0, 90.0]),
        ("target.longitude_deg", [-76.0, -70.0]),
    ];
    let mut fields: Vec<String> =
        ends.iter().zip(world).map(|((field, ends), gene)| format!("{field}={:?}", between(*ends, *gene))).collect();
    if world[8] > 0.3 {
        fields.push(SOURCES.to_owned());
    }
    if world[9] > 0.5 {
        fields.push("sensors.radio.blackout={above_speed_mps=10000,below_altitude_km=0}".to_owned());
    }
    fields.push("time_limit_s=320.0".to_owned());
    let list: Vec<String> = faults.chunks_exact(FAULT_GENES).filter_map(fault_of).collect();
    fields.push(format!("fault=[{}]", list.join(",")));
    fields
}

/// Half of the choices strike the line, where packets can pile up.
fn fault_of(genes: &[f64]) -> Option<String> {
    let &[kind, start, duration, first, second] = genes else { return None };
    let line = BYTES_PER_FRAME as f64;
    let numbers = |pairs: &[(&str, f64)]| {
        pairs.iter().map(|(name, value)| format!("{name}={value:?}")).collect::<Vec<_>>().join(",")
    };
    let (kind, target, parameters) = match (kind * 14.0) as u32 {
        0 => return None,
        1 => ("bias", "accelerometer", numbers(&[("value", between([-20.0, 20.0], first))])),
        2 => ("stuck", "accelerometer", String::new()),
        3 => ("bias", "gyro", numbers(&[("value", between([-20.0, 20.0], first))])),
        4 => ("dropout", "imu", String::new()),
        5 => ("stuck", "imu", String::new()),
        6 => ("bias", "pressure", numbers(&[("value", between([-3000.0, 3000.0], first))])),
        7 => ("bias", "radio", numbers(&[("value", between([-20_000.0, 20_000.0], first))])),
        8 => ("dropout", "uplink", String::new()),
        9 => ("bit-flips", "uplink", numbers(&[("per_packet", first)])),
        10 | 11 => ("duplicate", "uplink", numbers(&[("copies", between([0.0, 60.0], first).round())])),
        12 => ("hold", "uplink", String::new()),
        _ => {
            let (bytes, piece) = (between([0.0, line], first).round(), between([1.0, 400.0], second * second).round());
            ("garbage", "uplink", numbers(&[("bytes", bytes), ("piece", piece)]))
        }
    };
    // Holding back ends in a burst: short times make many frames of it.
    let longest = if matches!(kind, "hold" | "dropout") { 2.0 } else { 60.0 };
    Some(fault(kind, target, between([0.0, 280.0], start), between([0.02, longest], duration), &parameters))
}

/// The flight that a genome stands for.
///
/// # Errors
/// The scenario is wrong.
pub fn flight(genome: &Genome) -> Result<HardFlight, HostError> {
    let fields = fields(genome);
    let sets: Vec<&str> = fields.iter().map(String::as_str).collect();
    HardFlight::new("candidate", "msl", &sets)
}

/// A scenario file of the fields, over the default scenario.
#[must_use]
pub fn scenario_file(genome: &Genome, comment: &[String]) -> String {
    let mut text: String = comment.iter().map(|line| format!("# {line}\n")).collect();
    text.push_str("name = \"worst-frame\"\n");
    let mut fields = fields(genome);
    // A dotted key before the first table is a field of the whole document.
    fields.sort_by_key(|field| field.starts_with("fault") || field.starts_with("beacon"));
    for field in fields {
        let (name, value) = field.split_once('=').unwrap_or((&field, ""));
        // Writing into a string cannot fail.
        let _ = match value.strip_prefix('[').and_then(|list| list.strip_suffix(']')) {
            Some(list) => {
                let rows = list.replace("},{", "},\n    {").replace("},     {", "},\n    {");
                writeln!(text, "{name} = [\n    {rows}\n]")
            }
            None => writeln!(text, "{name} = {value}"),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use hil_sim::scenario::Scenario;

    /// Dearest where every gene is a quarter.
    fn cost(genome: &Genome) -> u32 {
        let distance: f64 = genome.iter().map(|gene| (gene - 0.25).powi(2)).sum();
        (1e6 / (1.0 + distance)) as u32
    }

    fn found(seed: u64, rounds: usize) -> Search {
        let mut search = Search::new(seed);
        for _ in 0..rounds {
            let costs: Vec<_> = search.breed(ROUND).into_iter().map(|genome| (genome, cost(&genome))).collect();
            search.learn(&costs);
        }
        search
    }

    #[test]
    fn the_search_climbs_and_never_loses_its_worst() {
        let costs: Vec<u32> = [1, 20, 200].map(|rounds| found(3, rounds).worst.unwrap().1).to_vec();
        assert!(costs.is_sorted(), "{costs:?}");
        // Uniform genes lie 5.1 from the optimum on average; a climb of 200 rounds halves that twice.
        assert!(costs[2] > 450_000, "{costs:?}");
    }

    #[test]
    fn a_search_depends_on_its_seed_and_on_nothing_else() {
        assert_eq!(found(5, 10).worst, found(5, 10).worst);
        assert_ne!(found(5, 10).worst, found(6, 10).worst);
    }

    #[test]
    fn every_genome_is_a_scenario_that_can_be_flown_and_written() {
        let mut search = Search::new(9);
        for genome in search.breed(200) {
            let flight = flight(&genome).unwrap_or_else(|e| panic!("{e}: {:?}", fields(&genome)));
            let text = scenario_file(&genome, &["found".to_owned()]);
            let read =
                Scenario::from_text("worst-frame", &text, Path::new(""), &[]).unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert_eq!(Scenario { name: "msl".into(), ..read }, flight.scenario);
        }
    }
}
