//! One fully determined flight: every physical quantity, every sensor error, every seed. Plain numbers in SI units.

use fsw_core::frames::Rot;
use fsw_core::link::parameters::InitialKnowledge;

use crate::actuator::{Bank, Limits};
use crate::attitude::FlowAxes;
use crate::dynamics::{Motion, World};
use crate::noise::Stream;
use crate::orbiter::Source;
use crate::sensors::{ImuErrors, PressureErrors, RadioErrors};

/// One flight, ready to be simulated.
#[derive(Clone, Debug)]
pub struct Case {
    /// Planet, air, wind and vehicle.
    pub world: World,
    /// Inertial position and velocity at the epoch.
    pub entry: Motion,
    /// Bank and bank rate at the epoch.
    pub bank: Bank,
    /// What the actuator can do.
    pub actuator: Limits,
    /// Errors of the inertial unit.
    pub imu: ImuErrors,
    /// Errors of the pressure port.
    pub pressure: PressureErrors,
    /// Pressure measurements per second; 0 for none.
    pub pressure_rate_hz: f64,
    /// Errors and rules of the radio.
    pub radio: RadioErrors,
    /// Radio measurements of each source per second; 0 for none.
    pub radio_rate_hz: f64,
    /// Radio sources, in the slots of the link.
    pub sources: Vec<Source>,
    /// What the navigator is told about the epoch.
    pub knowledge: InitialKnowledge,
    /// Seed and run of the white noise of the sensors.
    pub noise: NoiseKey,
    /// Every dispersed quantity by name, as applied.
    pub applied: Vec<(&'static str, f64)>,
}

/// What keys the streams of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoiseKey {
    /// Seed of the campaign.
    pub seed: u64,
    /// Run of the campaign.
    pub run: u64,
}

impl NoiseKey {
    /// The stream of one purpose.
    #[must_use]
    pub fn stream(&self, purpose: &str) -> Stream {
        Stream::new(self.seed, self.run, purpose)
    }
}

impl Case {
    /// A flight without sensor errors whose navigator knows the epoch exactly.
    #[must_use]
    pub fn undisturbed(world: World, entry: Motion, initial_bank_rad: f64, actuator: Limits) -> Self {
        let bank = Bank { angle_rad: initial_bank_rad, ..Bank::default() };
        let knowledge = exact_knowledge(&world, &entry, initial_bank_rad);
        Self {
            world,
            entry,
            bank,
            actuator,
            imu: ImuErrors::PERFECT,
            pressure: PressureErrors::PERFECT,
            pressure_rate_hz: 10.0,
            radio: RadioErrors {
                range_noise_m: 0.0,
                range_rate_noise_mps: 0.0,
                min_elevation_rad: 0.0,
                blackout: None,
            },
            radio_rate_hz: 1.0,
            sources: Vec::new(),
            knowledge,
            noise: NoiseKey::default(),
            applied: Vec::new(),
        }
    }
}

/// Knowledge of the epoch without error: the true position, velocity and trim attitude.
#[must_use]
pub fn exact_knowledge(world: &World, entry: &Motion, initial_bank_rad: f64) -> InitialKnowledge {
    let flow = world.flow(&entry.r_i, &entry.v_i);
    let alpha = world.vehicle.trim_angle_of_attack_rad;
    let attitude = FlowAxes::new(&entry.r_i, &flow.v_air_i).attitude_bi(initial_bank_rad, alpha);
    InitialKnowledge {
        position_m: entry.r_i.to_array(),
        velocity_mps: entry.v_i.to_array(),
        attitude: Rot::quaternion(&attitude),
        position_sigma_m: 0.0,
        velocity_sigma_mps: 0.0,
        attitude_sigma_rad: 0.0,
    }
}
