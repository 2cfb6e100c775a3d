//! Flicker: shadows that change from frame to frame where the truth does not.

use super::frames::{Frame, Motion, MovingView, executors};
use crate::error::Error;
use crate::progress::Progress;
use crate::technique::NamedTechnique;
use umbrage_trace::{Sample, View};

/// Measures how much every technique's shadows change from frame to frame where the truth does not:
/// the mean change of visibility. For hard shadows this is the fraction of points that change.
/// `progress` is told of as many rows per frame as the picture has.
///
/// Each sample is traced back to the frame before. If it was visible there too, its visibility
/// there is computed again, both the true one and that of the technique. So only those changes of a
/// shadow count that occur on a point of a surface, and not what appears, vanishes or moves across
/// the picture. Only points that face the light in both frames are compared; `None` if there are
/// none.
///
/// # Errors
/// An error if a frame's view or light is invalid, if the planner refuses a technique, or if a GPU
/// fails.
pub fn flicker(
    motion: Motion,
    frames: u32,
    moving: &MovingView<'_>,
    techniques: &[NamedTechnique],
    progress: &dyn Progress,
) -> Result<Vec<Option<f64>>, Error> {
    let MovingView { scene, chosen_view, samples, .. } = *moving;
    let frames = Frame::all(motion, frames, moving, samples, techniques)?;
    let mut change = vec![0f64; techniques.len()];
    let mut compared = 0u64;
    let [mut now, mut last] = [executors(scene, techniques)?, executors(scene, techniques)?];
    let mut before: Option<&View<'_>> = None;
    for (i, frame) in frames.iter().enumerate() {
        progress.stage(&format!("motion: frame {} of {}", i + 1, frames.len()));
        for (executor, plan) in now.iter_mut().zip(&frame.plans) {
            executor.render(plan, &|_| {})?;
        }
        let bands = before.into_iter().flat_map(|last| frame.view.bands().map(move |b| (last, b)));
        for (last_view, rows) in bands {
            let band = frame.view.band(rows, &|_| {});
            let steady = band.map(|s| steady(s, &frame.view, last_view), &|_| {});
            let steady: Vec<[Sample; 2]> = steady.into_iter().flatten().collect();
            compared += steady.len() as u64;
            let [is, was] = [0, 1].map(|i| steady.iter().map(|s| &s[i]).collect::<Vec<_>>());
            for ((change, now), last) in change.iter_mut().zip(&mut now).zip(&mut last) {
                let [is, was] = [now.visibility(&is)?, last.visibility(&was)?];
                *change += is.iter().zip(was).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>();
            }
        }
        progress.advance(u64::from(chosen_view.camera.image()[1]));
        before = Some(&frame.view);
        std::mem::swap(&mut now, &mut last);
    }
    Ok(change.iter().map(|sum| (compared > 0).then(|| sum / compared as f64)).collect())
}

/// Returns a sample as it is and as it was in the frame before, if it counts in both frames and its
/// true visibility has not changed.
fn steady(sample: &Sample, view: &View<'_>, last: &View<'_>) -> Option<[Sample; 2]> {
    let was = last.sees(&sample.surface)?;
    let both_count =
        view.counts(sample.is_facing, sample.depth) && last.counts(was.is_facing, was.depth);
    (both_count && view.truth(sample) == last.truth(&was)).then_some([*sample, was])
}
