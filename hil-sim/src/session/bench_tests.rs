use std::thread;

use super::super::scripted::Scripted;
use super::super::{RemoteTruth, TruthEnd};
use super::*;
use crate::transport::{Listener, Tcp};

/// A server for one flight on a free port.
fn server() -> (String, thread::JoinHandle<Result<End, SessionError>>) {
    let listener = Listener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_address().unwrap().to_string();
    let handle = thread::spawn(move || serve(&mut listener.accept().unwrap(), Pace::LockStep));
    (address, handle)
}

/// Carries bytes between a truth and a scripted flight computer until the parachute fires. The bytes the computer heard.
fn fly(truth: &mut dyn TruthEnd, fire_at_frame: u32) -> Result<Vec<u8>, SessionError> {
    let mut computer = Scripted::new(fire_at_frame);
    let (mut said, mut all) = (Vec::new(), Vec::new());
    loop {
        let mut next = Vec::new();
        truth.exchange(&said, &mut next)?;
        said.clear();
        computer.receive(&next, &mut said);
        all.extend_from_slice(&next);
        if computer.frame >= fire_at_frame {
            // The last word, so that the other end knows too.
            let _ = truth.exchange(&said, &mut Vec::new());
            return Ok(all);
        }
    }
}

#[test]
fn a_flight_is_the_same_bytes_in_process_over_tcp_and_over_a_pty() {
    let scenario = Scenario::builtin("msl").unwrap();
    let here = fly(&mut Conductor::new(&scenario, 3, 1, false).unwrap(), 120).unwrap();
    let (address, handle) = server();
    let mut remote = RemoteTruth::open(&format!("tcp:{address}"), &scenario, 3, 1, false).unwrap();
    assert!(fly(&mut remote, 120).unwrap() == here, "TCP differs");
    assert_eq!(handle.join().unwrap(), Ok(End::Deployed));
    let mut remote = RemoteTruth::open("pty", &scenario, 3, 1, false).unwrap();
    assert!(fly(&mut remote, 120).unwrap() == here, "pty differs");
    let other = fly(&mut Conductor::new(&scenario, 4, 1, false).unwrap(), 120).unwrap();
    assert!(other != here, "the seed does nothing");
}

#[test]
fn a_peer_of_another_version_is_refused_at_both_ends() {
    for theirs in [
        Message::Hello { version: BENCH_VERSION + 1, schema_hash: SCHEMA_HASH },
        Message::Hello { version: BENCH_VERSION, schema_hash: SCHEMA_HASH ^ 1 },
    ] {
        let (address, handle) = server();
        let mut stream = Tcp::connect(&address).unwrap();
        say(&mut stream, SERVER, &theirs).unwrap();
        // The server still says who it is, so that the client can tell its user.
        assert_eq!(Inbox::default().next(&mut stream, SERVER, version_of), Ok(Some((BENCH_VERSION, SCHEMA_HASH))));
        let error = handle.join().unwrap().unwrap_err();
        assert!(matches!(error, SessionError::BenchVersion { .. } | SessionError::Hello { .. }), "{error}");
    }
    let listener = Listener::bind("127.0.0.1:0").unwrap();
    let place = format!("tcp:{}", listener.local_address().unwrap());
    let old = thread::spawn(move || {
        say(&mut listener.accept().unwrap(), CLIENT, &Message::Hello { version: 77, schema_hash: 0 })
    });
    let error = RemoteTruth::open(&place, &Scenario::builtin("msl").unwrap(), 1, 0, true).err().unwrap();
    old.join().unwrap().unwrap();
    assert_eq!(
        error.to_string(),
        format!(
            "the peer's bench protocol is version 77, this program's is {BENCH_VERSION}: build both ends from the same sources"
        )
    );
}

#[test]
fn a_link_cut_in_mid_flight_is_told_at_both_ends() {
    let scenario = Scenario::builtin("msl").unwrap();
    let (address, handle) = server();
    let mut remote = RemoteTruth::open(&format!("tcp:{address}"), &scenario, 1, 0, true).unwrap();
    fly_some_frames(&mut remote, 30);
    drop(remote);
    let Ok(End::Failed(error)) = handle.join().unwrap() else { panic!("the server did not notice") };
    assert!(error.to_string().starts_with("the link to the flight computer was cut at t = 0."), "{error}");

    let listener = Listener::bind("127.0.0.1:0").unwrap();
    let place = format!("tcp:{}", listener.local_address().unwrap());
    let dying = thread::spawn(move || {
        let mut stream = listener.accept().unwrap();
        let (order, _) = take_order(&mut stream).unwrap();
        say(&mut stream, CLIENT, &Message::Ready).unwrap();
        let mut conductor = Conductor::new(&order.scenario, order.seed, order.run, order.nominal).unwrap();
        let mut out = Vec::new();
        conductor.transmit(&mut out);
        stream.write_all(&out).unwrap();
    });
    let mut remote = RemoteTruth::open(&place, &scenario, 1, 0, true).unwrap();
    let error = fly(&mut remote, 1000).unwrap_err();
    dying.join().unwrap();
    assert!(error.to_string().starts_with("the link to the truth simulator was cut in mid-flight: "), "{error}");
}

fn fly_some_frames(truth: &mut dyn TruthEnd, frames: u32) {
    let mut computer = Scripted::new(u32::MAX);
    let mut said = Vec::new();
    while computer.frame < frames {
        let mut next = Vec::new();
        truth.exchange(&said, &mut next).unwrap();
        said.clear();
        computer.receive(&next, &mut said);
    }
}

#[test]
fn nobody_there_and_a_port_in_use_each_get_one_sentence() {
    let listener = Listener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_address().unwrap().to_string();
    let in_use = Listener::bind(&address).err().unwrap();
    assert_eq!(in_use.to_string(), format!("tcp:{address}: the port is in use"));
    drop(listener);
    let scenario = Scenario::builtin("msl").unwrap();
    let open = |place: &str| RemoteTruth::open(place, &scenario, 1, 0, true).err().unwrap().to_string();
    assert_eq!(open(&format!("tcp:{address}")), format!("tcp:{address}: connection refused: nobody listens there"));
    assert_eq!(
        open("carrier-pigeon"),
        "carrier-pigeon: not a place for the truth; expected in-process, tcp:HOST:PORT or pty"
    );
}

#[test]
fn garbage_before_the_greeting_does_no_harm() {
    let (address, handle) = server();
    let mut stream = Tcp::connect(&address).unwrap();
    stream.write_all(b"GET / HTTP/1.1\r\n\r\n\0\0\xff\x01\0").unwrap();
    drop(stream);
    assert!(matches!(handle.join().unwrap(), Err(SessionError::Cut { .. })));
}

#[test]
fn a_long_text_is_cut_between_characters() {
    let text = "µ".repeat(1000);
    assert!(pieces(&text).iter().all(|piece| piece.len() <= TEXT_PIECE));
    assert_eq!(pieces(&text).concat(), text);
}

/// A stream whose peer greets properly and then makes noise for ever.
struct Noisy {
    computer: Scripted,
    said: Vec<u8>,
    packets: u32,
}

impl Stream for Noisy {
    fn read_some(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
        std::thread::sleep(Duration::from_millis(1));
        if self.packets > 1 {
            buffer[..8].copy_from_slice(b"noise\0\0\x01");
            return Ok(8);
        }
        let n = self.said.len().min(buffer.len());
        buffer[..n].copy_from_slice(&self.said[..n]);
        self.said.drain(..n);
        Ok(n)
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.packets += 1;
        self.computer.receive(bytes, &mut self.said);
        Ok(())
    }
}

#[test]
fn noise_without_end_from_a_flight_computer_is_as_good_as_silence() {
    let scenario = Scenario::builtin("msl").unwrap();
    let mut conductor = Conductor::new(&scenario, 1, 0, true).unwrap();
    let mut stream = Noisy { computer: Scripted::new(u32::MAX), said: Vec::new(), packets: 0 };
    let End::Failed(error) = pump(&mut stream, &mut conductor, Pace::LockStep) else { panic!("it flew on noise") };
    assert!(error.to_string().starts_with("the flight computer does not answer the loading of the "), "{error}");
}

#[test]
fn a_refusal_without_end_is_listened_to_for_a_while_only() {
    let listener = Listener::bind("127.0.0.1:0").unwrap();
    let place = format!("tcp:{}", listener.local_address().unwrap());
    let talker = thread::spawn(move || {
        let mut stream = listener.accept().unwrap();
        take_order(&mut stream).unwrap();
        while say(&mut stream, CLIENT, &Message::Error { text: "no, and moreover " }).is_ok() {}
    });
    let error = RemoteTruth::open(&place, &Scenario::builtin("msl").unwrap(), 1, 0, true).err().unwrap().to_string();
    talker.join().unwrap();
    assert!(error.starts_with("the truth simulator refuses the flight: no, and moreover "), "{error}");
    assert!(error.len() < 2 * MAX_REFUSAL, "{} bytes", error.len());
}
