//! The link against a hostile line: a million damaged, cut, doubled, reordered and invented frames, and round trips.

use fsw_core::link::framing::{Decoder, MAX_FRAME, decode, encode_frame};
use fsw_core::link::handshake::HelloError;
use fsw_core::link::packet::*;
use fsw_core::link::parameters::{BlockId, ParameterBlock};
use fsw_core::link::receiver::{Receiver, Sender};
use fsw_core::time::MissionTime;
use proptest::prelude::*;

/// Damaged, doubled or reordered frames of the sweep; a good one follows each.
const MUTATED_FRAMES: u32 = 1_000_000;

/// SplitMix64: a seeded generator that needs no crate.
struct Seeded(u64);

impl Seeded {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform below `bound`; the bias of the remainder does not matter here.
    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }
}

/// A packet whose content tells what was sent.
fn packet(random: &mut Seeded) -> Uplink {
    let mut counts = || core::array::from_fn(|_| (random.next() as i32) >> (random.next() % 24));
    match counts()[0].unsigned_abs() % 4 {
        0 => Uplink::Pressure(Pressure { stagnation_pa: counts()[0] as f32, status: 0 }),
        1 => Uplink::Radio(Radio { source: 1, range_m: f64::from(counts()[1]), range_rate_mps: 0.0, quality: 9 }),
        2 => Uplink::Command(Command::Arm { digest: counts()[2].unsigned_abs() }),
        _ => Uplink::Imu(Imu { delta_v_counts: counts(), delta_theta_counts: counts(), status: 0 }),
    }
}

/// Damages the bytes of a frame before its delimiter. What comes out is never empty and may be several frames, or
/// none when the delimiter is lost.
fn damage(bytes: &mut Vec<u8>, random: &mut Seeded) {
    let content = bytes.len() - 1;
    match random.below(6) {
        // One to eight bit flips anywhere, the delimiter included.
        0 | 1 => (0..=random.below(8)).for_each(|_| {
            let at = random.below(bytes.len());
            bytes[at] ^= 1 << random.below(8);
        }),
        // Cut off: the delimiter follows early.
        2 => drop(bytes.drain(1 + random.below(content)..content)),
        // Bytes lost in the middle.
        3 => drop(bytes.drain(random.below(content)..=content - 1)),
        // Bytes doubled.
        4 => {
            let at = random.below(content);
            bytes.insert(at, bytes[at]);
        }
        // Garbage of any length, beyond a frame as well.
        _ => {
            let length = 1 + random.below(MAX_FRAME + 100);
            *bytes = (0..length).map(|_| random.next() as u8).collect();
            bytes.push(0);
        }
    }
}

fn rejected(counters: &RejectCounters) -> u64 {
    [counters.overflow, counters.cobs, counters.crc, counters.decode, counters.duplicate, counters.reordered]
        .into_iter()
        .map(u64::from)
        .sum()
}

/// What went over the line, and what the receiver made of it.
#[derive(Default)]
struct Line {
    receiver: Receiver<Uplink>,
    counters: RejectCounters,
    /// Bytes since the last delimiter.
    open: usize,
    /// Non-empty stretches between delimiters.
    stretches: u64,
    received: Vec<Frame<Uplink>>,
}

impl Line {
    fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if *byte != 0 {
                self.open += 1;
            } else if self.open > 0 {
                self.stretches += 1;
                self.open = 0;
            }
            self.received.extend(self.receiver.push(*byte, &mut self.counters));
        }
    }
}

#[test]
fn a_million_damaged_frames_never_panic_never_pass_and_are_all_counted() {
    // `cargo xtask fuzz` asks for more frames and other seeds.
    let asked = |name: &str, default: u64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    let frames = asked("AEROSHELL_FUZZ_FRAMES", u64::from(MUTATED_FRAMES));
    let mut random = Seeded(asked("AEROSHELL_FUZZ_SEED", 2026));
    let (mut line, mut sender, mut out) = (Line::default(), Sender::new(), [0u8; MAX_FRAME]);
    let mut older: Vec<u8> = Vec::new();
    for _ in 0..frames {
        line.received.clear();
        if random.below(4) == 0 {
            // A frame that was used before: doubled or out of order.
            line.send(&older);
            assert!(line.received.is_empty(), "{:?}", line.received);
        } else {
            let sequence = sender.next_sequence();
            let packet = packet(&mut random);
            let sent = Frame { sequence, time: MissionTime(7), packet };
            let mut bad = sender.encode(sent.time, &sent.packet, &mut out).unwrap().to_vec();
            damage(&mut bad, &mut random);
            line.send(&bad);
            // What comes out may be the frame itself (two flips of one bit), never another one.
            assert!(line.received.iter().all(|got| *got == sent), "{:?}", line.received);
        }
        // Damage may have taken the delimiter; a sender can flush with another one.
        line.send(&[0]);
        line.received.clear();
        let sent = Frame { sequence: sender.next_sequence(), time: MissionTime(7), packet: packet(&mut random) };
        let good = sender.encode(sent.time, &sent.packet, &mut out).unwrap();
        line.send(good);
        assert_eq!(line.received, [sent], "the next good frame is accepted");
        if random.below(3) == 0 {
            older = good.to_vec();
        }
    }
    let c = line.counters;
    assert_eq!(u64::from(c.accepted) + rejected(&c), line.stretches, "all accepted or counted: {c:?}");
    // Each cause occurs, so the sweep reached every branch. A wrong frame with a right checksum has its own test.
    for (cause, count) in [
        ("overflow", c.overflow),
        ("cobs", c.cobs),
        ("crc", c.crc),
        ("duplicate", c.duplicate),
        ("reordered", c.reordered),
        ("lost", c.lost),
    ] {
        assert!(count > 1_000, "{cause}: {count}");
    }
}

#[test]
fn every_single_and_double_bit_flip_of_a_frame_is_noticed() {
    let frame = Frame {
        sequence: 300,
        time: MissionTime(2_000_000),
        packet: Uplink::Imu(Imu { delta_v_counts: [-29_800, 0, 1_300], delta_theta_counts: [0, 5, 70_000], status: 0 }),
    };
    let mut out = [0; MAX_FRAME];
    let good = encode_frame(&frame, &mut out).unwrap().to_vec();
    let bits = 8 * (good.len() - 1);
    for first in 0..bits {
        for second in first..bits {
            let mut bad = good.clone();
            bad[first / 8] ^= 1 << (first % 8);
            if second != first {
                bad[second / 8] ^= 1 << (second % 8);
            }
            let mut decoder = Decoder::new();
            let accepted = bad.iter().any(|byte| matches!(decoder.push(*byte), Some(Ok(_))));
            assert!(!accepted, "bits {first} and {second}");
        }
    }
}

#[test]
fn valid_checksums_around_nonsense_are_decode_rejects() {
    // A sender of another program with the same framing: the checksum is right, the packet is not ours.
    let mut random = Seeded(7);
    let (mut receiver, mut counters) = (Receiver::<Uplink>::new(), RejectCounters::default());
    let mut sent = 0u32;
    for length in 0..MAX_FRAME {
        let nonsense: Vec<u8> = (0..length % 300).map(|_| random.next() as u8 | 0x80).collect();
        let mut out = [0; MAX_FRAME];
        let Ok(bytes) = fsw_core::link::framing::encode(nonsense.as_slice(), &mut out) else { continue };
        let taken = bytes.iter().filter_map(|b| receiver.push(*b, &mut counters)).count();
        assert_eq!(taken, 0);
        sent += 1;
    }
    assert_eq!((counters.decode, counters.accepted), (sent, 0));
}

#[test]
fn a_peer_of_another_version_is_told_apart_over_the_wire() {
    let (mut receiver, mut counters) = (Receiver::<Uplink>::new(), RejectCounters::default());
    let stranger = Hello { protocol_version: 99, ..Hello::ours(1) };
    let mut out = [0; MAX_FRAME];
    let bytes = Sender::new().encode(MissionTime(0), &Uplink::Hello(stranger), &mut out).unwrap();
    let got = bytes.iter().find_map(|b| receiver.push(*b, &mut counters)).unwrap();
    let Uplink::Hello(hello) = got.packet else { panic!("a hello") };
    assert_eq!(hello.check(), Err(HelloError::Version { theirs: 99 }));
}

fn same_after_the_wire<P>(packet: P) -> Result<(), TestCaseError>
where
    P: fsw_core::link::receiver::Packet + Clone + PartialEq + core::fmt::Debug,
{
    let frame = Frame { sequence: 65_535, time: MissionTime(u32::MAX), packet };
    let mut out = [0; MAX_FRAME];
    let bytes = encode_frame(&frame, &mut out).unwrap();
    let mut decoder = Decoder::new();
    let payload = bytes.iter().find_map(|b| decoder.push(*b).map(|r| r.map(<[u8]>::to_vec))).unwrap().unwrap();
    prop_assert_eq!(decode::<Frame<P>>(&payload), Ok(frame));
    Ok(())
}

/// Any number but NaN, which equals nothing.
fn number() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("comparable", |x| !x.is_nan())
}

fn single() -> impl Strategy<Value = f32> {
    any::<f32>().prop_filter("comparable", |x| !x.is_nan())
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(number())
}

fn parameter_block() -> impl Strategy<Value = ParameterBlock> {
    let config = fsw_core::config::Config::DEFAULT;
    let names: Vec<BlockId> = config.blocks().chain([BlockId::AeroRows(0), BlockId::AtmosphereRows(0)]).collect();
    prop::sample::select(names).prop_map(move |id| config.read_back(id).unwrap())
}

fn uplink() -> impl Strategy<Value = Uplink> {
    let counts = || prop::array::uniform3(any::<i32>());
    let imu = (counts(), counts(), any::<u8>()).prop_map(|(delta_v_counts, delta_theta_counts, status)| {
        Uplink::Imu(Imu { delta_v_counts, delta_theta_counts, status })
    });
    let pressure = (single(), any::<u8>())
        .prop_map(|(stagnation_pa, status)| Uplink::Pressure(Pressure { stagnation_pa, status }));
    let radio =
        (any::<u8>(), number(), number(), any::<u8>()).prop_map(|(source, range_m, range_rate_mps, quality)| {
            Uplink::Radio(Radio { source, range_m, range_rate_mps, quality })
        });
    let truth = (vector(), vector(), prop::array::uniform4(number()), vector()).prop_map(
        |(position_m, velocity_mps, attitude, [bank_rad, mach, dynamic_pressure_pa])| {
            Uplink::Truth(Truth {
                position_m,
                velocity_mps,
                attitude,
                bank_rad,
                mach,
                dynamic_pressure_pa,
                ..Truth::default()
            })
        },
    );
    let hello = (any::<u16>(), any::<u64>(), any::<u64>()).prop_map(|(protocol_version, schema_hash, build_id)| {
        Uplink::Hello(Hello { protocol_version, schema_hash, build_id })
    });
    let command = prop_oneof![
        parameter_block().prop_map(Command::Load),
        any::<u8>().prop_map(|row| Command::ReadBack(BlockId::AeroRows(row))),
        any::<u32>().prop_map(|digest| Command::Arm { digest }),
        Just(Command::Go { pace: Pace::RealTime }),
        any::<bool>().prop_map(|on| Command::ReportCost { on }),
        any::<u16>().prop_map(|frames| Command::Inject(Injection::Overrun { frames })),
    ];
    prop_oneof![imu, pressure, radio, truth, hello, command.prop_map(Uplink::Command)]
}

fn downlink() -> impl Strategy<Value = Downlink> {
    let actuator = (any::<u32>(), number(), number(), any::<u8>()).prop_map(
        |(frame, bank_accel_radps2, bank_rate_radps, discretes)| {
            Downlink::Actuator(Actuator { frame, bank_accel_radps2, bank_rate_radps, discretes, mode: Mode::Coast })
        },
    );
    let innovation =
        (any::<u32>(), single(), single(), any::<u8>()).prop_map(|(time, value, sigma, source)| Innovation {
            time: MissionTime(time),
            kind: MeasurementKind::RangeRate,
            source,
            value,
            sigma,
            verdict: Verdict::Gated,
        });
    let navigation =
        (vector(), vector(), prop::array::uniform3(single()), prop::array::uniform9(prop::option::of(innovation)))
            .prop_map(|(position_m, velocity_mps, gyro_bias_radps, innovations)| {
                Downlink::NavTlm(NavTlm { position_m, velocity_mps, gyro_bias_radps, innovations, ..NavTlm::default() })
            });
    let guidance =
        (any::<u32>(), number(), any::<u16>(), any::<u8>()).prop_map(|(cycle, bank_rad, evaluations, reversals)| {
            Downlink::GuidanceTlm(GuidanceTlm { cycle, bank_rad, evaluations, reversals, ..GuidanceTlm::default() })
        });
    let health = (prop::array::uniform8(any::<u32>()), any::<u32>()).prop_map(|(worst_cost, accepted)| {
        let rejects = RejectCounters { accepted, ..RejectCounters::default() };
        Downlink::HealthTlm(HealthTlm { worst_cost, rejects, ..HealthTlm::default() })
    });
    let event = (any::<u32>(), single(), single()).prop_map(|(time, altitude_m, speed_mps)| {
        let kind = EventKind::ParachuteFired { cause: DeployCause::Floor, altitude_m, speed_mps };
        Downlink::Event(Event { time: MissionTime(time), severity: Severity::Activity, kind })
    });
    let outcome = prop_oneof![
        Just(CommandOutcome::Accepted),
        parameter_block().prop_map(CommandOutcome::Block),
        any::<u32>().prop_map(|held| CommandOutcome::Refused(Refusal::DigestMismatch { held })),
        any::<u8>().prop_map(|field| {
            CommandOutcome::Refused(Refusal::OutOfRange { block: BlockId::Source(field), field })
        }),
    ];
    let reply = (any::<u16>(), outcome)
        .prop_map(|(to_sequence, outcome)| Downlink::CommandReply(CommandReply { to_sequence, outcome }));
    let hello = any::<u64>().prop_map(|build_id| Downlink::Hello(Hello::ours(build_id)));
    prop_oneof![actuator, navigation, guidance, health, event, reply, hello]
}

proptest! {
    #[test]
    fn every_uplink_packet_survives_the_wire(packet in uplink()) {
        same_after_the_wire(packet)?;
    }

    #[test]
    fn every_downlink_packet_survives_the_wire(packet in downlink()) {
        same_after_the_wire(packet)?;
    }
}
