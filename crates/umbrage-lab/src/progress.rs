use umbrage_scene::Scene;

/// Is told how far a job is, on any thread. All that it does not want to hear it may leave out;
/// `()` hears nothing.
///
/// A job has parts that count alike, one if nobody says otherwise. Each part has rows: of rays, or
/// of pixels to measure.
pub trait Progress: Sync {
    /// The job has so many parts.
    fn parts(&self, _count: u64) {}

    /// A part of this name begins.
    fn part(&self, _name: &str) {}

    /// So many rows are ahead in this part.
    fn rows(&self, _rows: u64) {}

    /// What goes on from now, as in `ray-traced truth`.
    fn stage(&self, _name: &str) {}

    /// So many more rows are done.
    fn advance(&self, _rows: u64) {}

    /// The part is done.
    fn end_part(&self) {}

    /// A scene that was asked for by this name was read; people may want to see its notices.
    fn scene(&self, _name: &str, _scene: &Scene) {}

    /// A view of a sweep failed, and why.
    fn failed(&self, _view: &str, _error: &str) {}

    /// What was taken to render with, as the choice was not the user's.
    fn backend(&self, _choice: &str) {}

    /// Something that people may want to know, a line.
    fn note(&self, _line: &str) {}

    /// Something that may not be what people meant, a line.
    fn warn(&self, _line: &str) {}
}

impl Progress for () {}
