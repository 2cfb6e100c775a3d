//! A progress bar on standard error, for jobs that take a while.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Jobs shorter than this show no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Steps of the bar for each part of a job.
const STEPS: u64 = 1000;

/// A bar that appears once a job takes longer than a second, on a terminal. A job has parts that count
/// alike, and each part has rows of rays.
pub(crate) struct Progress {
    bar: ProgressBar,
    start: Instant,
    shown: Once,
    /// Parts that are done, and rows of the present one: in all, and done.
    parts: AtomicU64,
    rows: AtomicU64,
    rows_done: AtomicU64,
}

impl Progress {
    /// A job of one part with so many rows. `quiet` shows no bar, where logs would break it.
    pub(crate) fn new(rows: u64, quiet: bool) -> Self {
        let progress = Self::of_parts(1, quiet);
        progress.begin(rows);
        progress
    }

    /// A job of so many parts.
    pub(crate) fn of_parts(parts: u64, quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(Some(parts * STEPS), ProgressDrawTarget::hidden());
        let template = "{prefix}{msg:32} {wide_bar} {percent:>3}% {eta:>4}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        let shown = Once::new();
        if quiet {
            shown.call_once(|| {});
        }
        let zero = || AtomicU64::new(0);
        Self { bar, start: Instant::now(), shown, parts: zero(), rows: zero(), rows_done: zero() }
    }

    /// What the present part is called.
    pub(crate) fn name(&self, name: String) {
        log::info!("{name}");
        self.bar.set_prefix(name + ": ");
    }

    /// How many rows the present part has.
    pub(crate) fn begin(&self, rows: u64) {
        self.rows.store(rows, Ordering::Relaxed);
        self.rows_done.store(0, Ordering::Relaxed);
    }

    /// The present part is done.
    pub(crate) fn end(&self) {
        self.begin(0);
        let parts = 1 + self.parts.fetch_add(1, Ordering::Relaxed);
        self.bar.set_position(parts * STEPS);
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
        let done = rows + self.rows_done.fetch_add(rows, Ordering::Relaxed);
        let rows = self.rows.load(Ordering::Relaxed).max(done).max(1);
        self.bar.set_position(self.parts.load(Ordering::Relaxed) * STEPS + STEPS * done / rows);
    }

    /// Lets others write to standard error, with the bar out of their way.
    pub(crate) fn aside<T>(&self, write: impl FnOnce() -> T) -> T {
        self.bar.suspend(write)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
