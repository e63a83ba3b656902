//! The parameter tree: everything the flight software is told before it is armed, checked field by field.
//!
//! Parameters arrive as blocks ([`Config::apply`]), are read back by name ([`Config::read_back`]) and accepted as a
//! whole ([`Config::validate`], [`Config::digest`]). [`Config::DEFAULT`] is the default entry. Allowed ranges are in
//! [`limits`]. A block that is refused changes nothing.

mod checks;
mod defaults;
mod dormant;
pub mod limits;
mod table;

pub use table::RowTable;

use crate::link::framing::{CRC32, MAX_PAYLOAD};
use crate::link::packet::{MAX_SOURCES, Refusal};
use crate::link::parameters::{
    AeroRow, AeroRows, AtmosphereParameters, AtmosphereRow, AtmosphereRows, BlockId, ConstraintParameters,
    ControlParameters, DeployParameters, EstimatorParameters, GuidanceParameters, InitialKnowledge, MAX_AERO_ROWS,
    MAX_ATMOSPHERE_ROWS, Modes, NavigationParameters, ParameterBlock, ROWS_PER_BLOCK, RadioSource, Target,
    VehicleParameters,
};
use crate::planet::Planet;
use checks::check;

/// All parameters, one field per kind of block.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Algorithms to run.
    pub modes: Modes,
    /// Planet.
    pub planet: Planet,
    /// Vehicle.
    pub vehicle: VehicleParameters,
    /// Mach table of the aerodynamics; empty when the coefficients of `vehicle` hold throughout.
    pub aero_rows: RowTable<AeroRow, MAX_AERO_ROWS>,
    /// Atmosphere.
    pub atmosphere: AtmosphereParameters,
    /// Atmosphere table; empty when the exponential law of `atmosphere` holds.
    pub atmosphere_rows: RowTable<AtmosphereRow, MAX_ATMOSPHERE_ROWS>,
    /// Target.
    pub target: Target,
    /// Parachute trigger.
    pub deploy: DeployParameters,
    /// Radio sources, by slot.
    pub sources: [RadioSource; MAX_SOURCES],
    /// Initial knowledge.
    pub initial_knowledge: InitialKnowledge,
    /// Filter settings.
    pub navigation: NavigationParameters,
    /// Guidance settings.
    pub guidance: GuidanceParameters,
    /// Path limits.
    pub constraints: ConstraintParameters,
    /// Bank control.
    pub control: ControlParameters,
    /// Settings of the filters over the onboard model.
    pub estimators: EstimatorParameters,
}

impl Default for Config {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Blocks of a full table.
const AERO_BLOCKS: usize = MAX_AERO_ROWS.div_ceil(ROWS_PER_BLOCK);
const ATMOSPHERE_BLOCKS: usize = MAX_ATMOSPHERE_ROWS.div_ceil(ROWS_PER_BLOCK);
/// Kinds of block that occur exactly once.
const SINGLE_BLOCKS: usize = 12;
/// Largest number of blocks of a parameter set.
pub const MAX_BLOCKS: usize = SINGLE_BLOCKS + AERO_BLOCKS + ATMOSPHERE_BLOCKS + MAX_SOURCES;

impl Config {
    /// Replaces one block if every field is finite and within its [`limits`].
    ///
    /// A table is sent from row 0 upwards; its first block clears what was there. Blocks may be repeated.
    ///
    /// # Errors
    /// [`Refusal::OutOfRange`] with the first offending field, [`Refusal::BadTable`] for rows that do not fit or
    /// leave a gap. Nothing is changed then.
    pub fn apply(&mut self, block: &ParameterBlock) -> Result<(), Refusal> {
        check(block)?;
        match block {
            ParameterBlock::Modes(v) => self.modes = *v,
            ParameterBlock::Planet(v) => self.planet = *v,
            ParameterBlock::Vehicle(v) => self.vehicle = *v,
            ParameterBlock::AeroRows(v) => self
                .aero_rows
                .load(v.start, v.total, &v.rows)
                .map_err(|_| Refusal::BadTable { block: BlockId::AeroRows(v.start) })?,
            ParameterBlock::Atmosphere(v) => self.atmosphere = *v,
            ParameterBlock::AtmosphereRows(v) => self
                .atmosphere_rows
                .load(v.start, v.total, &v.rows)
                .map_err(|_| Refusal::BadTable { block: BlockId::AtmosphereRows(v.start) })?,
            ParameterBlock::Target(v) => self.target = *v,
            ParameterBlock::Deploy(v) => self.deploy = *v,
            ParameterBlock::Source { slot, source } => {
                let refusal = Refusal::OutOfRange { block: BlockId::Source(*slot), field: 0 };
                *self.sources.get_mut(usize::from(*slot)).ok_or(refusal)? = *source;
            }
            ParameterBlock::InitialKnowledge(v) => self.initial_knowledge = *v,
            ParameterBlock::Navigation(v) => self.navigation = *v,
            ParameterBlock::Guidance(v) => self.guidance = *v,
            ParameterBlock::Constraints(v) => self.constraints = *v,
            ParameterBlock::Control(v) => self.control = *v,
            ParameterBlock::Estimators(v) => self.estimators = *v,
        }
        Ok(())
    }

    /// The block of this name as it is held; `None` for a slot or row that does not exist. Row 0 of an empty table
    /// is answered by a block of no rows.
    #[must_use]
    pub fn read_back(&self, id: BlockId) -> Option<ParameterBlock> {
        Some(match id {
            BlockId::Modes => ParameterBlock::Modes(self.modes),
            BlockId::Planet => ParameterBlock::Planet(self.planet),
            BlockId::Vehicle => ParameterBlock::Vehicle(self.vehicle),
            BlockId::AeroRows(start) => {
                let (total, rows) = self.aero_rows.block(start)?;
                ParameterBlock::AeroRows(AeroRows { start, total, rows })
            }
            BlockId::Atmosphere => ParameterBlock::Atmosphere(self.atmosphere),
            BlockId::AtmosphereRows(start) => {
                let (total, rows) = self.atmosphere_rows.block(start)?;
                ParameterBlock::AtmosphereRows(AtmosphereRows { start, total, rows })
            }
            BlockId::Target => ParameterBlock::Target(self.target),
            BlockId::Deploy => ParameterBlock::Deploy(self.deploy),
            BlockId::Source(slot) => ParameterBlock::Source { slot, source: *self.sources.get(usize::from(slot))? },
            BlockId::InitialKnowledge => ParameterBlock::InitialKnowledge(self.initial_knowledge),
            BlockId::Navigation => ParameterBlock::Navigation(self.navigation),
            BlockId::Guidance => ParameterBlock::Guidance(self.guidance),
            BlockId::Constraints => ParameterBlock::Constraints(self.constraints),
            BlockId::Control => ParameterBlock::Control(self.control),
            BlockId::Estimators => ParameterBlock::Estimators(self.estimators),
        })
    }

    /// Names of all blocks held, in canonical order: that of [`ParameterBlock`], tables from row 0 upwards (an empty
    /// table has none), sources by slot (empty slots included). At most [`MAX_BLOCKS`].
    pub fn blocks(&self) -> impl Iterator<Item = BlockId> + use<> {
        let aero = block_starts(self.aero_rows.len()).map(BlockId::AeroRows);
        let atmosphere = block_starts(self.atmosphere_rows.len()).map(BlockId::AtmosphereRows);
        let sources = (0u8..).take(MAX_SOURCES).map(BlockId::Source);
        [BlockId::Modes, BlockId::Planet, BlockId::Vehicle]
            .into_iter()
            .chain(aero)
            .chain([BlockId::Atmosphere])
            .chain(atmosphere)
            .chain([BlockId::Target, BlockId::Deploy])
            .chain(sources)
            .chain([
                BlockId::InitialKnowledge,
                BlockId::Navigation,
                BlockId::Guidance,
                BlockId::Constraints,
                BlockId::Control,
                BlockId::Estimators,
            ])
    }

    /// CRC-32 over the postcard bytes of all blocks in the order of [`Config::blocks`]. The ground computes it by
    /// applying what it sent to a `Config` of its own.
    #[must_use]
    pub fn digest(&self) -> u32 {
        let mut crc = CRC32.digest();
        let mut bytes = [0u8; MAX_PAYLOAD];
        for block in self.blocks().filter_map(|id| self.read_back(id)) {
            if let Ok(encoded) = postcard::to_slice(&block, &mut bytes) {
                crc.update(encoded);
            }
        }
        crc.finalize()
    }

    /// Checks the parameters as a whole: every block again, tables complete and ascending, and what depends on more
    /// than one block.
    ///
    /// # Errors
    /// The first refusal in the order of [`Config::blocks`].
    pub fn validate(&self) -> Result<(), Refusal> {
        for block in self.blocks().filter_map(|id| self.read_back(id)) {
            check(&block)?;
        }
        if !self.aero_rows.is_complete() || !ascending(self.aero_rows.iter().map(|r| r.mach)) {
            return Err(Refusal::BadTable { block: BlockId::AeroRows(0) });
        }
        if !self.atmosphere_rows.is_complete() || !ascending(self.atmosphere_rows.iter().map(|r| r.altitude_m)) {
            return Err(Refusal::BadTable { block: BlockId::AtmosphereRows(0) });
        }
        checks::check_together(self)
    }
}

/// First rows of the blocks of a table of `rows` rows. Tables have at most 64 rows, so the casts cannot lose anything.
fn block_starts(rows: usize) -> impl Iterator<Item = u8> {
    (0..rows.div_ceil(ROWS_PER_BLOCK)).filter_map(|k| u8::try_from(k * ROWS_PER_BLOCK).ok())
}

/// Whether each number is larger than the one before.
fn ascending(mut keys: impl Iterator<Item = f64>) -> bool {
    let Some(mut last) = keys.next() else { return true };
    keys.all(|key| {
        let larger = key > last;
        last = key;
        larger
    })
}

#[cfg(test)]
mod tests;
