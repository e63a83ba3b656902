//! Well-formed nonsense: packets with sound checksums whose contents, time stamps, order and number make no sense, to
//! computers whose parameters are as extreme as the range checks admit. Whatever comes, each closed frame gives one
//! finite actuator command within the limits, every command is answered, and a healthy stream is followed afterwards.

use fsw_core::config::limits;
use fsw_core::config::limits::Limit;
use fsw_core::executive::{FlightComputer, MAX_BRIDGED_FRAMES};
use fsw_core::guidance::cycle::MAX_EVALUATIONS;
use fsw_core::link::framing::MAX_FRAME;
use fsw_core::link::packet::*;
use fsw_core::link::parameters::*;
use fsw_core::link::receiver::{Receiver, Sender};
use fsw_core::planet::Planet;
use fsw_core::time::MissionTime;

/// Flight computers that are maltreated.
const COMPUTERS: u64 = NavigationMode::ALL.len() as u64 + 2;
/// Absurd packets to each.
const PACKETS: u32 = 1500;
/// Frames of the healthy stream that follows.
const HEALTHY_FRAMES: u32 = 100;

/// SplitMix64: a seeded generator that needs no crate.
struct Seeded(u64);

impl Seeded {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: u32) -> u32 {
        (self.next() % u64::from(bound)) as u32
    }

    fn unit(&mut self) -> f64 {
        self.next() as f64 / u64::MAX as f64
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len() as u32) as usize]
    }

    /// An end of the range, or anything in it.
    fn within(&mut self, limit: &Limit) -> f64 {
        match self.below(3) {
            0 => limit.min,
            1 => limit.max,
            _ => limit.min + self.unit() * (limit.max - limit.min),
        }
    }

    fn fields<const N: usize>(&mut self, limits: &[Limit; N]) -> [f64; N] {
        limits.map(|limit| self.within(&limit))
    }

    /// A number that no sensor should give, or one that it may.
    fn number(&mut self) -> f64 {
        let usual = (self.unit() - 0.5) * 1e7;
        self.one_of(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, 1e300, -1e300, 5e-324, 1e9, 4e5, usual])
    }

    fn count(&mut self) -> i32 {
        let noise = self.below(2000) as i32 - 1000;
        let large = sensor_limits::MAX_DELTA_V_COUNTS as i32;
        self.one_of(&[i32::MIN, i32::MAX, 0, -1, large, -large, noise, noise, noise, noise])
    }

    fn counts(&mut self) -> [i32; 3] {
        // Mostly what the range check lets through.
        if self.below(4) == 0 {
            core::array::from_fn(|_| self.count())
        } else {
            core::array::from_fn(|_| self.below(6_000_000) as i32 - 3_000_000)
        }
    }
}

use fsw_core::sensors::limits as sensor_limits;

/// A block with every number within its range and little sense.
fn block(random: &mut Seeded) -> ParameterBlock {
    match random.below(12) {
        0 => {
            let [radius_m, mu_m3ps2, rotation_radps, j2] = random.fields(&limits::PLANET);
            // Often one whose surface gravity passes.
            let mu_m3ps2 = if random.below(2) == 0 { mu_m3ps2 } else { 4.0 * radius_m * radius_m };
            ParameterBlock::Planet(Planet { radius_m, mu_m3ps2, rotation_radps, j2 })
        }
        1 => {
            let [mass_kg, reference_area_m2, nose_radius_m, drag_coefficient, lift_to_drag, trim_angle_of_attack_rad] =
                random.fields(&limits::VEHICLE);
            ParameterBlock::Vehicle(VehicleParameters {
                mass_kg,
                reference_area_m2,
                nose_radius_m,
                drag_coefficient,
                lift_to_drag,
                trim_angle_of_attack_rad,
            })
        }
        2 => {
            let [
                reference_density_kgpm3,
                reference_altitude_m,
                scale_height_m,
                temperature_k,
                gas_constant_jpkgk,
                heat_ratio,
            ] = random.fields(&limits::ATMOSPHERE);
            ParameterBlock::Atmosphere(AtmosphereParameters {
                reference_density_kgpm3,
                reference_altitude_m,
                scale_height_m,
                temperature_k,
                gas_constant_jpkgk,
                heat_ratio,
            })
        }
        3 => {
            let [longitude_rad, latitude_rad] = random.fields(&limits::TARGET);
            ParameterBlock::Target(Target { longitude_rad, latitude_rad })
        }
        4 => {
            let slot = random.below(5) as u8;
            let source = match random.below(3) {
                0 => RadioSource::None,
                1 => {
                    let [longitude_rad, latitude_rad, altitude_m] = random.fields(&limits::BEACON);
                    RadioSource::Beacon { longitude_rad, latitude_rad, altitude_m }
                }
                _ => {
                    let [position, velocity] = limits::ORBITER;
                    RadioSource::Orbiter {
                        position_m: core::array::from_fn(|_| random.within(&position)),
                        velocity_mps: core::array::from_fn(|_| random.within(&velocity)),
                    }
                }
            };
            ParameterBlock::Source { slot, source }
        }
        5 => {
            let [position, velocity, _, position_sigma, velocity_sigma, attitude_sigma] = limits::INITIAL_KNOWLEDGE;
            let [a, b] = [random.unit(), random.unit() * core::f64::consts::TAU];
            ParameterBlock::InitialKnowledge(InitialKnowledge {
                position_m: core::array::from_fn(|_| random.within(&position)),
                velocity_mps: core::array::from_fn(|_| random.within(&velocity)),
                attitude: [a.sqrt() * b.cos(), a.sqrt() * b.sin(), (1.0 - a).sqrt(), 0.0],
                position_sigma_m: random.within(&position_sigma),
                velocity_sigma_mps: random.within(&velocity_sigma),
                attitude_sigma_rad: random.within(&attitude_sigma),
            })
        }
        6 => {
            let n = random.fields(&limits::NAVIGATION);
            ParameterBlock::Navigation(NavigationParameters {
                accelerometer_bias_sigma_mps2: n[0],
                accelerometer_scale_sigma: n[1],
                accelerometer_misalignment_sigma_rad: n[2],
                accelerometer_noise: n[3],
                gyro_bias_sigma_radps: n[4],
                gyro_scale_sigma: n[5],
                gyro_noise: n[6],
                log_density_sigma: n[7],
                log_density_length_m: n[8],
                pressure_scale_sigma: n[9],
                pressure_offset_sigma_pa: n[10],
                pressure_noise: n[11],
                pressure_min_dynamic_pa: n[12],
                range_noise_m: n[13],
                range_rate_noise_mps: n[14],
                min_elevation_rad: n[15],
                gate_sigma: n[16],
            })
        }
        7 => {
            let g = random.fields(&limits::GUIDANCE);
            ParameterBlock::Guidance(GuidanceParameters {
                predictor_step_s: g[0],
                prediction_horizon_s: g[1],
                tolerance_m: g[2],
                bank_increment_rad: g[3],
                max_iterations: g[4] as u8,
                min_bank_rad: g[5],
                max_bank_rad: g[6],
                threshold_constant_m: g[7],
                threshold_linear_s: g[8],
                threshold_quadratic_s2pm: g[9],
                range_control_load_mps2: g[10],
                alignment_speed_mps: g[11],
                alignment_gain_ps: g[12],
                alignment_max_bank_rad: g[13],
                alignment_freeze_range_m: g[14],
                late_alignment_speed_mps: g[15],
                range_alignment_speed_mps: g[16],
                reversal_share: g[17],
            })
        }
        8 => {
            let [load_mps2, heat_flux_wpm2, dynamic_pressure_pa] = random.fields(&limits::CONSTRAINTS);
            ParameterBlock::Constraints(ConstraintParameters { load_mps2, heat_flux_wpm2, dynamic_pressure_pa })
        }
        9 => {
            let [initial_bank_rad, max_rate_radps, max_accel_radps2, lag_s] = random.fields(&limits::CONTROL);
            ParameterBlock::Control(ControlParameters { initial_bank_rad, max_rate_radps, max_accel_radps2, lag_s })
        }
        10 => {
            let e = random.fields(&limits::ESTIMATORS);
            ParameterBlock::Estimators(EstimatorParameters {
                unmodelled_share: e[0],
                calibrated_share: e[1],
                spacing_share: e[2],
                modelled_share: e[3],
                error_correlation_s: e[4],
                lift_sigma: e[5],
                input_growth_mps2: e[6],
                calibration_start_s: e[7],
                calibration_s: e[8],
                calibration_share: e[9],
                calibration_fade_s: e[10],
                gating_rate: e[11],
                switching_stay: e[12],
                weight_floor: e[13],
                rank_threshold: e[14],
                free_threshold: e[15],
            })
        }
        _ => ParameterBlock::Modes(Modes {
            navigation: random.one_of(NavigationMode::ALL),
            trigger: random.one_of(&[TriggerKind::Speed, TriggerKind::Range]),
            ..Modes::default()
        }),
    }
}

fn truth(random: &mut Seeded) -> Truth {
    let mut vector = || core::array::from_fn(|_| random.number());
    let (position_m, velocity_mps) = (vector(), vector());
    let attitude = if random.below(2) == 0 { [1.0, 0.0, 0.0, 0.0] } else { core::array::from_fn(|_| random.number()) };
    Truth {
        position_m,
        velocity_mps,
        attitude,
        bank_rad: random.number(),
        bank_rate_radps: random.number(),
        density_kgpm3: random.number(),
        mach: random.number(),
        dynamic_pressure_pa: random.number(),
    }
}

fn command(random: &mut Seeded) -> Command {
    match random.below(5) {
        0 => Command::Load(block(random)),
        1 => Command::ReadBack(random.one_of(&[
            BlockId::Planet,
            BlockId::AeroRows(255),
            BlockId::AtmosphereRows(3),
            BlockId::Source(200),
            BlockId::Navigation,
            BlockId::Estimators,
        ])),
        2 => Command::Arm { digest: random.next() as u32 },
        3 => Command::Go { pace: Pace::LockStep },
        _ => Command::Inject(Injection::Overrun { frames: random.next() as u16 }),
    }
}

/// The ground's end, which checks everything that comes down.
struct Ground {
    computer: FlightComputer,
    sender: Sender,
    receiver: Receiver<Downlink>,
    counters: RejectCounters,
    sent: u32,
    frame: u32,
    max_accel_radps2: f64,
}

impl Ground {
    fn new() -> Self {
        Self {
            computer: FlightComputer::new(1),
            sender: Sender::new(),
            receiver: Receiver::new(),
            counters: RejectCounters::default(),
            sent: 0,
            frame: 0,
            max_accel_radps2: 0.0,
        }
    }

    /// Sends a packet; the number of frames that it closed.
    fn send(&mut self, time: MissionTime, packet: Uplink) -> u32 {
        let (is_command, is_hello) = (matches!(packet, Uplink::Command(_)), matches!(packet, Uplink::Hello(_)));
        let mut out = [0; MAX_FRAME];
        let bytes = self.sender.encode(time, &packet, &mut out).unwrap();
        let flooded = self.computer.executive().rejects.flooded;
        let Self { computer, receiver, counters, .. } = self;
        let mut heard = Vec::new();
        computer.receive(bytes, |frame| {
            heard.extend(frame.iter().filter_map(|b| receiver.push(*b, counters)).map(|f| f.packet));
        });
        self.sent += 1;
        let frame = self.frame;
        heard.iter().for_each(|packet| self.check(packet));
        let count = |f: fn(&Downlink) -> bool| heard.iter().filter(|p| f(p)).count();
        // Every command and greeting is answered or counted as one too many.
        let answered = count(|p| matches!(p, Downlink::CommandReply(_))) + count(|p| matches!(p, Downlink::Hello(_)));
        let dropped = self.computer.executive().rejects.flooded - flooded;
        assert_eq!(answered + dropped as usize, usize::from(is_command) + usize::from(is_hello));
        assert!(self.frame - frame <= MAX_BRIDGED_FRAMES + 1, "one packet ran {} frames", self.frame - frame);
        assert_eq!(self.frame, self.computer.executive().frame());
        assert_eq!(self.counters, RejectCounters { accepted: self.counters.accepted, ..RejectCounters::default() });
        self.frame - frame
    }

    fn check(&mut self, packet: &Downlink) {
        match packet {
            Downlink::Actuator(a) => {
                assert_eq!(a.frame, self.frame + 1, "frames are closed one by one, in order");
                self.frame = a.frame;
                let limit = self.max_accel_radps2 * (1.0 + 1e-12);
                assert!(a.bank_accel_radps2.abs() <= limit && a.bank_rate_radps.is_finite(), "{a:?}");
            }
            Downlink::NavTlm(n) => {
                let wide = [&n.position_m[..], &n.velocity_mps[..]].concat();
                assert!(wide.iter().all(|x| x.is_finite()), "{n:?}");
                let narrow = [&n.attitude[..], &n.covariance[..], &n.attitude_sigma_rad[..]].concat();
                assert!(narrow.iter().all(|x| x.is_finite()), "{n:?}");
                let narrow = [&n.accelerometer_bias_mps2[..], &n.gyro_bias_radps[..], &[n.log_density, n.bank_rad]];
                assert!(narrow.concat().iter().all(|x| x.is_finite()), "{n:?}");
            }
            Downlink::GuidanceTlm(g) => {
                assert!(g.bank_rad.abs() <= core::f64::consts::PI, "{g:?}");
                assert!(g.evaluations <= MAX_EVALUATIONS && g.predictions <= 4, "{g:?}");
            }
            _ => {}
        }
    }

    fn load(&mut self, block: ParameterBlock) {
        self.send(MissionTime::ZERO, Uplink::Command(Command::Load(block)));
    }

    /// Extreme parameters, as far as they are accepted; then armed and started.
    fn take_off(&mut self, navigation: NavigationMode, random: &mut Seeded) {
        self.send(MissionTime::ZERO, Uplink::Hello(Hello::ours(2)));
        for _ in 0..random.below(16) {
            self.load(block(random));
        }
        self.load(ParameterBlock::Modes(Modes { navigation, ..self.computer.executive().config.modes }));
        self.max_accel_radps2 = self.computer.executive().config.control.max_accel_radps2;
        self.arm();
        if !self.computer.executive().is_armed() {
            // Someone would be inside the planet.
            let default = fsw_core::config::Config::DEFAULT;
            self.load(ParameterBlock::Planet(default.planet));
            self.load(ParameterBlock::InitialKnowledge(default.initial_knowledge));
            for slot in 0..4 {
                self.load(ParameterBlock::Source { slot, source: RadioSource::None });
            }
            self.arm();
        }
        assert!(self.computer.executive().is_armed());
        self.send(MissionTime::ZERO, Uplink::Command(Command::Go { pace: Pace::LockStep }));
        assert_eq!(self.computer.executive().mode(), Mode::Coast);
    }

    fn arm(&mut self) {
        let digest = self.computer.executive().config.digest();
        self.send(MissionTime::ZERO, Uplink::Command(Command::Arm { digest }));
    }

    fn send_absurd(&mut self, random: &mut Seeded) {
        let next = self.frame + 1;
        let frame = match random.below(10) {
            0 => self.frame.saturating_sub(random.below(4)),
            1 => next + random.below(80),
            2 => next + random.below(300_000),
            _ => next,
        };
        let time = match random.below(12) {
            0 => MissionTime(random.next() as u32),
            1 => MissionTime(u32::MAX - random.below(3)),
            _ => MissionTime::of_frame(frame),
        };
        let packet = match random.below(16) {
            0 => Uplink::Command(command(random)),
            1 => {
                let ours = Hello::ours(random.next());
                Uplink::Hello(Hello { protocol_version: random.below(3) as u16, ..ours })
            }
            2 => Uplink::Truth(truth(random)),
            3..=4 => {
                let stagnation_pa = random.number() as f32;
                Uplink::Pressure(Pressure { stagnation_pa, status: random.below(2) as u8 })
            }
            5..=7 => Uplink::Radio(Radio {
                source: random.below(6) as u8,
                range_m: random.number(),
                range_rate_mps: random.number(),
                quality: random.below(3) as u8,
            }),
            _ => {
                let status = if random.below(3) == 0 { random.next() as u8 } else { 0 };
                Uplink::Imu(Imu { delta_v_counts: random.counts(), delta_theta_counts: random.counts(), status })
            }
        };
        self.send(time, packet);
    }
}

/// Every algorithm has its turn.
fn navigation(seed: u64) -> NavigationMode {
    let all = NavigationMode::ALL;
    all[seed as usize % all.len()]
}

/// What a working unit gives in free fall.
fn healthy(random: &mut Seeded) -> Imu {
    let mut counts = || core::array::from_fn(|_| random.below(200) as i32 - 100);
    Imu { delta_v_counts: counts(), delta_theta_counts: counts(), status: 0 }
}

#[test]
fn nonsense_never_stops_the_flight_computer_and_a_healthy_stream_is_followed_afterwards() {
    for seed in 0..COMPUTERS {
        let (mut random, mut ground) = (Seeded(seed), Ground::new());
        ground.take_off(navigation(seed), &mut random);
        for _ in 0..PACKETS {
            ground.send_absurd(&mut random);
        }
        let rejects = ground.computer.executive().rejects;
        assert_eq!(rejects.accepted, ground.sent, "every frame was sound");
        assert!(ground.frame > PACKETS / 4, "{} frames: the stream did not advance", ground.frame);
        let from = ground.frame;
        for _ in 0..HEALTHY_FRAMES {
            let time = MissionTime::of_frame(ground.frame + 1);
            assert_eq!(ground.send(time, Uplink::Imu(healthy(&mut random))), 1, "seed {seed}");
        }
        assert_eq!(ground.frame, from + HEALTHY_FRAMES);
    }
}

#[test]
fn a_computer_with_sound_parameters_navigates_again_or_says_that_it_cannot() {
    for seed in 0..COMPUTERS {
        let (mut random, mut ground) = (Seeded(1000 + seed), Ground::new());
        let default = fsw_core::config::Config::DEFAULT;
        let high = InitialKnowledge {
            position_m: [default.planet.radius_m + 125e3, 0.0, 0.0],
            velocity_mps: [-1300.0, 5500.0, 0.0],
            ..default.initial_knowledge
        };
        ground.send(MissionTime::ZERO, Uplink::Hello(Hello::ours(2)));
        ground.load(ParameterBlock::InitialKnowledge(high));
        ground.load(ParameterBlock::Modes(Modes { navigation: navigation(seed), ..default.modes }));
        ground.max_accel_radps2 = default.control.max_accel_radps2;
        ground.arm();
        ground.send(MissionTime::ZERO, Uplink::Command(Command::Go { pace: Pace::LockStep }));
        // Measurements of the gyros within range, else nonsense: the attitude survives for a while or does not.
        for _ in 0..200 {
            ground.send_absurd(&mut random);
        }
        for _ in 0..HEALTHY_FRAMES {
            let time = MissionTime::of_frame(ground.frame + 1);
            ground.send(time, Uplink::Imu(healthy(&mut random)));
        }
        let executive = ground.computer.executive();
        let estimate = executive.estimate();
        assert_eq!(estimate.time, MissionTime::of_frame(ground.frame));
        assert!(estimate.r_i.is_finite() && estimate.v_i.is_finite() && estimate.specific_force_b.is_finite());
        assert!(estimate.valid, "seed {seed}: {HEALTHY_FRAMES} healthy frames and still lost");
    }
}
