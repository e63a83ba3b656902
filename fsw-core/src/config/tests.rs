//! Tests of the parameter tree as a whole.

use super::limits::{
    ATMOSPHERE, BEACON, CONSTRAINTS, CONTROL, DEPLOY, ESTIMATORS, GUIDANCE, INITIAL_KNOWLEDGE, Limit, NAVIGATION,
    ORBITER, PLANET, TARGET, VEHICLE,
};
use super::*;
use crate::link::framing::{MAX_FRAME, decode, encode};
use crate::link::parameters::{GuidanceMode, NavigationMode, TriggerKind};
use std::vec::Vec;

/// A config that differs from the default in every kind of block, with both tables over several blocks.
fn loaded() -> Config {
    let mut config = Config::DEFAULT;
    for block in sample_blocks() {
        config.apply(&block).unwrap();
    }
    config
}

fn sample_blocks() -> Vec<ParameterBlock> {
    let d = Config::DEFAULT;
    let mut blocks = std::vec![
        ParameterBlock::Modes(Modes {
            navigation: NavigationMode::Ideal,
            guidance: GuidanceMode::Paper,
            trigger: TriggerKind::Range,
        }),
        ParameterBlock::Planet(Planet { radius_m: 3_389_500.0, ..d.planet }),
        ParameterBlock::Vehicle(VehicleParameters { mass_kg: 3_000.0, ..d.vehicle }),
        ParameterBlock::Atmosphere(AtmosphereParameters { scale_height_m: 7_500.0, ..d.atmosphere }),
        ParameterBlock::Target(Target { longitude_rad: 0.1, latitude_rad: -0.2 }),
        ParameterBlock::Deploy(DeployParameters { speed_mps: 440.0, ..d.deploy }),
        ParameterBlock::Source {
            slot: 3,
            source: RadioSource::Beacon { longitude_rad: 0.3, latitude_rad: 0.4, altitude_m: -50.0 },
        },
        ParameterBlock::InitialKnowledge(InitialKnowledge { position_sigma_m: 1.0, ..d.initial_knowledge }),
        ParameterBlock::Navigation(NavigationParameters { gate_sigma: 4.0, ..d.navigation }),
        ParameterBlock::Guidance(GuidanceParameters { max_iterations: 4, ..d.guidance }),
        ParameterBlock::Constraints(ConstraintParameters { load_mps2: 120.0, ..d.constraints }),
        ParameterBlock::Control(ControlParameters { lag_s: 0.25, ..d.control }),
        ParameterBlock::Estimators(EstimatorParameters { lift_sigma: 0.2, ..d.estimators }),
    ];
    for start in [0u8, 4, 8] {
        let rows = core::array::from_fn(|k| AeroRow {
            mach: f64::from(start) + k as f64,
            drag_coefficient: 1.4,
            lift_coefficient: -0.3,
        });
        blocks.push(ParameterBlock::AeroRows(AeroRows { start, total: 10, rows }));
        let rows = core::array::from_fn(|k| AtmosphereRow {
            altitude_m: 1e4 * (f64::from(start) + k as f64),
            density_kgpm3: 1e-3,
            temperature_k: 200.0,
        });
        blocks.push(ParameterBlock::AtmosphereRows(AtmosphereRows { start, total: 12, rows }));
    }
    blocks
}

#[test]
fn the_defaults_are_valid() {
    assert_eq!(Config::DEFAULT.validate(), Ok(()));
}

#[test]
fn what_was_loaded_is_read_back_and_valid() {
    let config = loaded();
    assert_eq!(config.validate(), Ok(()));
    assert_eq!((config.aero_rows.len(), config.atmosphere_rows.len()), (10, 12));
    for id in config.blocks() {
        let block = config.read_back(id).unwrap();
        let mut copy = config.clone();
        copy.apply(&block).unwrap();
        assert_eq!(copy, config, "{id:?}");
    }
    for missing in [BlockId::AeroRows(12), BlockId::AeroRows(1), BlockId::Source(MAX_SOURCES as u8)] {
        assert_eq!(config.read_back(missing), None);
    }
}

#[test]
fn all_blocks_of_one_end_rebuild_it_at_the_other() {
    let ground = loaded();
    let mut board = Config::DEFAULT;
    assert_ne!(board.digest(), ground.digest());
    for id in ground.blocks() {
        let mut wire = [0; MAX_FRAME];
        let block = ground.read_back(id).unwrap();
        assert!(encode(&block, &mut wire).is_ok());
        board.apply(&block).unwrap();
    }
    assert_eq!(board, ground);
    assert_eq!(board.digest(), ground.digest());
}

#[test]
fn blocks_come_in_one_order_each_once_within_the_bound() {
    use BlockId as B;
    let expected = [
        B::Modes,
        B::Planet,
        B::Vehicle,
        B::AeroRows(0),
        B::AeroRows(4),
        B::AeroRows(8),
        B::Atmosphere,
        B::AtmosphereRows(0),
        B::AtmosphereRows(4),
        B::AtmosphereRows(8),
        B::Target,
        B::Deploy,
        B::Source(0),
        B::Source(1),
        B::Source(2),
        B::Source(3),
        B::InitialKnowledge,
        B::Navigation,
        B::Guidance,
        B::Constraints,
        B::Control,
        B::Estimators,
    ];
    assert_eq!(loaded().blocks().collect::<Vec<_>>(), expected);
    assert_eq!(Config::DEFAULT.blocks().count(), SINGLE_BLOCKS + MAX_SOURCES);
    assert_eq!(MAX_BLOCKS, 12 + 8 + 16 + 4);
}

#[test]
fn the_digest_notices_a_change_of_any_block() {
    let base = Config::DEFAULT.digest();
    let mut seen = std::vec![base];
    for block in sample_blocks() {
        let mut config = Config::DEFAULT;
        // Later blocks of a table need the ones before.
        if config.apply(&block).is_ok() {
            let digest = config.digest();
            assert!(!seen.contains(&digest), "{block:?}");
            seen.push(digest);
        }
    }
    assert!(seen.len() > 13);
}

#[test]
fn tables_with_gaps_or_out_of_order_are_refused() {
    let mut config = Config::DEFAULT;
    let row = |mach: f64| AeroRow { mach, drag_coefficient: 1.4, lift_coefficient: 0.3 };
    let block = |start, total, first: f64, step: f64| {
        let rows = core::array::from_fn(|k| row(first + step * k as f64));
        ParameterBlock::AeroRows(AeroRows { start, total, rows })
    };
    let bad = Err(Refusal::BadTable { block: BlockId::AeroRows(4) });
    assert_eq!(config.apply(&block(4, 8, 5.0, 1.0)), bad, "row 4 without row 0");
    config.apply(&block(0, 8, 1.0, 1.0)).unwrap();
    assert_eq!(config.validate(), Err(Refusal::BadTable { block: BlockId::AeroRows(0) }), "incomplete");
    config.apply(&block(4, 8, 4.0, 1.0)).unwrap();
    assert_eq!(config.validate(), Err(Refusal::BadTable { block: BlockId::AeroRows(0) }), "Mach 4 twice");
    config.apply(&block(4, 8, 5.0, 1.0)).unwrap();
    assert_eq!(config.validate(), Ok(()));
    let total = MAX_AERO_ROWS as u8 + 1;
    let refused = config.apply(&block(0, total, 1.0, 1.0));
    assert_eq!(refused, Err(Refusal::BadTable { block: BlockId::AeroRows(0) }));
}

#[test]
fn nobody_starts_inside_the_planet() {
    let mut config = Config::DEFAULT;
    config.apply(&ParameterBlock::Planet(Planet { radius_m: 4e6, mu_m3ps2: 6e13, ..config.planet })).unwrap();
    assert_eq!(config.validate(), Err(Refusal::OutOfRange { block: BlockId::Source(0), field: 1 }));
    config.apply(&ParameterBlock::Source { slot: 0, source: RadioSource::None }).unwrap();
    assert_eq!(config.validate(), Err(Refusal::OutOfRange { block: BlockId::InitialKnowledge, field: 0 }));
}

/// Postcard bytes of a struct of `f64` (and arrays of them) are the numbers in order: any field can be replaced by
/// its place, without naming it.
fn with_number_replaced(block: &ParameterBlock, header: usize, number: usize, value: f64) -> ParameterBlock {
    let mut bytes = [0u8; MAX_PAYLOAD];
    let len = postcard::to_slice(block, &mut bytes).unwrap().len();
    let at = header + 8 * number;
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
    decode(&bytes[..len]).unwrap()
}

/// A block of numbers only: the block, bytes before its first number, components and limit of each field.
type NumericBlock = (ParameterBlock, usize, Vec<(usize, Limit)>);

/// All of them.
fn numeric_blocks() -> Vec<NumericBlock> {
    let d = Config::DEFAULT;
    let scalars = |limits: &[Limit]| limits.iter().map(|l| (1, *l)).collect::<Vec<_>>();
    let beacon = RadioSource::Beacon { longitude_rad: 0.3, latitude_rad: 0.4, altitude_m: 0.0 };
    let shapes = [3, 3, 4, 1, 1, 1];
    std::vec![
        (ParameterBlock::Planet(d.planet), 1, scalars(&PLANET)),
        (ParameterBlock::Vehicle(d.vehicle), 1, scalars(&VEHICLE)),
        (ParameterBlock::Atmosphere(d.atmosphere), 1, scalars(&ATMOSPHERE)),
        (ParameterBlock::Target(d.target), 1, scalars(&TARGET)),
        (ParameterBlock::Deploy(d.deploy), 1, scalars(&DEPLOY)),
        (ParameterBlock::InitialKnowledge(d.initial_knowledge), 1, shapes.into_iter().zip(INITIAL_KNOWLEDGE).collect()),
        (ParameterBlock::Navigation(d.navigation), 1, scalars(&NAVIGATION)),
        (ParameterBlock::Constraints(d.constraints), 1, scalars(&CONSTRAINTS)),
        (ParameterBlock::Control(d.control), 1, scalars(&CONTROL)),
        (ParameterBlock::Estimators(d.estimators), 1, scalars(&ESTIMATORS)),
        // Tag, slot, tag of the source; the slot is field 0.
        (ParameterBlock::Source { slot: 1, source: d.sources[0] }, 3, ORBITER.map(|l| (3, l)).to_vec()),
        (ParameterBlock::Source { slot: 1, source: beacon }, 3, scalars(&BEACON)),
    ]
}

#[test]
fn every_number_of_every_block_is_checked_and_named() {
    let mut checked = 0;
    for (block, header, fields) in numeric_blocks() {
        let first_field = header / 3;
        let mut number = 0;
        for (index, (components, limit)) in fields.iter().enumerate() {
            for _ in 0..*components {
                let beyond = limit.max + 1e-6 * (1.0 + limit.max.abs());
                let below = limit.min - 1e-6 * (1.0 + limit.min.abs());
                for mad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, beyond, below] {
                    let mut config = Config::DEFAULT;
                    let refusal = config.apply(&with_number_replaced(&block, header, number, mad));
                    match refusal {
                        Err(Refusal::OutOfRange { field, .. }) => {
                            assert_eq!(usize::from(field), index + first_field, "{} = {mad}", limit.field);
                        }
                        other => panic!("{} = {mad} in {block:?}: {other:?}", limit.field),
                    }
                    assert_eq!(config, Config::DEFAULT, "a refused block changes nothing");
                    checked += 1;
                }
                number += 1;
            }
        }
    }
    assert!(checked > 400, "{checked}");
}

#[test]
fn guidance_numbers_around_its_one_integer_are_checked() {
    // Four numbers, one byte, ten numbers.
    let block = ParameterBlock::Guidance(Config::DEFAULT.guidance);
    for (index, limit) in GUIDANCE.iter().enumerate().filter(|(i, _)| *i != 4) {
        let (header, number) = if index < 4 { (1, index) } else { (2, index - 1) };
        for mad in [f64::NAN, limit.max * 1.01 + 1.0, limit.min - 1.0] {
            let refusal = Config::DEFAULT.clone().apply(&with_number_replaced(&block, header, number, mad));
            let field = index as u8;
            assert_eq!(refusal, Err(Refusal::OutOfRange { block: BlockId::Guidance, field }), "{}", limit.field);
        }
    }
    for max_iterations in [0, 21, 255] {
        let guidance = GuidanceParameters { max_iterations, ..Config::DEFAULT.guidance };
        let refusal = Config::DEFAULT.clone().apply(&ParameterBlock::Guidance(guidance));
        assert_eq!(refusal, Err(Refusal::OutOfRange { block: BlockId::Guidance, field: 4 }));
    }
}

#[test]
fn table_rows_are_checked_only_as_far_as_the_table_goes() {
    let mut rows = [AeroRow { mach: 1.0, drag_coefficient: 1.4, lift_coefficient: 0.3 }; ROWS_PER_BLOCK];
    rows[2].drag_coefficient = f64::NAN;
    let apply = |total| Config::DEFAULT.clone().apply(&ParameterBlock::AeroRows(AeroRows { start: 0, total, rows }));
    assert_eq!(apply(3), Err(Refusal::OutOfRange { block: BlockId::AeroRows(0), field: 7 }));
    assert_eq!(apply(2), Ok(()));
}

#[test]
fn fields_that_contradict_each_other_are_refused() {
    let d = Config::DEFAULT;
    let deploy = |edit: fn(&mut DeployParameters)| {
        let mut changed = d.deploy;
        edit(&mut changed);
        ParameterBlock::Deploy(changed)
    };
    let guidance = |edit: fn(&mut GuidanceParameters)| {
        let mut changed = d.guidance;
        edit(&mut changed);
        ParameterBlock::Guidance(changed)
    };
    for (block, expected) in [
        (deploy(|p| p.max_altitude_m = p.min_altitude_m), 5),
        (deploy(|p| p.max_mach = 0.5), 7),
        (deploy(|p| p.max_dynamic_pressure_pa = 1.0), 9),
        (deploy(|p| p.window_max_speed_mps = 399.0), 2),
        (guidance(|p| p.max_bank_rad = 0.0), 6),
        (guidance(|p| (p.predictor_step_s, p.prediction_horizon_s) = (0.1, 3_600.0)), 1),
        (ParameterBlock::Planet(Planet { mu_m3ps2: 1e9, ..d.planet }), 1),
        (
            ParameterBlock::InitialKnowledge(InitialKnowledge {
                attitude: [0.5; 4].map(|q| q * 1.1),
                ..d.initial_knowledge
            }),
            2,
        ),
        (ParameterBlock::InitialKnowledge(InitialKnowledge { position_m: [0.0; 3], ..d.initial_knowledge }), 0),
        (ParameterBlock::Source { slot: 4, source: RadioSource::None }, 0),
    ] {
        match Config::DEFAULT.clone().apply(&block) {
            Err(Refusal::OutOfRange { field, .. }) => assert_eq!(field, expected, "{block:?}"),
            other => panic!("{block:?}: {other:?}"),
        }
    }
}

#[test]
fn without_parameters_nothing_is_armed() {
    assert!(Config::DORMANT.validate().is_err());
    let mut config = Config::DORMANT;
    config.wake();
    assert_eq!((config.validate(), config), (Ok(()), Config::DEFAULT));
}
