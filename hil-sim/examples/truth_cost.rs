//! CPU cost of a whole flight of the truth with its sensors: `cargo run --release -p hil-sim --example truth_cost`.

use hil_sim::case::Case;
use hil_sim::scenario::Scenario;
use hil_sim::truth::Truth;

fn main() {
    let mut scenario = Scenario::builtin("msl").expect("the built-in scenario reads");
    scenario.dispersions.winds = true;
    scenario.atmosphere.perturbation.sigma = 0.02;
    let runs = 20;
    let start = std::time::Instant::now();
    let mut frames = 0u32;
    for run in 0..runs {
        let mut truth = Truth::new(&Case::draw(&scenario, 1, run, false));
        while truth.frame() < 15_000 && truth.altitude_m() > 0.0 {
            truth.advance(0.0, 0.0);
            std::hint::black_box((truth.packet(), truth.frame_packets()));
        }
        frames += truth.frame();
    }
    let per_frame_us = start.elapsed().as_secs_f64() * 1e6 / f64::from(frames);
    println!("{runs} flights, {frames} frames: {per_frame_us:.2} us a frame, {:.1} ms per 300 s", per_frame_us * 15.0);
}
