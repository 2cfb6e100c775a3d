//! Shows a progress bar on standard error during long jobs.

use crate::output::note;
use crate::setup::{log_size, tell_backend, tell_notices};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use umbrage_lab::Progress;
use umbrage_scene::Scene;

/// A job shows no bar until it has taken longer than this.
const PATIENCE: Duration = Duration::from_secs(1);

/// Steps of the bar for each part of a job.
const STEPS: u64 = 1000;

/// A progress bar that appears on a terminal once a job takes longer than a second. All parts of a
/// job take equal lengths of the bar, and each part is divided into rows of rays.
pub(crate) struct Bar {
    bar: ProgressBar,
    start: Instant,
    shown: Once,
    /// Number of finished parts. `rows` and `rows_done` count all and finished rows of the current
    /// part.
    parts: AtomicU64,
    rows: AtomicU64,
    rows_done: AtomicU64,
}

impl Bar {
    /// Creates the bar of a job with one part and this many rows. `quiet` hides the bar where log
    /// lines would break it.
    pub(crate) fn new(rows: u64, quiet: bool) -> Self {
        let bar = Self::of_parts(quiet);
        bar.parts(1);
        bar.rows(rows);
        bar
    }

    /// Creates the bar of a job that sets its number of parts later.
    pub(crate) fn of_parts(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
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
}

impl Progress for Bar {
    fn parts(&self, count: u64) {
        self.bar.set_length(count * STEPS);
    }

    fn part(&self, name: &str) {
        log::info!("{name}");
        self.bar.set_prefix(format!("{name}: "));
    }

    fn rows(&self, rows: u64) {
        self.rows.store(rows, Ordering::Relaxed);
        self.rows_done.store(0, Ordering::Relaxed);
    }

    fn stage(&self, name: &str) {
        log::debug!("{name}");
        self.bar.set_message(name.to_owned());
    }

    fn advance(&self, rows: u64) {
        if self.start.elapsed() > PATIENCE {
            // The bar is drawn only if standard error is a terminal.
            self.shown.call_once(|| self.bar.set_draw_target(ProgressDrawTarget::stderr()));
        }
        let done = rows + self.rows_done.fetch_add(rows, Ordering::Relaxed);
        let rows = self.rows.load(Ordering::Relaxed).max(done).max(1);
        self.bar.set_position(self.parts.load(Ordering::Relaxed) * STEPS + STEPS * done / rows);
    }

    fn end_part(&self) {
        self.rows(0);
        let parts = 1 + self.parts.fetch_add(1, Ordering::Relaxed);
        self.bar.set_position(parts * STEPS);
    }

    // `suspend` hides the bar while lines are written to standard error.

    fn scene(&self, name: &str, scene: &Scene) {
        self.bar.suspend(|| {
            log_size(name, scene);
            tell_notices(scene);
        });
    }

    fn failed(&self, view: &str, error: &str) {
        self.note(&format!("umbrage: view `{view}`: {error}"));
    }

    fn backend(&self, choice: &str) {
        self.bar.suspend(|| tell_backend(choice));
    }

    fn note(&self, line: &str) {
        self.bar.suspend(|| note(line));
    }

    fn warn(&self, line: &str) {
        self.bar.suspend(|| log::warn!("{line}"));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
