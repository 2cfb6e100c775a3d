//! Flicker: shadows that change from frame to frame where the truth does not.

use crate::execute::{Executor, Sets};
use crate::pixels;
use crate::progress::Progress;
use crate::spec::Technique;
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use glam::{DQuat, DVec3};
use umbrage::{Bounds, Camera, Light, LookAt, Plan};
use umbrage_trace::{Sample, View};

/// A motion, in steps as small as between the frames of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Motion {
    /// The viewer moves forward, by a hundredth of the distance to the target a frame.
    Dolly,
    /// The viewer circles the target, half a degree a frame.
    Orbit,
    /// The light turns about the vertical, a tenth of a degree a frame.
    Sun,
}

/// What moves, through what.
pub(crate) struct Scenery<'a> {
    pub(crate) sets: &'a Sets<'a>,
    pub(crate) bounds: &'a Bounds<'a>,
    pub(crate) look: LookAt,
    pub(crate) light: Light,
    /// Rays along each side of a pixel.
    pub(crate) samples: u32,
}

impl Motion {
    /// Its name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Dolly => "dolly",
            Self::Orbit => "orbit",
            Self::Sun => "sun",
        }
    }

    /// That all frames of the motion exist.
    pub(crate) fn check(self, frames: u32, look: LookAt, light: Light) -> Result<()> {
        (0..frames).try_for_each(|i| self.frame(look, light, i).map(drop))
    }

    /// View and light of a frame; the first is as told.
    fn frame(self, look: LookAt, light: Light, index: u32) -> Result<(Camera, Light)> {
        let index = f64::from(index);
        let mut frame = (look, light);
        match self {
            Self::Dolly => {
                let step = (look.target - look.eye) * (0.01 * index);
                frame.0.eye += step;
                frame.0.target += step;
            }
            Self::Orbit => {
                let axis = look.up.normalize_or(DVec3::Y);
                let turn = DQuat::from_axis_angle(axis, (0.5 * index).to_radians());
                frame.0.eye = look.target + turn * (look.eye - look.target);
            }
            Self::Sun => {
                let turn = DQuat::from_rotation_y((0.1 * index).to_radians());
                match &mut frame.1 {
                    Light::Directional { direction } => *direction = turn * *direction,
                    Light::Spot(spot) => spot.direction = turn * spot.direction,
                    Light::Point(_) => bail!(
                        "--motion: a point light has no direction to turn: take dolly or orbit"
                    ),
                }
            }
        }
        let camera = Camera::look_at(frame.0).context("--motion")?;
        Ok((camera, frame.1))
    }
}

/// A frame's view, and every technique's plan for it.
struct Frame<'a> {
    view: View<'a>,
    plans: Vec<Plan>,
}

/// How much every technique's shadows change, from frame to frame, where the truth does not: the mean change
/// of visibility, which for hard shadows is the share of points that change.
///
/// What a pixel shows is followed back into the frame before, where it must have been seen as well, and
/// the truth and the technique are asked there again. So only shadows count that change on a point of a
/// surface, and not what appears, vanishes or moves across the picture. Compared are points that face
/// the light in both frames; `None` if there are none.
pub(crate) fn flicker(
    motion: Motion,
    frames: u32,
    scenery: &Scenery<'_>,
    techniques: &[Technique],
    progress: &Progress,
) -> Result<Vec<Option<f64>>> {
    let Scenery { sets, bounds, look, light, samples } = *scenery;
    let frames = (0..frames).map(|i| {
        let (camera, light) = motion.frame(look, light, i)?;
        let view = View::new(&sets.tracer, camera, light, samples).context("--samples")?;
        let plan = |t| pixels::plan(t, &camera, &light, bounds).map(|(plan, _)| plan);
        let plans = techniques.iter().map(plan).collect::<Result<_>>()?;
        Ok(Frame { view, plans })
    });
    let frames: Vec<Frame<'_>> = frames.collect::<Result<_>>()?;
    let mut change = vec![0f64; techniques.len()];
    let mut compared = 0u64;
    let executors = || techniques.iter().map(|t| sets.executor(t)).collect::<Result<Vec<_>>>();
    let [mut now, mut last]: [Vec<Executor<'_>>; 2] = [executors()?, executors()?];
    let mut before: Option<&View<'_>> = None;
    for (i, frame) in frames.iter().enumerate() {
        progress.stage(format!("motion: frame {} of {}", i + 1, frames.len()));
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
        progress.advance(u64::from(look.image[1]));
        before = Some(&frame.view);
        std::mem::swap(&mut now, &mut last);
    }
    Ok(change.iter().map(|sum| (compared > 0).then(|| sum / compared as f64)).collect())
}

/// A sample as it is and as it was in the frame before, if it counts in both and the truth about it has
/// not changed.
fn steady(sample: &Sample, view: &View<'_>, last: &View<'_>) -> Option<[Sample; 2]> {
    let counts = |s: &Sample, view: &View<'_>| s.is_facing && s.depth <= view.camera().far();
    let was = last.sees(&sample.surface)?;
    let both_count = counts(sample, view) && counts(&was, last);
    (both_count && view.truth(sample) == last.truth(&was)).then_some([*sample, was])
}
