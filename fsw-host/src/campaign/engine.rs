//! Flies the runs of a campaign on all cores and hands on their rows in whole chunks.

use std::collections::BTreeMap;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use fsw_core::link::parameters::NavigationMode;
use hil_sim::case::Case;
use hil_sim::scenario::Scenario;
use rayon::prelude::*;

use super::columns::{Columns, RunResult};
use super::flight::Flyer;
use super::folder::Folder;
use super::observer::Flown;
use super::split;
use super::table::Row;
use crate::error::HostError;
use crate::record::ScenarioFacts;

/// What every flight of a campaign needs; the same for all.
pub struct Engine<'a> {
    /// What is flown.
    pub scenario: &'a Scenario,
    /// Its facts.
    pub facts: ScenarioFacts,
    /// Its columns.
    pub columns: Columns,
    /// Seed of the dispersions.
    pub seed: u64,
    /// Every how many runs are flown again for the split of the miss; 0 for none.
    pub split: u64,
}

impl<'a> Engine<'a> {
    /// An engine for a scenario.
    #[must_use]
    pub fn new(scenario: &'a Scenario, seed: u64, split: u64) -> Self {
        let facts = ScenarioFacts::of(scenario);
        let columns = Columns::of(scenario, &facts);
        Self { scenario, facts, columns, seed, split }
    }

    /// Flies one run, and again with less to contend with when it is one of those.
    ///
    /// # Errors
    /// The flight software cannot be told the scenario.
    pub fn fly(&self, flyer: &mut Flyer, run: u64) -> Result<RunResult, HostError> {
        let case = Case::draw(self.scenario, self.seed, run, false);
        let flown = self.fly_case(flyer, self.scenario, &case)?;
        let mut misses = [None; 2];
        if self.split > 0 && run.is_multiple_of(self.split) {
            let known = split::known_density(self.scenario, &case);
            misses[0] = self.fly_case(flyer, &known, &case)?.miss_m;
            misses[1] = match known.navigation.filter {
                NavigationMode::Ideal => misses[0],
                _ => self.fly_case(flyer, &split::ideal_navigation(known), &case)?.miss_m,
            };
        }
        Ok(RunResult { run, flown, split: misses, inputs: self.columns.inputs(&case) })
    }

    /// Flies a case; a panic is the end of that flight and of no other.
    fn fly_case(&self, flyer: &mut Flyer, scenario: &Scenario, case: &Case) -> Result<Flown, HostError> {
        let flight = || flyer.fly(scenario, &self.facts, case, &self.columns.grid_mps);
        catch_unwind(AssertUnwindSafe(flight)).unwrap_or_else(|_| {
            *flyer = Flyer::default();
            let bank_deg = vec![None; self.columns.grid_mps.len()];
            let reason = Some("the simulation panicked".to_owned());
            Ok(Flown { outcome: "failed", reason, bank_deg, ..Flown::default() })
        })
    }

    /// Flies every run of the given chunks and keeps them in the folder; `each` hears of every result.
    ///
    /// # Errors
    /// A flight cannot be flown, a chunk not be written, or the user has had enough: what was whole until then is kept.
    pub fn fly_all(
        &self,
        folder: &Folder,
        chunks: &[Range<u64>],
        jobs: usize,
        interrupt: &AtomicBool,
        each: &(impl Fn(&RunResult) + Sync),
    ) -> Result<(), HostError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build();
        let pool = pool.map_err(|e| HostError::Option(format!("{jobs} threads cannot be started: {e}")))?;
        let (headings, gatherer) = (self.columns.headings(), Gatherer::default());
        let runs = chunks.iter().flat_map(|chunk| chunk.clone().map(|run| (run, chunk.clone())));
        let flyers: Vec<Mutex<Flyer>> = (0..jobs.max(1)).map(|_| Mutex::default()).collect();
        // In the order of their numbers: no more chunks are open at a time than there are threads, and one.
        pool.install(|| {
            runs.par_bridge().try_for_each(|(run, chunk)| {
                if interrupt.load(Ordering::Relaxed) {
                    return Err(HostError::Interrupted);
                }
                let thread = rayon::current_thread_index().unwrap_or(0);
                let result = match flyers.get(thread).and_then(|flyer| flyer.lock().ok()) {
                    Some(mut flyer) => self.fly(&mut flyer, run)?,
                    None => self.fly(&mut Flyer::default(), run)?,
                };
                each(&result);
                match gatherer.put(self.columns.row(&result), &chunk) {
                    Some(whole) => folder.write_chunk(&headings, whole),
                    None => Ok(()),
                }
            })
        })
    }
}

/// Collects rows until their chunk is whole.
#[derive(Default)]
struct Gatherer {
    open: Mutex<BTreeMap<u64, Vec<Row>>>,
}

impl Gatherer {
    /// Takes a row; the whole chunk when it was the last of it.
    fn put(&self, row: Row, chunk: &Range<u64>) -> Option<Vec<Row>> {
        let mut open = self.open.lock().ok()?;
        let rows = open.entry(chunk.start).or_default();
        rows.push(row);
        let whole = rows.len() as u64 == chunk.end - chunk.start;
        if whole { open.remove(&chunk.start) } else { None }
    }
}
