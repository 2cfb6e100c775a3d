//! The memory that a scene may take.

use crate::error::SceneError;
use std::cell::Cell;
use std::path::Path;

/// Keeps count of the memory that a scene takes while it is loaded. Few bytes of a file can ask for
/// any amount of memory, by arrays without data, by meshes that share arrays, by instances, or by
/// compressed images. So whatever can become large is taken from the budget before it is allocated.
pub(super) struct Budget<'a> {
    /// Path of the scene file, for errors.
    path: &'a Path,
    /// Bytes.
    limit: u64,
    /// Bytes.
    taken: Cell<u64>,
}

impl<'a> Budget<'a> {
    pub(super) fn new(path: &'a Path, limit: u64) -> Self {
        Self { path, limit, taken: Cell::new(0) }
    }

    /// Takes the memory of `count` things of `size` bytes each.
    ///
    /// # Errors
    /// [`SceneError::TooLarge`] if that much is not left. Then nothing is taken.
    pub(super) fn take(
        &self,
        place: &str,
        count: u64,
        what: &str,
        size: usize,
    ) -> Result<(), SceneError> {
        let needs = self.taken.get().saturating_add(count.saturating_mul(size as u64));
        if needs > self.limit {
            return Err(SceneError::TooLarge {
                path: self.path.into(),
                place: place.into(),
                what: format!("{count} {what}"),
                needs,
                limit: self.limit,
            });
        }
        self.taken.set(needs);
        Ok(())
    }

    /// Makes room for `more` things in a list, each of which counts `size` bytes. While the list
    /// grows, its old memory counts beside the new. It grows by half or more, if that fits.
    ///
    /// # Errors
    /// [`SceneError::TooLarge`] if the list does not fit.
    pub(super) fn grow<T>(
        &self,
        place: &str,
        list: &mut Vec<T>,
        more: u64,
        what: &str,
        size: usize,
    ) -> Result<(), SceneError> {
        let (old, needed) = (list.capacity() as u64, (list.len() as u64).saturating_add(more));
        if needed <= old {
            return Ok(());
        }
        let roomy = needed.max(old + old / 2);
        // The old memory is given back when all has moved to the new.
        let take = |capacity| self.take(place, capacity, what, size).map(|()| capacity);
        let capacity = take(roomy).or_else(|_| take(needed))?;
        list.reserve_exact(capacity as usize - list.len());
        self.taken.set(self.taken.get() - old * size as u64);
        Ok(())
    }

    /// How much is taken, bytes.
    pub(super) fn taken(&self) -> u64 {
        self.taken.get()
    }

    /// Gives back all that was taken since [`taken`](Self::taken) returned `taken`, because it was
    /// needed for a while only.
    pub(super) fn give_back_to(&self, taken: u64) {
        self.taken.set(taken);
    }
}
