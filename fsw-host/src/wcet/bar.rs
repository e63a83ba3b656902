//! The progress bar of a measurement.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over a known number of steps, on standard error.
pub struct Bar(ProgressBar);

impl Bar {
    /// A bar of `steps`; hidden unless `visible`.
    #[must_use]
    pub fn new(visible: bool, steps: usize) -> Self {
        let bar = if visible { ProgressBar::new(steps as u64) } else { ProgressBar::hidden() };
        let style = ProgressStyle::with_template("  {bar:28.cyan/blue} {pos}/{len} {elapsed} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self(bar)
    }

    /// So many steps are done, and this is being worked on.
    pub fn at(&self, done: usize, what: &str) {
        self.0.set_position(done as u64);
        self.0.set_message(what.to_owned());
        self.0.tick();
    }

    /// Says something that the user has to do or know, above the bar; also when the bar is hidden.
    pub fn tell(&self, what: &str) {
        self.0.suspend(|| eprintln!("aeroshell: {what}"));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
