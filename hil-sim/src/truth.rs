//! The simulator: advances the truth by one minor frame under a bank command and says what the sensors measured.

use fsw_core::frames::{Body, Inertial, PlanetRelative, Rot, Vec3};
use fsw_core::link::packet;
use fsw_core::time::{FRAME, MissionTime};

use crate::actuator::{Bank, BankMotion};
use crate::angle::wrap_rad;
use crate::attitude::{FlowAxes, Turn, force_b};
use crate::case::Case;
use crate::dynamics::{Flow, Motion};
use crate::orbiter::State;
use crate::sensors::{ImuSensor, PressureSensor, RadioSensor, period_frames, stagnation_pressure_pa};

/// What the sensors said at the end of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FramePackets {
    /// Stagnation pressure, when due.
    pub pressure: Option<packet::Pressure>,
    /// Radio measurements, when due and heard.
    pub radio: Vec<packet::Radio>,
    /// Inertial increments of the frame.
    pub imu: packet::Imu,
}

/// True increments of the last frame, before any sensor error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Increments {
    /// Specific force integrated in the turning body axes, m/s.
    pub delta_v_b: Vec3<Body>,
    /// Rotation vector of the body axes over the frame, rad.
    pub delta_theta_b: Vec3<Body>,
}

/// The true state with what is derived from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthState {
    /// Time after the epoch, s.
    pub time_s: f64,
    /// Inertial position, m.
    pub r_i: Vec3<Inertial>,
    /// Inertial velocity, m/s.
    pub v_i: Vec3<Inertial>,
    /// Planet-relative spherical state.
    pub relative: PlanetRelative,
    /// Altitude over the reference sphere, m.
    pub altitude_m: f64,
    /// Bank about the air-relative velocity, rad; not wrapped.
    pub bank_rad: f64,
    /// Bank rate, rad/s.
    pub bank_rate_radps: f64,
    /// Air-relative speed, m/s.
    pub air_speed_mps: f64,
    /// Air-relative Mach number.
    pub mach: f64,
    /// Air-relative dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
    /// Sensed load, g.
    pub load_g: f64,
    /// Convective heat flux, W/m².
    pub heat_flux_wpm2: f64,
    /// Density, kg/m³.
    pub density_kgpm3: f64,
    /// Temperature, K.
    pub temperature_k: f64,
}

/// One flight in progress.
#[derive(Clone, Debug)]
pub struct Truth {
    case: Case,
    frame: u32,
    motion: Motion,
    bank: Bank,
    flow: Flow,
    axes: FlowAxes,
    /// Trim angle of attack.
    alpha: Turn,
    attitude_bi: Rot<Body, Inertial>,
    increments: Increments,
    imu: ImuSensor,
    pressure: PressureSensor,
    radio: RadioSensor,
    packets: FramePackets,
}

impl Truth {
    /// The flight of a case, at the epoch.
    #[must_use]
    pub fn new(case: &Case) -> Self {
        let flow = case.world.flow(&case.entry.r_i, &case.entry.v_i);
        let axes = FlowAxes::new(&case.entry.r_i, &flow.v_air_i);
        let alpha = Turn::new(case.world.vehicle.trim_angle_of_attack_rad);
        let noise = case.noise;
        Self {
            frame: 0,
            motion: Motion::new(case.entry.r_i, case.entry.v_i),
            bank: case.bank,
            flow,
            axes,
            alpha,
            attitude_bi: axes.attitude_at(&Turn::new(case.bank.angle_rad), &alpha),
            increments: Increments { delta_v_b: Vec3::zero(), delta_theta_b: Vec3::zero() },
            imu: ImuSensor::new(case.imu, noise.stream("imu noise")),
            pressure: PressureSensor::new(case.pressure, noise.stream("pressure noise")),
            radio: RadioSensor::new(case.radio, &case.sources, |slot| noise.stream(&format!("radio noise {slot}"))),
            packets: FramePackets::default(),
            case: case.clone(),
        }
    }

    /// Advances by one minor frame with the commanded bank acceleration held, and takes the measurements due at its end.
    /// The commanded rate is not used: see [`crate::actuator`].
    pub fn advance(&mut self, bank_accel_radps2: f64, _bank_rate_radps: f64) {
        let frame_s = FRAME.as_s();
        let bank = BankMotion::new(self.bank, bank_accel_radps2, &self.case.actuator, frame_s);
        // One integration step in a minor frame of 20 ms: enough for a final error below a millimetre.
        let turns = [0.0, 0.5 * frame_s, frame_s].map(|t| Turn::new(bank.at(t).angle_rad));
        let from = Motion::new(self.motion.r_i, self.motion.v_i);
        let motion = self.case.world.step_from(&from, (&self.flow, &self.axes), frame_s, &turns);
        let before = self.attitude_bi;
        self.frame += 1;
        self.motion = motion;
        self.bank = bank.at(frame_s);
        self.flow = self.case.world.flow(&motion.r_i, &motion.v_i);
        self.axes = FlowAxes::new(&motion.r_i, &self.flow.v_air_i);
        self.attitude_bi = self.axes.attitude_at(&turns[2], &self.alpha);
        let turn = self.attitude_bi.then(&before.inverse());
        self.increments = Increments {
            delta_v_b: force_b(motion.drag_sum_mps, motion.lift_sum_mps, &self.alpha),
            delta_theta_b: Vec3::from_components(Rot::<Body, Body>::rotation_vector(&turn)),
        };
        self.packets = self.measure(frame_s);
    }

    fn measure(&mut self, frame_s: f64) -> FramePackets {
        let due = |rate_hz: f64| period_frames(rate_hz).is_some_and(|period| self.frame.is_multiple_of(period));
        let world = &self.case.world;
        let imu = self.imu.measure(&self.increments.delta_v_b, &self.increments.delta_theta_b, frame_s);
        let pressure = due(self.case.pressure_rate_hz).then(|| {
            let air = &world.atmosphere;
            let static_pa = self.flow.density_kgpm3 * air.gas_constant_jpkgk * air.temperature_k(self.flow.altitude_m);
            let stagnation = stagnation_pressure_pa(static_pa, self.flow.dynamic_pressure_pa, world.mach(&self.flow));
            self.pressure.measure(stagnation)
        });
        let radio = if due(self.case.radio_rate_hz) {
            let vehicle = State { r_i: self.motion.r_i, v_i: self.motion.v_i };
            let speed = (self.motion.v_i - crate::dynamics::surface_velocity(&vehicle.r_i, &world.planet)).norm();
            self.radio.measure(self.time().as_s(), &vehicle, speed, self.flow.altitude_m, &world.planet)
        } else {
            Vec::new()
        };
        FramePackets { pressure, radio, imu }
    }

    /// What the sensors said at the end of the last frame; nothing before the first.
    #[must_use]
    pub fn frame_packets(&self) -> &FramePackets {
        &self.packets
    }

    /// True increments of the last frame.
    #[must_use]
    pub fn increments(&self) -> Increments {
        self.increments
    }

    /// The flow about the vehicle now.
    #[must_use]
    pub fn flow(&self) -> &Flow {
        &self.flow
    }

    /// Planet-relative speed now, m/s.
    #[must_use]
    pub fn speed_mps(&self) -> f64 {
        (self.motion.v_i - crate::dynamics::surface_velocity(&self.motion.r_i, &self.case.world.planet)).norm()
    }

    /// Bank about the air-relative velocity now, rad; not wrapped.
    #[must_use]
    pub fn bank_rad(&self) -> f64 {
        self.bank.angle_rad
    }

    /// Frames flown.
    #[must_use]
    pub fn frame(&self) -> u32 {
        self.frame
    }

    /// Time of the end of the last frame.
    #[must_use]
    pub fn time(&self) -> MissionTime {
        MissionTime::of_frame(self.frame)
    }

    /// The case that is flown.
    #[must_use]
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// Altitude over the reference sphere, m.
    #[must_use]
    pub fn altitude_m(&self) -> f64 {
        self.flow.altitude_m
    }

    /// The truth packet of this instant.
    #[must_use]
    pub fn packet(&self) -> packet::Truth {
        packet::Truth {
            position_m: self.motion.r_i.to_array(),
            velocity_mps: self.motion.v_i.to_array(),
            attitude: self.attitude_bi.quaternion(),
            bank_rad: wrap_rad(self.bank.angle_rad),
            bank_rate_radps: self.bank.rate_radps,
            density_kgpm3: self.flow.density_kgpm3,
            mach: self.case.world.mach(&self.flow),
            dynamic_pressure_pa: self.flow.dynamic_pressure_pa,
        }
    }

    /// The full state of this instant.
    #[must_use]
    pub fn state(&self) -> TruthState {
        let world = &self.case.world;
        let time_s = self.time().as_s();
        TruthState {
            time_s,
            r_i: self.motion.r_i,
            v_i: self.motion.v_i,
            relative: self.motion.planet_relative(time_s, &world.planet),
            altitude_m: self.flow.altitude_m,
            bank_rad: self.bank.angle_rad,
            bank_rate_radps: self.bank.rate_radps,
            air_speed_mps: self.flow.v_air_i.norm(),
            mach: world.mach(&self.flow),
            dynamic_pressure_pa: self.flow.dynamic_pressure_pa,
            load_g: world.load_g(&self.flow),
            heat_flux_wpm2: world.heat_flux_wpm2(&self.flow),
            density_kgpm3: self.flow.density_kgpm3,
            temperature_k: world.atmosphere.temperature_k(self.flow.altitude_m),
        }
    }
}

#[cfg(test)]
mod tests;
