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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_known_of_both_counts() {
        let truth = TruthPicture {
            frame: 3,
            sharp: vec![0.0, 1.0, f32::NAN, 1.0, 0.0],
            soft: vec![0.5, 1.0, f32::NAN, 1.0, 0.0],
            counts: vec![true, true, true, false, true],
            ..TruthPicture::default()
        };
        // The last pixel's row is not read yet.
        let visibility =
            |frame| Visibility { frame, technique: 0, values: vec![1.0, 1.0, 1.0, 0.0] };
        let sharp = errors(&truth, &visibility(3), false).unwrap();
        assert_eq!((sharp.counted, sharp.false_light), (2, 1));
        assert_eq!(sharp.mean_abs_error(), Some(0.5));
        let soft = errors(&truth, &visibility(3), true).unwrap();
        assert_eq!((soft.counted, soft.wrong_fraction()), (2, Some(0.0)));
        assert_eq!(errors(&truth, &visibility(4), false), None, "another frame");
    }
}
