//! The progress bar.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::printable;

/// A progress bar over simulated time, on stderr, if that is a terminal.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
    quiet: bool,
}

impl Progress {
    /// A bar that is hidden if `quiet` or if stderr is no terminal.
    pub(crate) fn new(quiet: bool) -> Self {
        let target = if quiet || !std::io::stderr().is_terminal() {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(10)
        };
        let bar = ProgressBar::with_draw_target(Some(Self::PARTS), target);
        if let Ok(style) = ProgressStyle::with_template(
            "{prefix:>10} [{bar:32}] {percent:>3} %  {elapsed} gone, {eta} to go  {msg}",
        ) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar, quiet }
    }

    const PARTS: u64 = 10_000;

    /// Names the phase that runs now.
    pub(crate) fn phase(&self, name: &'static str) {
        self.bar.set_prefix(name);
    }

    /// Shows how much of the work is done, from 0 to 1.
    pub(crate) fn set(&self, fraction: f64) {
        let parts = fraction.clamp(0.0, 1.0) * 10_000.0;
        #[allow(
            clippy::cast_possible_truncation,
            reason = "clamped to 0..=10000 just above"
        )]
        self.bar.set_position(parts as u64);
    }

    /// Shows a few words beside the bar.
    pub(crate) fn message(&self, text: String) {
        self.bar.set_message(text);
    }

    /// Writes a warning on stderr, above the bar; nothing if `quiet`.
    pub(crate) fn warn(&self, text: &str) {
        if self.quiet {
            return;
        }
        let line = format!("warning: {}", printable(text));
        // Who does not listen does not keep a run from going on.
        self.bar
            .suspend(|| drop(writeln!(std::io::stderr(), "{line}")));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
