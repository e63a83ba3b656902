//! P2's experiment on the terminal: `cargo run --release -p fsw-study --example ddf -- [RUNS] [CONFIG.toml]`; with `--tune`
//! in place of RUNS the search for the tuned EKF, with `--steps=N` the first N steps of run 0 and no more.

use fsw_study::ddf::{Config, Filter, Kind, fly_all, fly_steps, search};
use fsw_study::settings::parse;

fn main() -> Result<(), String> {
    let mut args = std::env::args().skip(1);
    let what = args.next().unwrap_or_else(|| "20".into());
    let config: Config = match args.next() {
        Some(path) => parse(&std::fs::read_to_string(&path).map_err(|e| format!("{path}: {e}"))?)?,
        None => Config::default(),
    };
    config.check()?;
    if what == "--tune" {
        for (kind, t) in [Kind::EkfTuned, Kind::EkfForces]
            .into_iter()
            .flat_map(|k| search(&config, k).into_iter().map(move |t| (k, t)))
        {
            let [r, v, ..] = t.rmse;
            let position = t.position_rmse_m;
            println!(
                "{:22} process {:6} sensors {:6}: r {r:6.0} m, v {v:6.2} m/s, {position:7.0} m, cost {:.4}",
                kind.name(),
                t.process,
                t.sensors,
                t.cost()
            );
        }
        return Ok(());
    }
    if let Some(steps) = what.strip_prefix("--steps=") {
        let steps = steps.parse().map_err(|_| format!("{steps} is no number of steps"))?;
        Filter::of(&config).into_iter().for_each(|filter| fly_steps(&config, filter, steps));
        return Ok(());
    }
    let runs = what.parse().map_err(|_| format!("{what} is no number of runs"))?;
    println!("{:34}     r m   v m/s  pos m    NEES  indef  div  order2   ms", "filter");
    let _ = fly_all(&config, 1, runs, |o| {
        println!(
            "{:34} {:7.0} {:7.2} {:6.0} {:7.1} {:6.3} {:4} {:6.1}% {:6.2}",
            o.name,
            o.rmse[0],
            o.rmse[1],
            o.position_rmse_m,
            o.nees,
            o.indefinite_share,
            o.diverged,
            100.0 * o.second_share,
            o.host_ms_per_run
        );
    });
    Ok(())
}
