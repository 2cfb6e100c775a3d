//! Tells how far long jobs are: by a bar where standard error is a terminal, else by a line every
//! few seconds.

use crate::output::note;
use crate::setup::{log_size, tell_backend, tell_chosen, tell_notices};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;
use umbrage_lab::{ChosenLight, ChosenView, Progress};
use umbrage_scene::Scene;

/// A job shows no bar until it has taken longer than this, and then draws it this often.
const PATIENCE: Duration = Duration::from_secs(1);

/// Time between two lines where there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// Steps of the bar for each part of a job.
const STEPS: u64 = 1000;

/// How far a job is. All parts of a job take equal lengths of the bar, and each part is divided
/// into rows of rays. A job may begin with stages that have no rows.
pub(crate) struct Bar {
    bar: ProgressBar,
    /// Shows the bar again and again; `None` where it would break log lines.
    _clock: Option<Clock>,
    /// Number of finished parts. `rows` and `rows_done` count all and finished rows of the current
    /// part.
    parts: AtomicU64,
    rows: AtomicU64,
    rows_done: AtomicU64,
}

impl Bar {
    /// Creates the bar of a job that sets its number of parts later. `quiet` hides the bar where
    /// log lines would break it.
    pub(crate) fn of_parts(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let template = "{prefix}{msg:32} {wide_bar} {percent:>3}% {eta:>4}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        let shown = bar.clone();
        let clock = match std::io::stderr().is_terminal() {
            true => Clock::start(PATIENCE, move || {
                if shown.is_hidden() {
                    shown.set_draw_target(ProgressDrawTarget::stderr());
                }
                shown.tick();
            }),
            false => Clock::start(BETWEEN_LINES, move || note(&line(&shown))),
        };
        let zero = || AtomicU64::new(0);
        let _clock = (!quiet).then_some(clock);
        Self { bar, _clock, parts: zero(), rows: zero(), rows_done: zero() }
    }

    /// The job turns out to have one part, with this many rows.
    pub(crate) fn one_part(&self, rows: u64) {
        self.parts(1);
        self.rows(rows);
    }

    /// Hides the bar while lines are written to standard error.
    pub(crate) fn aside(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }
}

/// How far a job is, in words.
fn line(bar: &ProgressBar) -> String {
    let share = match bar.length() {
        Some(length) => format!(", {}%", 100 * bar.position() / length.max(1)),
        None => String::new(),
    };
    format!("at work: {}{}{share}", bar.prefix(), bar.message())
}

/// A thread that does something at regular intervals until it is dropped.
struct Clock {
    /// Dropping it stops the thread.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Clock {
    fn start(interval: Duration, mut strike: impl FnMut() + Send + 'static) -> Self {
        let (stop, stopped) = channel::<()>();
        let thread = std::thread::spawn(move || {
            while stopped.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
                strike();
            }
        });
        Self { stop: Some(stop), thread: Some(thread) }
    }
}

impl Drop for Clock {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported when it happened.
            let _ = thread.join();
        }
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
        let done = rows + self.rows_done.fetch_add(rows, Ordering::Relaxed);
        let rows = self.rows.load(Ordering::Relaxed).max(done).max(1);
        self.bar.set_position(self.parts.load(Ordering::Relaxed) * STEPS + STEPS * done / rows);
    }

    fn end_part(&self) {
        self.rows(0);
        let parts = 1 + self.parts.fetch_add(1, Ordering::Relaxed);
        self.bar.set_position(parts * STEPS);
    }

    fn chosen(&self, view: &ChosenView, light: &ChosenLight) {
        self.aside(|| tell_chosen(view, std::slice::from_ref(light)));
    }

    fn scene(&self, name: &str, scene: &Scene) {
        self.aside(|| {
            log_size(name, scene);
            tell_notices(scene);
        });
    }

    fn failed(&self, view: &str, error: &str) {
        self.note(&format!("umbrage: view `{view}`: {error}"));
    }

    fn backend(&self, choice: &str) {
        self.aside(|| tell_backend(choice));
    }

    fn note(&self, line: &str) {
        self.aside(|| note(line));
    }

    fn warn(&self, line: &str) {
        self.aside(|| log::warn!("{line}"));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_strikes_until_it_is_dropped() {
        let (struck, strikes) = channel();
        let clock = Clock::start(Duration::from_millis(1), move || {
            // Nobody listens any more at the end.
            let _ = struck.send(());
        });
        for _ in 0..3 {
            strikes.recv().unwrap();
        }
        drop(clock);
        while strikes.try_recv().is_ok() {}
        assert!(strikes.recv().is_err(), "the thread has ended and dropped its end");
    }

    #[test]
    fn lines_tell_the_stage_and_what_is_done() {
        let bar = Bar::of_parts(true);
        bar.stage("opening town");
        assert_eq!(line(&bar.bar), "at work: opening town");
        bar.one_part(8);
        bar.stage("picture");
        bar.advance(2);
        assert_eq!(line(&bar.bar), "at work: picture, 25%");
        bar.parts(4);
        bar.end_part();
        bar.part("2/4 gate");
        assert_eq!(line(&bar.bar), "at work: 2/4 gate: picture, 25%");
    }
}
