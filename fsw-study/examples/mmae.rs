//! P3's experiment on a terminal: `cargo run --release -p fsw-study --example mmae -- RUNS SEED [CONFIG.toml]`.

use fsw_study::mmae::config::Config;
use fsw_study::mmae::{Study, bars::bars};
use fsw_study::settings::Stored;

fn main() -> Result<(), String> {
    let mut args = std::env::args().skip(1);
    let mut number = |default: u64| args.next().map_or(Ok(default), |text| text.parse().map_err(|_| text));
    let (runs, seed) = (number(20)?, number(1)?);
    let config = match args.next() {
        Some(path) => Config::from_toml(&std::fs::read_to_string(&path).map_err(|e| format!("{path}: {e}"))?)?,
        None => Config::default(),
    };
    let study = Study::fly(&config, seed, runs, |_, _| {});
    for case in [&study.fixed, &study.table5, &study.ranking, &study.robust].into_iter().flatten() {
        println!(
            "{} scenario {} reading {:?} {} Hz {} runs",
            case.name, case.scenario, case.reading, case.rate_hz, case.runs
        );
        let line = |name: &str, axes: [f64; 6], rest: String| {
            let [x, y, z, vx, vy, vz] = axes;
            println!("  {name:<22} {x:9.2} {y:9.2} {z:9.2} | {vx:8.4} {vy:8.4} {vz:8.4} | {rest}");
        };
        if let Some(bound) = case.bound {
            for (name, b) in [
                ("bound", bound.unknown_density),
                ("attained here", bound.attained),
                ("bound, density known", bound.known_density),
            ] {
                line(name, b.axes, format!("{:9.2} {:8.4}", b.position_m, b.velocity_mps));
            }
        }
        for f in &case.filters {
            let failure =
                f.failure.as_ref().map_or(String::new(), |f| format!("{} {}..{} s", f.words, f.first_s, f.last_s));
            let rest = format!(
                "{:9.2} {:8.4} NEES {:9.3e} indef {:.4} div {} fail {} {} {:?} ns {:?}",
                f.rmse.position_m,
                f.rmse.velocity_mps,
                f.nees.unwrap_or(f64::NAN),
                f.indefinite_share,
                f.diverged,
                f.failed,
                failure,
                f.step_ns.map(f64::round),
                f.ekfs
            );
            line(&f.label, f.rmse.axes, rest);
        }
    }
    for bar in bars(&study) {
        let limits = format!(
            "{} .. {}",
            bar.low.map_or(String::new(), |x| x.to_string()),
            bar.high.map_or(String::new(), |x| x.to_string())
        );
        println!(
            "{} {:<70} {:9.4}  {limits}",
            if bar.is_met { "ok  " } else { "MISS" },
            bar.what,
            bar.value.unwrap_or(f64::NAN)
        );
    }
    Ok(())
}
