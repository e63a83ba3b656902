//! The truth simulator as a program: serves flights to `aeroshell fly --truth …`, or conducts a flight computer itself.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgGroup, Parser};
use hil_sim::case::Case;
use hil_sim::scenario::Scenario;
use hil_sim::session::{Conductor, End, Pace, Plan, SessionError, bench, pump};
use hil_sim::transport::{Listener, Stream, open_serial};
use hil_sim::truth::Truth;

/// Simulates a Mars entry at one end of a byte stream.
///
/// Without SCENARIO it waits for a host that orders flights (`aeroshell fly --truth tcp:HOST:PORT`). With SCENARIO it
/// conducts a flight computer at the other end directly: loads it, arms it, flies it.
#[derive(Parser)]
#[command(version, group = ArgGroup::new("where").required(true))]
struct Arguments {
    /// Built-in scenario or TOML file to conduct a flight computer with.
    scenario: Option<String>,
    /// Listen on tcp:HOST:PORT; port 0 takes a free one and prints it.
    #[arg(long, group = "where", value_name = "tcp:HOST:PORT")]
    listen: Option<String>,
    /// Open a pseudo-terminal and print the path of the other end.
    #[arg(long, group = "where")]
    pty: bool,
    /// Open a serial line.
    #[arg(long, group = "where", value_name = "DEVICE:BAUD")]
    serial: Option<String>,
    /// Open an existing terminal device, as the other end of somebody's pseudo-terminal.
    #[arg(long, group = "where", value_name = "PATH")]
    terminal: Option<PathBuf>,
    /// A frame every 20 ms by the clock, instead of waiting for the flight computer.
    #[arg(long)]
    realtime: bool,
    /// Stop after one flight.
    #[arg(long)]
    once: bool,
    /// Change a field of SCENARIO.
    #[arg(long, value_name = "dotted.field=value", requires = "scenario")]
    set: Vec<String>,
    /// Seed of the dispersions of SCENARIO.
    #[arg(long, default_value_t = 1, requires = "scenario")]
    seed: u64,
    /// Run number under that seed.
    #[arg(long, default_value_t = 0, requires = "scenario")]
    run: u64,
    /// No dispersions.
    #[arg(long, requires = "scenario")]
    nominal: bool,
    /// Say nothing but errors.
    #[arg(long)]
    quiet: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(code) => code,
        Err(sentence) => {
            eprintln!("hil-sim: {sentence}");
            ExitCode::from(2)
        }
    }
}

/// Opens the place and flies there, once or for ever. The exit code of the last flight.
fn run(arguments: &Arguments) -> Result<ExitCode, String> {
    let scenario = match &arguments.scenario {
        Some(name) => Some(Scenario::resolve(name, &arguments.set).map_err(|e| e.to_string())?),
        None => None,
    };
    let say = |text: String| {
        if !arguments.quiet {
            println!("{text}");
        }
    };
    if let Some(place) = &arguments.listen {
        let address = place.strip_prefix("tcp:").unwrap_or(place);
        let listener = Listener::bind(address).map_err(|e| e.to_string())?;
        let bound = listener.local_address().map_err(|e| format!("{place}: {e}"))?;
        // Scripts read this line for the port.
        println!("listening on tcp:{bound}");
        loop {
            let mut stream = listener.accept().map_err(|e| format!("{place}: {e}"))?;
            let code = fly(&mut stream, scenario.as_ref(), arguments, &say);
            if arguments.once {
                return Ok(code);
            }
        }
    }
    if let Some(place) = &arguments.serial {
        let mut stream = open_serial(place).map_err(|e| e.to_string())?;
        return Ok(fly(stream.as_mut(), scenario.as_ref(), arguments, &say));
    }
    terminal(arguments, scenario.as_ref(), &say)
}

/// Flies on a pseudo-terminal, own or given.
#[cfg(unix)]
fn terminal(arguments: &Arguments, scenario: Option<&Scenario>, say: &dyn Fn(String)) -> Result<ExitCode, String> {
    use hil_sim::transport::{PtyPair, open_terminal};
    if let Some(path) = &arguments.terminal {
        let mut stream = open_terminal(path).map_err(|e| e.to_string())?;
        return Ok(fly(&mut stream, scenario, arguments, say));
    }
    loop {
        let mut pair = PtyPair::open().map_err(|e| e.to_string())?;
        println!("listening on pty:{}", pair.slave_path.display());
        let code = fly(&mut pair.master, scenario, arguments, say);
        if arguments.once {
            return Ok(code);
        }
    }
}

#[cfg(not(unix))]
fn terminal(_: &Arguments, _: Option<&Scenario>, _: &dyn Fn(String)) -> Result<ExitCode, String> {
    Err("pseudo-terminals exist on Unix only".into())
}

/// One flight on an open stream.
fn fly(stream: &mut dyn Stream, scenario: Option<&Scenario>, arguments: &Arguments, say: &dyn Fn(String)) -> ExitCode {
    let pace = if arguments.realtime { Pace::RealTime } else { Pace::LockStep };
    let ended = match scenario {
        None => bench::serve(stream, pace),
        Some(scenario) => conduct(stream, scenario, arguments, pace),
    };
    let failure = match ended {
        Ok(End::Failed(error)) | Err(error) => error.to_string(),
        Ok(end) => {
            say(match end {
                End::Deployed => "flight over: parachute fired".into(),
                End::Ground => "flight over: ground reached without a parachute".into(),
                _ => "flight over: time limit reached".into(),
            });
            return if end == End::Deployed { ExitCode::SUCCESS } else { ExitCode::from(1) };
        }
    };
    eprintln!("hil-sim: {failure}");
    ExitCode::from(1)
}

/// Conducts a flight computer; nobody records on the way, so no true state is tapped.
fn conduct(
    stream: &mut dyn Stream,
    scenario: &Scenario,
    arguments: &Arguments,
    pace: Pace,
) -> Result<End, SessionError> {
    let case = Case::draw(scenario, arguments.seed, arguments.run, arguments.nominal);
    let mut plan = Plan::new(scenario, case.knowledge, case.noise.stream("uplink faults"));
    plan.truth_tap = false;
    let mut conductor = Conductor::with_plant(Truth::new(&case), plan)?;
    conductor.set_pace(pace.of_the_board());
    Ok(pump(stream, &mut conductor, pace))
}
