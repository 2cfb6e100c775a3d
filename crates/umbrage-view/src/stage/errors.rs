//! How wrong a picture is, counted over those pixels whose truth is known.

use super::truth::TruthPicture;
use umbrage_measure::Tally;

/// How much light a technique lets through to the pixels of a frame.
#[derive(Clone, Debug)]
pub(crate) struct Visibility {
    /// Number of the frame.
    pub(crate) frame: u64,
    /// Index of the technique among those of the frame.
    pub(crate) technique: usize,
    /// One value for each pixel of the rows that were read so far.
    pub(crate) values: Vec<f32>,
}

/// Compares a technique with the truth where both are known; `None` if they are of different
/// frames.
pub(crate) fn errors(truth: &TruthPicture, technique: &Visibility, is_soft: bool) -> Option<Tally> {
    if truth.frame != technique.frame {
        return None;
    }
    let mut tally = Tally::default();
    let known = truth.visibility(is_soft).iter().zip(&truth.counts).zip(&technique.values);
    for ((&truth, _), &value) in known.filter(|((truth, counts), _)| **counts && !truth.is_nan()) {
        tally.add(truth, value);
    }
    Some(tally)
}
