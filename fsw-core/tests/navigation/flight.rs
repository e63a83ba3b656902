//! One dispersed flight through the navigator, and what came of it.

use fsw_core::config::Config;
use fsw_core::frames::{Inertial, PlanetRelative, Rot, Vec3};
use fsw_core::link::packet::{Innovation, MAX_SOURCES, MeasurementKind, NavTlm, Verdict};
use fsw_core::link::parameters::{
    EstimatorParameters, InitialKnowledge, NavigationMode, NavigationParameters, RadioSource,
};
use fsw_core::model::OnboardModel;
use fsw_core::model::orbiter::SourceState;
use fsw_core::nav::modelled::watch::GivenUp;
use fsw_core::nav::{Estimate, NavContext, NavCounters, Navigator};
use fsw_core::planet::MARS;
use fsw_core::sensors::{Batch, ImuIncrement, PressureMeasurement, RadioMeasurement};
use fsw_core::time::MissionTime;
use fsw_core::units::rad;

use crate::truth::{Air, DT_S, Flight, Noise, elevation};

/// Bank magnitude: with the turns of the profile the undispersed flight ends near P4's target.
const BANK_DEG: f64 = 53.0;

/// What to fly.
#[derive(Clone, Copy)]
pub struct Case {
    pub seed: u64,
    pub mode: NavigationMode,
    pub sources: [RadioSource; MAX_SOURCES],
    /// False: no dispersions, no sensor errors, exact start.
    pub dispersed: bool,
    pub parameters: NavigationParameters,
    pub estimators: EstimatorParameters,
    /// Frames without an inertial measurement.
    pub gap: (u32, u32),
    /// Share of the readings of pressure and radio that are nonsense, finite but far off.
    pub nonsense: f64,
}

/// What came of it.
pub struct Outcome {
    pub position_error_m: f64,
    pub velocity_error_mps: f64,
    pub attitude_error_rad: f64,
    pub bank_error_rad: f64,
    pub worst_bank_rate_error: f64,
    pub nees: Vec<f64>,
    pub innovations: Vec<Innovation>,
    pub counters: NavCounters,
    /// Why a model-based filter was given up, if it was, and when.
    pub given_up: Option<(f64, GivenUp)>,
    pub estimate: Estimate,
    pub peak_load_mps2: f64,
    pub invalid_frames: u32,
    /// Frames whose estimate held a number that is none.
    pub not_finite: u32,
}

impl Outcome {
    /// Sum of squared normalised innovations of a kind, and their number; gated ones count.
    pub fn nis(&self, kind: MeasurementKind) -> (f64, f64) {
        let used = |i: &&Innovation| i.kind == kind && matches!(i.verdict, Verdict::Used | Verdict::Gated);
        self.innovations.iter().filter(used).fold((0.0, 0.0), |(sum, n), i| {
            let ratio = f64::from(i.value) / f64::from(i.sigma);
            (sum + ratio * ratio, n + 1.0)
        })
    }
}

pub fn default_case(seed: u64) -> Case {
    let mut sources = [RadioSource::None; MAX_SOURCES];
    sources[0] = crate::truth::orbiter();
    Case {
        seed,
        mode: NavigationMode::Ekf,
        sources,
        dispersed: true,
        parameters: Config::DEFAULT.navigation,
        estimators: Config::DEFAULT.estimators,
        gap: (0, 0),
        nonsense: 0.0,
    }
}

pub fn model() -> OnboardModel {
    let c = Config::DEFAULT;
    OnboardModel::new(c.planet, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
}

/// Errors of the inertial unit in one flight.
struct Unit {
    accelerometer_bias: [f64; 3],
    accelerometer_scale: [f64; 3],
    misalignment: Vec3<fsw_core::frames::Body>,
    gyro_bias: [f64; 3],
    gyro_scale: [f64; 3],
}

pub fn fly(case: &Case) -> Outcome {
    let mut noise = Noise::new(case.seed);
    let on = if case.dispersed { 1.0 } else { 0.0 };
    let p = &case.parameters;
    let mut drawn = Noise::new(case.seed ^ 0xABCD_0000);
    let mut n = |sigma: f64| on * sigma * drawn.normal();
    let entry = PlanetRelative {
        radius_m: MARS.radius_m + 125.3e3 + n(2e3 / 3.0),
        longitude_rad: rad(-90.072) + n(2e3 / 2.4e6),
        latitude_rad: rad(-43.898) + n(1e3 / 3.4e6),
        speed_mps: 5505.0 + n(10.0 / 3.0),
        flight_path_angle_rad: rad(-14.15) + n(rad(0.05)),
        heading_rad: rad(85.01) + n(rad(0.1 / 3.0)),
    };
    let air = Air {
        bias: n(0.2 / 3.0),
        slope: n(0.1 / 3.0),
        wave: n(0.02),
        wave_length_m: noise.between(10e3, 30e3),
        wave_phase: noise.between(0.0, core::f64::consts::TAU),
    };
    let drag_factor = 1.0 + on * 0.05 / 3.0 * noise.normal();
    let unit = Unit {
        accelerometer_bias: noise.vector(on * p.accelerometer_bias_sigma_mps2),
        accelerometer_scale: noise.vector(on * p.accelerometer_scale_sigma),
        misalignment: Vec3::from_array(noise.vector(on * p.accelerometer_misalignment_sigma_rad)),
        gyro_bias: noise.vector(on * p.gyro_bias_sigma_radps),
        gyro_scale: noise.vector(on * p.gyro_scale_sigma),
    };
    let (pressure_scale, pressure_offset) = (on * 0.02 * noise.normal(), on * 15.0 * noise.normal());

    let mut truth = Flight::new(&entry, air, drag_factor, rad(BANK_DEG));
    let knowledge = InitialKnowledge {
        position_m: (truth.r_i() + Vec3::from_array(noise.vector(on * 500.0))).to_array(),
        velocity_mps: (truth.v_i() + Vec3::from_array(noise.vector(on * 0.3))).to_array(),
        attitude: truth
            .attitude_bi
            .then(&Rot::<Inertial, Inertial>::from_rotation_vector(
                Vec3::<Inertial>::from_array(noise.vector(on * rad(0.03))).components(),
            ))
            .quaternion(),
        position_sigma_m: 500.0,
        velocity_sigma_mps: 0.3,
        attitude_sigma_rad: rad(0.03),
    };
    let model = model();
    let context = NavContext {
        model: &model,
        parameters: p,
        estimators: &case.estimators,
        sources: &case.sources,
        mode: case.mode,
        bank_accel_radps2: 0.0,
    };
    let mut navigator = Navigator::new();
    navigator.start(&knowledge, &context);
    let mut source_states = case.sources.map(|s| SourceState::new(&s, &MARS));

    let mut out = Outcome {
        position_error_m: 0.0,
        velocity_error_mps: 0.0,
        attitude_error_rad: 0.0,
        bank_error_rad: 0.0,
        worst_bank_rate_error: 0.0,
        nees: vec![],
        innovations: vec![],
        counters: NavCounters::default(),
        given_up: None,
        estimate: Estimate::default(),
        peak_load_mps2: 0.0,
        invalid_frames: 0,
        not_finite: 0,
    };
    let root_dt = DT_S.sqrt();
    let mut fuzz = Noise::new(case.seed ^ 0x5EED_0000);
    for frame in 1..=20_000u32 {
        let now = MissionTime::of_frame(frame);
        let (dv, dtheta) = truth.advance();
        out.peak_load_mps2 = out.peak_load_mps2.max(dv.norm() / DT_S);
        let turned = (dv - unit.misalignment.cross(&dv)).to_array();
        let dtheta = dtheta.to_array();
        let delta_v: [f64; 3] = core::array::from_fn(|k| {
            turned[k] * (1.0 + unit.accelerometer_scale[k])
                + unit.accelerometer_bias[k] * DT_S
                + on * p.accelerometer_noise * root_dt * noise.normal()
        });
        let delta_theta: [f64; 3] = core::array::from_fn(|k| {
            dtheta[k] * (1.0 + unit.gyro_scale[k])
                + unit.gyro_bias[k] * DT_S
                + on * p.gyro_noise * root_dt * noise.normal()
        });
        let mut batch = Batch::default();
        if !(case.gap.0..case.gap.1).contains(&frame) {
            batch.imu = Some(ImuIncrement {
                time: now,
                delta_v_b: Vec3::from_array(delta_v),
                delta_theta_b: Vec3::from_array(delta_theta),
                accelerometer_saturated: false,
                gyro_saturated: false,
            });
        }
        if frame % 5 == 0 {
            let white = 1.0 + on * 0.005 * noise.normal();
            if truth.dynamic_pressure_pa() > 850.0 {
                let stagnation_pa = truth.stagnation_pa() * (1.0 + pressure_scale) * white + pressure_offset;
                batch.pressure =
                    Some(PressureMeasurement { time: now, stagnation_pa: f64::from(stagnation_pa as f32) });
            }
        }
        if frame % 50 == 0 {
            for (slot, state) in source_states.iter_mut().enumerate() {
                let (range_noise, rate_noise) = (on * 100.0 * noise.normal(), on * 0.1 * noise.normal());
                let Ok((r_s, v_s)) = state.at(&MARS, now) else { continue };
                let blackout = truth.speed_mps() > 4200.0 && truth.altitude_m() < 70e3;
                if blackout || elevation(&truth.r_i(), &r_s) < rad(5.0) {
                    continue;
                }
                let (d, w) = (truth.r_i() - r_s, truth.v_i() - v_s);
                batch.radio[slot] = Some(RadioMeasurement {
                    time: now,
                    source: slot as u8,
                    range_m: d.norm() + range_noise,
                    range_rate_mps: d.dot(&w) / d.norm() + rate_noise,
                });
            }
        }
        spoil(&mut batch, case.nonsense, &mut fuzz);
        let bank_before = out.estimate.bank_rad;
        let e = navigator.step(now, &batch, &context);
        if frame > 1 && dv.norm() > 0.0 && !case.dispersed {
            let rate = (e.bank_rad - bank_before) / DT_S;
            out.worst_bank_rate_error = out.worst_bank_rate_error.max((rate - e.bank_rate_radps).abs());
        }
        if out.given_up.is_none() {
            out.given_up = navigator.given_up().map(|why| (now.as_s(), why));
        }
        out.invalid_frames += u32::from(!e.valid);
        out.not_finite += u32::from(!(e.r_i.is_finite() && e.v_i.is_finite() && e.log_density.is_finite()));
        out.estimate = e;
        if frame % 5 == 0 {
            let tlm = navigator.telemetry();
            out.innovations.extend(tlm.innovations.iter().flatten());
            if frame % 50 == 0 {
                out.nees.push(nees(&tlm, &(truth.r_i() - e.r_i), &(truth.v_i() - e.v_i)));
            }
        }
        if truth.speed_mps() < 450.0 || truth.altitude_m() < 0.0 {
            break;
        }
    }
    let e = &out.estimate;
    out.position_error_m = (truth.r_i() - e.r_i).norm();
    out.velocity_error_mps = (truth.v_i() - e.v_i).norm();
    let turn = e.attitude_bi.then(&truth.attitude_bi.inverse()).rotation_vector();
    out.attitude_error_rad = Vec3::<Inertial>::from_components(turn).norm();
    out.bank_error_rad = e.bank_rad - rad(BANK_DEG);
    out.counters = navigator.counters();
    out
}

/// Replaces a share of the readings by finite ones that are anything but true.
fn spoil(batch: &mut Batch, share: f64, fuzz: &mut Noise) {
    let mut is_spoilt = || share > 0.0 && fuzz.between(0.0, 1.0) < share;
    let (pressure, radio) = (is_spoilt(), is_spoilt());
    if let (true, Some(p)) = (pressure, &mut batch.pressure) {
        p.stagnation_pa *= fuzz.between(-5.0, 3.0).exp();
    }
    for m in batch.radio.iter_mut().flatten().filter(|_| radio) {
        m.range_m += fuzz.between(-1e6, 1e6);
        m.range_rate_mps += fuzz.between(-1e4, 1e4);
    }
}

/// eᵀ P⁻¹ e of position and velocity, by Cholesky.
fn nees(tlm: &NavTlm, r: &Vec3<Inertial>, v: &Vec3<Inertial>) -> f64 {
    let e = [r.x(), r.y(), r.z(), v.x(), v.y(), v.z()];
    let mut l = [[0.0f64; 6]; 6];
    let mut k = 0;
    for row in l.iter_mut().enumerate() {
        for j in 0..=row.0 {
            row.1[j] = f64::from(tlm.covariance[k]);
            k += 1;
        }
    }
    let mut y = [0.0; 6];
    let mut sum = 0.0;
    for i in 0..6 {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|m| l[i][m] * l[j][m]).sum();
            l[i][j] = if i == j { (l[i][i] - dot).sqrt() } else { (l[i][j] - dot) / l[j][j] };
        }
        let dot: f64 = (0..i).map(|m| l[i][m] * y[m]).sum();
        y[i] = (e[i] - dot) / l[i][i];
        sum += y[i] * y[i];
    }
    sum
}
