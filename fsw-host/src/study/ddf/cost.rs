//! What a filter costs: instructions of this machine, the same at every repetition. The program flies one filter over run 0
//! under Callgrind, once the whole run and once no step of it; the difference is the filter's.

use std::env;
use std::path::Path;
use std::process::{Command, Stdio};

use rayon::prelude::*;

/// How Callgrind begins the line with its count.
const COUNTED: &str = "Collected : ";

/// Instructions of a step, the mean over a run of `steps`, of each of `filters`; nothing where it cannot be counted: no
/// Valgrind on this machine.
pub fn count(config: &Path, filters: usize, steps: usize) -> Vec<Option<f64>> {
    let of = |at| Some((run(config, at, steps)? - run(config, at, 0)?) / steps as f64);
    (0..filters).into_par_iter().map(of).collect()
}

fn run(config: &Path, at: usize, steps: usize) -> Option<f64> {
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    command.arg(env::current_exe().ok()?).args(["study", "ddf"]).arg(config);
    command.args(["--only", &at.to_string(), "--steps", &steps.to_string()]);
    let output = command.stdin(Stdio::null()).stdout(Stdio::null()).output().ok()?;
    let said = String::from_utf8_lossy(&output.stderr);
    output.status.success().then(|| counted(&said)).flatten()
}

fn counted(said: &str) -> Option<f64> {
    let line = said.lines().find_map(|line| line.split_once(COUNTED))?;
    line.1.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_is_read_from_what_callgrind_says() {
        let said = "==7== Callgrind\n==7== \n==7== Events    : Ir\n==7== Collected : 27440282\n==7== \n";
        assert_eq!(counted(said), Some(27_440_282.0));
        assert_eq!(counted("valgrind: not found"), None);
    }

    #[test]
    fn without_what_is_counted_there_is_no_figure() {
        assert_eq!(count(Path::new("no such file"), 1, 10), vec![None]);
    }
}
