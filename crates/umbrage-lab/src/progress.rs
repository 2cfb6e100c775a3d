use crate::light::ChosenLight;
use crate::view::ChosenView;
use umbrage_scene::Scene;

/// Receives the progress of a job, on any thread. By default each method does nothing, and `()`
/// ignores everything.
///
/// A job has parts of equal weight, and only one part unless [`parts`](Self::parts) says otherwise.
/// Each part has rows: rows of rays, or rows of pixels to measure.
pub trait Progress: Sync {
    /// The job has this many parts.
    fn parts(&self, _count: u64) {}

    /// A part of this name begins.
    fn part(&self, _name: &str) {}

    /// This many rows have to be done in this part.
    fn rows(&self, _rows: u64) {}

    /// A stage of this name begins, such as `ray-traced truth`.
    fn stage(&self, _name: &str) {}

    /// This many more rows are done.
    fn advance(&self, _rows: u64) {}

    /// The part is done.
    fn end_part(&self) {}

    /// The view and the light of a part were chosen.
    fn chosen(&self, _view: &ChosenView, _light: &ChosenLight) {}

    /// The scene of this name was read. It may have notices for the user.
    fn scene(&self, _name: &str, _scene: &Scene) {}

    /// A view of a sweep failed with this error.
    fn failed(&self, _view: &str, _error: &str) {}

    /// The backend was opened. The text says what renders.
    fn backend(&self, _choice: &str) {}

    /// A line of information for the user.
    fn note(&self, _line: &str) {}

    /// A line of warning: something may not be what the user meant.
    fn warn(&self, _line: &str) {}
}

impl Progress for () {}
