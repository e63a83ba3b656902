//! The comparison of what was recorded with what is answered, packet by packet.

use std::collections::VecDeque;

use fsw_core::link::packet::{Downlink, Frame, HealthTlm};
use serde_json::Value;

use super::{Difference, Verdict};
use crate::linklog::LinkLog;
use crate::tap::Heard;

/// One downlink packet, or bytes that are none.
pub struct Piece {
    bytes: Vec<u8>,
    frame: Option<Frame<Downlink>>,
}

impl Piece {
    pub fn new(bytes: &[u8], heard: Heard<Downlink>) -> Self {
        let frame = match heard {
            Heard::Packet(frame) => Some(comparable(frame)),
            Heard::Damaged(_) | Heard::Nothing => None,
        };
        Self { bytes: bytes.to_vec(), frame }
    }

    fn kind(&self) -> String {
        let kind = match self.frame.as_ref().map(|f| &f.packet) {
            None => "undecodable bytes",
            Some(Downlink::Hello(_)) => "Hello",
            Some(Downlink::Actuator(_)) => "Actuator",
            Some(Downlink::NavTlm(_)) => "NavTlm",
            Some(Downlink::GuidanceTlm(_)) => "GuidanceTlm",
            Some(Downlink::HealthTlm(_)) => "HealthTlm",
            Some(Downlink::Event(_)) => "Event",
            Some(Downlink::CommandReply(_)) => "CommandReply",
            Some(Downlink::CostTlm(_)) => "CostTlm",
        };
        kind.to_owned()
    }
}

/// The packet without what belongs to the machine.
fn comparable(mut frame: Frame<Downlink>) -> Frame<Downlink> {
    match &mut frame.packet {
        Downlink::Hello(hello) => hello.build_id = 0,
        Downlink::HealthTlm(health) => {
            let blank = HealthTlm::default();
            health.worst_cost = blank.worst_cost;
            health.worst_frame = blank.worst_frame;
            // Those that were ordered show in their events; the others were measured.
            health.slips = blank.slips;
            health.stack_high_water_bytes = blank.stack_high_water_bytes;
        }
        _ => {}
    }
    frame
}

/// A comparison that goes on as both sides speak.
#[derive(Default)]
pub struct Replay {
    pub expected: VecDeque<Piece>,
    pub answered: VecDeque<Piece>,
    packets: usize,
    frames: u32,
}

impl Replay {
    /// Compares as far as both sides have spoken.
    pub fn compare(&mut self) -> Option<Difference> {
        while let (Some(expected), Some(answered)) = (self.expected.front(), self.answered.front()) {
            if !same(expected, answered) {
                let (field, recorded, replayed) = first_difference(&tree(expected), &tree(answered), "");
                return Some(self.difference(expected.kind(), field, recorded, replayed));
            }
            if let Some(Downlink::Actuator(actuator)) = expected.frame.as_ref().map(|f| &f.packet) {
                self.frames = actuator.frame;
            }
            self.packets += 1;
            self.expected.pop_front();
            self.answered.pop_front();
        }
        None
    }

    /// The outcome. A log cut off in the middle lacks answers; a whole one must not.
    pub fn verdict(&self, log: &LinkLog, difference: Option<Difference>) -> Verdict {
        let difference = difference.or_else(|| if log.truncated { None } else { self.left_over() });
        Verdict {
            identical: difference.is_none(),
            packets: self.packets,
            frames: self.frames,
            truncated: log.truncated,
            difference,
        }
    }

    fn left_over(&self) -> Option<Difference> {
        let missing = || "nothing".to_owned();
        if let Some(piece) = self.expected.front() {
            return Some(self.difference(piece.kind(), String::new(), tree(piece).to_string(), missing()));
        }
        let piece = self.answered.front()?;
        Some(self.difference(piece.kind(), String::new(), missing(), tree(piece).to_string()))
    }

    fn difference(&self, kind: String, field: String, recorded: String, replayed: String) -> Difference {
        Difference { frame: self.frames + 1, packet: self.packets, kind, field, recorded, replayed }
    }
}

fn same(a: &Piece, b: &Piece) -> bool {
    a.bytes == b.bytes || (a.frame.is_some() && bits(a) == bits(b))
}

/// Postcard form: equal exactly when every bit of every field is, NaN included.
fn bits(piece: &Piece) -> Vec<u8> {
    let mut room = [0u8; fsw_core::link::framing::MAX_PAYLOAD];
    match piece.frame.as_ref().map(|frame| postcard::to_slice(frame, &mut room)) {
        Some(Ok(bytes)) => bytes.to_vec(),
        _ => piece.bytes.clone(),
    }
}

fn tree(piece: &Piece) -> Value {
    match piece.frame.as_ref().map(serde_json::to_value) {
        Some(Ok(value)) => value,
        _ => Value::String(format!("{} bytes", piece.bytes.len())),
    }
}

/// Path and values of the first leaf that differs; leaves that print alike (NaN) are told apart by nothing but name.
fn first_difference(a: &Value, b: &Value, path: &str) -> (String, String, String) {
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match (a, b) {
        (Value::Object(x), Value::Object(y)) => {
            for (key, left) in x {
                match y.get(key) {
                    Some(right) if left != right => return first_difference(left, right, &join(key)),
                    Some(_) => {}
                    None => return (join(key), left.to_string(), b.to_string()),
                }
            }
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            for (index, (left, right)) in x.iter().zip(y).enumerate() {
                if left != right {
                    return first_difference(left, right, &join(&index.to_string()));
                }
            }
        }
        _ => {}
    }
    (path.to_owned(), a.to_string(), b.to_string())
}
