//! The progress bar, and what is said before a flight while something takes a while.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::recorder::Recorder;
use crate::telemetry::mode_word;

/// True states between two looks at the bar.
const FRAMES_PER_UPDATE: usize = 50;
/// Resolution of the bar.
const BAR_STEPS: u64 = 1_000;
/// Time between two turns of the wheel that turns before a flight.
const SPIN: Duration = Duration::from_millis(120);

/// A bar that follows the flight from entry to target.
pub struct Progress {
    bar: ProgressBar,
    visible: bool,
    seen: usize,
    range_at_entry_m: Option<f64>,
}

impl Progress {
    /// A bar on standard error; hidden there when `visible` is false. A standard error that is no terminal hides it too.
    #[must_use]
    pub fn new(visible: bool) -> Self {
        let bar = if visible { ProgressBar::new(BAR_STEPS) } else { ProgressBar::hidden() };
        let progress = Self { bar, visible, seen: 0, range_at_entry_m: None };
        progress.fly();
        progress
    }

    /// Says what is being done before the flight, while it may take a while.
    pub fn say(&self, what: &str) {
        if !self.visible {
            return;
        }
        if self.bar.is_hidden() {
            eprintln!("  {what}");
            return;
        }
        self.bar.set_style(style_of("  {spinner:.cyan} {msg}"));
        self.bar.set_message(what.to_owned());
        self.bar.enable_steady_tick(SPIN);
    }

    /// Where lines can be shown without tearing the bar.
    pub fn lines(&self) -> impl Fn(&str) + Send + use<> {
        let bar = self.bar.clone();
        move |line| bar.suspend(|| eprintln!("{line}"))
    }

    /// The flight begins.
    pub fn fly(&self) {
        self.bar.disable_steady_tick();
        self.bar.set_style(style_of("  {bar:28.cyan/blue} {msg}"));
        self.bar.set_message("");
    }

    /// Shows where the flight is; cheap when there is nothing new.
    pub fn update(&mut self, recorder: &Recorder) {
        let count = recorder.truth_count();
        if self.bar.is_hidden() || count < self.seen + FRAMES_PER_UPDATE {
            return;
        }
        self.seen = count;
        let Some(truth) = recorder.last_truth() else { return };
        let range_at_entry_m = *self.range_at_entry_m.get_or_insert(truth.range_to_go_m.max(1.0));
        let flown = (1.0 - truth.range_to_go_m / range_at_entry_m).clamp(0.0, 1.0);
        self.bar.set_position((flown * BAR_STEPS as f64) as u64);
        let mode = recorder.last_actuator().map_or("", |a| mode_word(a.mode));
        self.bar.set_message(format!(
            "{:5.1} s  {:6.2} km  {:6.1} m/s  {:6.1} km to go  {mode}",
            truth.time_s,
            truth.altitude_m * 1e-3,
            truth.speed_mps,
            truth.range_to_go_m * 1e-3
        ));
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn style_of(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
