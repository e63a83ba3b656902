//! Refusals in the words of a user.

use fsw_core::config::limits;
use fsw_core::link::packet::Refusal;
use fsw_core::link::parameters::BlockId;

/// One clause on why a command was refused.
pub fn explain(refusal: Refusal) -> String {
    match refusal {
        Refusal::AlreadyArmed => "it is armed already, and its parameters are frozen".into(),
        Refusal::NotArmed => "it is not armed".into(),
        Refusal::DigestMismatch { held } => format!("it holds parameters with the digest {held:#010x}"),
        Refusal::OutOfRange { block, field } => match limit(block, field) {
            Some(limit) => {
                format!("{}, field {} must be {} to {} {}", name(block), limit.field, limit.min, limit.max, limit.unit)
            }
            None => format!("{}, field {field} is out of range", name(block)),
        },
        Refusal::BadTable { block } => format!("{}: the table has gaps, does not rise or does not fit", name(block)),
        Refusal::WrongMode => "it makes no sense in the present mode".into(),
    }
}

/// A block in words.
pub fn name(block: BlockId) -> String {
    match block {
        BlockId::AeroRows(row) => format!("aerodynamic table from row {row}"),
        BlockId::AtmosphereRows(row) => format!("atmosphere table from row {row}"),
        BlockId::Source(slot) => format!("radio source {slot}"),
        BlockId::InitialKnowledge => "initial knowledge".into(),
        other => format!("{other:?}").to_lowercase() + " block",
    }
}

fn limit(block: BlockId, field: u8) -> Option<limits::Limit> {
    let table: &[limits::Limit] = match block {
        BlockId::Planet => &limits::PLANET,
        BlockId::Vehicle => &limits::VEHICLE,
        BlockId::Atmosphere => &limits::ATMOSPHERE,
        BlockId::Target => &limits::TARGET,
        BlockId::Deploy => &limits::DEPLOY,
        BlockId::InitialKnowledge => &limits::INITIAL_KNOWLEDGE,
        BlockId::Navigation => &limits::NAVIGATION,
        BlockId::Guidance => &limits::GUIDANCE,
        BlockId::Constraints => &limits::CONSTRAINTS,
        BlockId::Control => &limits::CONTROL,
        BlockId::Estimators => &limits::ESTIMATORS,
        BlockId::Modes | BlockId::AeroRows(_) | BlockId::AtmosphereRows(_) | BlockId::Source(_) => return None,
    };
    table.get(usize::from(field)).copied()
}
