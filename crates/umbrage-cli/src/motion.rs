//! What a motion shows: shadows that change from frame to frame where the truth does not, and pixels that sparkle as a scene gets smaller.

use crate::execute::{Executor, Sets};
use crate::pixels;
use crate::progress::Progress;
use crate::spec::Spec;
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use glam::{DQuat, DVec3};
use std::ops::Range;
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
    /// The viewer moves away from the target, by a two-hundredth of the distance a frame, so that more and more texels fall into a pixel.
    Away,
}

/// Rays along each side of a pixel that tell what it ought to show.
const TRUTH_SAMPLES: u32 = 8;

/// Cosine of the angle up to which surfaces count as one.
const SAME_PLANE: f64 = 0.99;

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
            Self::Away => "away",
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
            Self::Away => frame.0.eye += (look.eye - look.target) * (0.005 * index),
            Self::Sun => {
                let turn = DQuat::from_rotation_y((0.1 * index).to_radians());
                match &mut frame.1 {
                    Light::Directional { direction } => *direction = turn * *direction,
                    Light::Spot(spot) => spot.direction = turn * spot.direction,
                    Light::Point(_) => bail!(
                        "--motion: a point light has no direction to turn: take dolly, orbit or away"
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

impl<'a> Frame<'a> {
    /// All frames of a motion.
    fn all(
        motion: Motion,
        frames: u32,
        scenery: &Scenery<'a>,
        samples: u32,
        techniques: &[Spec],
    ) -> Result<Vec<Self>> {
        let Scenery { sets, bounds, look, light, .. } = *scenery;
        let frame = |i| {
            let (camera, light) = motion.frame(look, light, i)?;
            let view = View::new(&sets.tracer, camera, light, samples).context("--samples")?;
            let plan = |t| pixels::plan(t, &camera, &light, bounds).map(|(plan, _)| plan);
            let plans = techniques.iter().map(plan).collect::<Result<_>>()?;
            Ok(Self { view, plans })
        };
        (0..frames).map(frame).collect()
    }
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
    techniques: &[Spec],
    progress: &Progress,
) -> Result<Vec<Option<f64>>> {
    let Scenery { sets, look, samples, .. } = *scenery;
    let frames = Frame::all(motion, frames, scenery, samples, techniques)?;
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

/// How much a technique's pixels sparkle.
pub(crate) struct Noise {
    /// Of each pixel, the mean over the frames; NaN where it never counts twice in a row.
    pub(crate) pixels: Vec<f32>,
    /// Over all pixels; `None` if none counts.
    pub(crate) mean: Option<f64>,
}

/// Temporal noise: how much a pixel's error changes from one frame to the next, its visibility at its centre being compared with the mean of 64 true ones all
/// over it. What is wrong but steady, as a blur is, does not count. A pixel counts where surfaces that face the light fill it in both frames.
pub(crate) fn noise(
    motion: Motion,
    frames: u32,
    scenery: &Scenery<'_>,
    techniques: &[Spec],
    progress: &Progress,
) -> Result<Vec<Noise>> {
    let Scenery { sets, look, .. } = *scenery;
    let all = Frame::all(motion, frames, scenery, TRUTH_SAMPLES, techniques)?;
    let executors = techniques.iter().map(|t| sets.executor(t));
    let mut executors: Vec<Executor<'_>> = executors.collect::<Result<_>>()?;
    let count = look.image.map(|n| n as usize).iter().product();
    let mut trails: Vec<Trail> = techniques.iter().map(|_| Trail::new(count)).collect();
    for (i, Frame { view, plans }) in all.iter().enumerate() {
        progress.stage(format!("noise: frame {} of {}", i + 1, all.len()));
        for (executor, plan) in executors.iter_mut().zip(plans) {
            executor.render(plan, &|_| {})?;
        }
        let centers = View::new(&sets.tracer, *view.camera(), *view.light(), 1)?;
        for rows in view.bands() {
            let ideal = ideal(view, &centers, rows, &|n| progress.advance(n));
            let samples: Vec<&Sample> = ideal.iter().map(|pixel| &pixel.sample).collect();
            for (executor, trail) in executors.iter_mut().zip(&mut trails) {
                let visibility = executor.visibility(&samples)?;
                for (pixel, visibility) in ideal.iter().zip(visibility) {
                    trail.now[pixel.index] = visibility - pixel.truth;
                }
            }
        }
        trails.iter_mut().for_each(Trail::step);
    }
    Ok(trails.into_iter().map(Trail::noise).collect())
}

/// What a pixel ought to show, and what is at its centre.
struct Ideal {
    index: usize,
    truth: f32,
    sample: Sample,
}

/// The pixels of some rows that count.
fn ideal(
    view: &View<'_>,
    centers: &View<'_>,
    rows: Range<u32>,
    progress: umbrage_trace::Progress<'_>,
) -> Vec<Ideal> {
    let counts =
        |s: &Option<Sample>| s.as_ref().filter(|s| view.counts(s.is_facing, s.depth)).copied();
    let first = rows.start as usize * view.camera().image()[0] as usize;
    let band = view.band(rows.clone(), progress);
    let truth = band.map(|s| view.truth(s), &|_| {});
    let n = band.samples_per_pixel();
    let pixels = band.samples().chunks(n).zip(truth.chunks(n));
    let middles = centers.band(rows, &|_| {});
    pixels
        .zip(middles.samples())
        .enumerate()
        .filter_map(|(i, ((samples, truth), middle))| {
            let sample = counts(middle)?;
            let plane = |s: Sample| s.surface.geometric_normal;
            let is_full = samples
                .iter()
                .all(|s| counts(s).is_some_and(|s| plane(s).dot(plane(sample)) > SAME_PLANE));
            if !is_full {
                return None;
            }
            let truth = truth.iter().sum::<f32>() / n as f32;
            Some(Ideal { index: first + i, truth, sample })
        })
        .collect()
}

/// A technique's errors on the way.
struct Trail {
    now: Vec<f32>,
    last: Vec<f32>,
    /// Sum of the changes, and how many.
    sums: Vec<(f32, u32)>,
}

impl Trail {
    fn new(pixels: usize) -> Self {
        let none = vec![f32::NAN; pixels];
        Self { now: none.clone(), last: none, sums: vec![(0.0, 0); pixels] }
    }

    /// Goes on to the next frame.
    fn step(&mut self) {
        for ((now, last), sum) in self.now.iter_mut().zip(&mut self.last).zip(&mut self.sums) {
            let change = (*now - *last).abs();
            if !change.is_nan() {
                *sum = (sum.0 + change, sum.1 + 1);
            }
            *last = std::mem::replace(now, f32::NAN);
        }
    }

    fn noise(self) -> Noise {
        let (sum, n) = self.sums.iter().fold((0.0, 0u64), |(sum, n), &(change, count)| {
            (sum + f64::from(change), n + u64::from(count))
        });
        Noise {
            pixels: self.sums.iter().map(|&(sum, n)| sum / n as f32).collect(),
            mean: (n > 0).then(|| sum / n as f64),
        }
    }
}

/// A sample as it is and as it was in the frame before, if it counts in both and the truth about it has
/// not changed.
fn steady(sample: &Sample, view: &View<'_>, last: &View<'_>) -> Option<[Sample; 2]> {
    let was = last.sees(&sample.surface)?;
    let both_count =
        view.counts(sample.is_facing, sample.depth) && last.counts(was.is_facing, was.depth);
    (both_count && view.truth(sample) == last.truth(&was)).then_some([*sample, was])
}
