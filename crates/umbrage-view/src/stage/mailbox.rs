//! A place for the newest message of one kind.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Holds the newest message. A newer one replaces it, so whoever is slow skips what is out of date.
#[derive(Debug)]
pub(crate) struct Mailbox<T> {
    inside: Mutex<Inside<T>>,
    changed: Condvar,
}

#[derive(Debug)]
struct Inside<T> {
    message: Option<T>,
    is_closed: bool,
}

/// What waiting for a message came to.
#[derive(Debug, PartialEq)]
pub(crate) enum Mail<T> {
    /// A message that was not taken before.
    New(T),
    /// There was none in time.
    None,
    /// There will be none any more.
    Closed,
}

impl<T> Default for Mailbox<T> {
    fn default() -> Self {
        Self {
            inside: Mutex::new(Inside { message: None, is_closed: false }),
            changed: Condvar::new(),
        }
    }
}

impl<T> Mailbox<T> {
    fn inside(&self) -> MutexGuard<'_, Inside<T>> {
        // No operation under the lock leaves it half done.
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a message in place of the one that was not taken yet.
    pub(crate) fn put(&self, message: T) {
        self.inside().message = Some(message);
        self.changed.notify_all();
    }

    /// Whether a message waits, or none will come any more.
    pub(crate) fn is_pending(&self) -> bool {
        let inside = self.inside();
        inside.message.is_some() || inside.is_closed
    }

    /// Whether no message will come any more.
    pub(crate) fn is_closed(&self) -> bool {
        self.inside().is_closed
    }

    /// Tells whoever waits that no message will come any more.
    pub(crate) fn close(&self) {
        self.inside().is_closed = true;
        self.changed.notify_all();
    }

    /// Waits for a message, at most for this long, or for ever.
    pub(crate) fn take(&self, at_most: Option<Duration>) -> Mail<T> {
        let end = at_most.map(|wait| Instant::now() + wait);
        let mut inside = self.inside();
        loop {
            if inside.is_closed {
                return Mail::Closed;
            }
            if let Some(message) = inside.message.take() {
                return Mail::New(message);
            }
            let Some(end) = end else {
                inside = self.changed.wait(inside).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Mail::None;
            }
            let waited = self.changed.wait_timeout(inside, left);
            inside = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_message_is_left() {
        let mailbox = Mailbox::default();
        assert_eq!(mailbox.take(Some(Duration::ZERO)), Mail::None);
        mailbox.put(1);
        mailbox.put(2);
        assert!(mailbox.is_pending());
        assert_eq!(mailbox.take(None), Mail::New(2));
        assert!(!mailbox.is_pending());
        std::thread::scope(|scope| {
            scope.spawn(|| mailbox.put(3));
            assert_eq!(mailbox.take(None), Mail::New(3));
            scope.spawn(|| mailbox.close());
            assert_eq!(mailbox.take(None), Mail::Closed);
        });
        assert!(mailbox.is_pending(), "whoever works should stop");
    }
}
