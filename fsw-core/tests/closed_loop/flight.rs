//! One closed-loop flight of guidance, bank control and trigger through the simple world.

use fsw_core::config::Config;
use fsw_core::control;
use fsw_core::guidance::{Guidance, GuidanceContext, GuidanceInput, Verdict, trigger};
use fsw_core::link::packet::{CycleOutcome, DeployCause, Mode};
use fsw_core::model::OnboardModel;
use fsw_core::model::entry::Environment;
use fsw_core::model::loads::heat_flux_wpm2;
use fsw_core::time::MissionTime;

use super::world::{Air, Dispersion, Vehicle, entry};

/// How a flight went.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub miss_m: f64,
    pub downrange_m: f64,
    pub altitude_m: f64,
    pub cause: Option<DeployCause>,
    pub reversals: u8,
    pub peak_load_mps2: f64,
    pub peak_heat_flux_wpm2: f64,
    pub peak_dynamic_pressure_pa: f64,
    /// The first verdict that the target is out of reach.
    pub unreachable_m: Option<f64>,
    pub max_evaluations: u16,
    pub max_predictions: u8,
    pub mean_evaluations: f64,
    pub mean_predictions: f64,
    pub outcomes: Vec<CycleOutcome>,
}

/// Longest flight, frames.
const MAX_FRAMES: u32 = 50 * 800;

pub fn onboard_model(config: &Config) -> OnboardModel {
    OnboardModel::new(config.planet, &config.vehicle, &[], &config.atmosphere, &[]).unwrap()
}

pub fn mode_after(mode: Mode, load: f64, speed: f64, config: &Config) -> Mode {
    match mode {
        Mode::Coast if load >= config.guidance.range_control_load_mps2 => Mode::RangeControl,
        Mode::RangeControl if speed <= config.guidance.alignment_speed_mps => Mode::HeadingAlignment,
        _ => mode,
    }
}

/// Flies once; with `navigated_density` navigation knows the density at its altitude, otherwise the onboard air is used.
pub fn fly(
    config: &Config,
    with: &Dispersion,
    navigated_density: bool,
    mut each_frame: impl FnMut(&Vehicle, Mode, f64),
) -> Outcome {
    let model = onboard_model(config);
    let air = Air { model: &model, with: *with };
    let context = GuidanceContext {
        model: &model,
        target: &config.target,
        deploy: &config.deploy,
        guidance: &config.guidance,
        constraints: &config.constraints,
        control: &config.control,
        trigger: config.modes.trigger,
        mode: config.modes.guidance,
        force_noise_mps2: 0.0,
    };
    let mut vehicle = Vehicle::new(&entry(&model.planet, with), config.control.initial_bank_rad, config.control.lag_s);
    let (mut guidance, mut mode) = (Guidance::new(), Mode::Coast);
    let mut out = Outcome {
        miss_m: f64::NAN,
        downrange_m: f64::NAN,
        altitude_m: 0.0,
        cause: None,
        reversals: 0,
        peak_load_mps2: 0.0,
        peak_heat_flux_wpm2: 0.0,
        peak_dynamic_pressure_pa: 0.0,
        unreachable_m: None,
        max_evaluations: 0,
        max_predictions: 0,
        mean_evaluations: 0.0,
        mean_predictions: 0.0,
        outcomes: Vec::new(),
    };
    let from = vehicle.estimate(&model.planet).r_p;
    let mut cycles = 0.0;
    for frame in 0..MAX_FRAMES {
        let mut estimate = vehicle.estimate(&model.planet);
        estimate.specific_force_b = vehicle.force_b(&air);
        if navigated_density {
            estimate.log_density = air.log_ratio(estimate.altitude_m);
        }
        out.peak_load_mps2 = out.peak_load_mps2.max(vehicle.load(&air));
        let (density, speed) = (air.density_kgpm3(estimate.altitude_m), estimate.speed_mps);
        let heat = heat_flux_wpm2(density, speed, config.vehicle.nose_radius_m);
        out.peak_heat_flux_wpm2 = out.peak_heat_flux_wpm2.max(heat);
        out.peak_dynamic_pressure_pa = out.peak_dynamic_pressure_pa.max(0.5 * density * speed * speed);
        mode = mode_after(mode, vehicle.load(&air), estimate.speed_mps, config);
        out.cause = trigger::evaluate(&estimate, &context);
        if out.cause.is_some() {
            break;
        }
        let now = MissionTime::of_frame(frame);
        let input = GuidanceInput { now, frame, estimate: &estimate, mode, shed: false, crowded: false, context };
        let command = guidance.advance(&input);
        if let Some(Verdict::Unreachable(miss_m)) = command.verdict {
            out.unreachable_m.get_or_insert(miss_m);
        }
        if let Some(t) = &command.telemetry {
            out.outcomes.push(t.outcome);
            if t.predictions > 0 {
                cycles += 1.0;
                out.max_evaluations = out.max_evaluations.max(t.evaluations);
                out.max_predictions = out.max_predictions.max(t.predictions);
                out.mean_evaluations += f64::from(t.evaluations);
                out.mean_predictions += f64::from(t.predictions);
            }
        }
        each_frame(&vehicle, mode, command.bank_rad);
        let demand = control::step(estimate.bank_rad, estimate.bank_rate_radps, command.bank_rad, &config.control);
        vehicle.advance(&air, &demand);
    }
    out.mean_evaluations /= cycles;
    out.mean_predictions /= cycles;
    out.reversals = guidance.reversals();
    out.miss_m = vehicle.miss_m(&model.planet, config.target.longitude_rad, config.target.latitude_rad);
    let here = vehicle.estimate(&model.planet).r_p;
    out.downrange_m = fsw_core::frames::along_and_across_rad(&from, &context.target_p(), &here)
        .map_or(f64::NAN, |(along, _)| along * model.planet.radius_m);
    out.altitude_m = vehicle.altitude(&model.planet);
    out
}
