//! A progress bar on standard error, for jobs that take a while.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::{Duration, Instant};

/// Jobs shorter than this show no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// A bar that appears once a job takes longer than a second, on a terminal.
pub(crate) struct Progress {
    bar: ProgressBar,
    start: Instant,
    shown: std::sync::Once,
}

impl Progress {
    /// A job of `rows` rows of rays. `quiet` shows no bar, where logs would break it.
    pub(crate) fn new(rows: u64, quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(Some(rows), ProgressDrawTarget::hidden());
        let template = "{msg:32} {wide_bar} {percent:>3}% {eta:>4}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        let shown = std::sync::Once::new();
        if quiet {
            shown.call_once(|| {});
        }
        Self { bar, start: Instant::now(), shown }
    }

    /// Says what goes on from now.
    pub(crate) fn stage(&self, name: impl Into<String>) {
        let name = name.into();
        log::debug!("{name}");
        self.bar.set_message(name);
    }

    /// So many more rows are done.
    pub(crate) fn advance(&self, rows: u64) {
        if self.start.elapsed() > PATIENCE {
            // Draws only if standard error is a terminal.
            self.shown.call_once(|| self.bar.set_draw_target(ProgressDrawTarget::stderr()));
        }
        self.bar.inc(rows);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
