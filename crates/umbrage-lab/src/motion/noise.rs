//! Temporal noise: pixels that sparkle as a scene gets smaller in the picture.

use super::frames::{Frame, Motion, MovingView, executors};
use crate::error::Error;
use crate::progress::Progress;
use crate::technique::NamedTechnique;
use rayon::prelude::*;
use std::ops::Range;
use umbrage_trace::{PixelMemory, Sample, View};

/// Rays along each side of a pixel that determine its true visibility.
const TRUTH_SAMPLES: u32 = 8;

/// The temporal noise of a technique, which shows as sparkling pixels.
#[derive(Clone, Debug)]
pub struct Noise {
    /// Noise of each pixel, the mean over the frames; NaN if it never counts in two successive
    /// frames.
    pub pixels: Vec<f32>,
    /// Mean over all pixels; `None` if none counts in two successive frames.
    pub mean: Option<f64>,
}

/// Measures temporal noise: how much a pixel's error changes from one frame to the next. The error
/// is the difference between the visibility at the pixel's centre and the mean of 64 true ones all
/// over the pixel. A constant error, such as that of a blur, adds no noise. A pixel counts in a
/// frame if it is filled by one surface that faces the light. `progress` is told of as many rows
/// per frame as the picture has.
///
/// # Errors
/// An error if a frame's view or light is invalid, if the planner refuses a technique, or if a GPU
/// fails.
pub fn noise(
    motion: Motion,
    frames: u32,
    moving: &MovingView<'_>,
    techniques: &[NamedTechnique],
    progress: &dyn Progress,
) -> Result<Vec<Noise>, Error> {
    let MovingView { scene, chosen_view, .. } = *moving;
    let all = Frame::all(motion, frames, moving, TRUTH_SAMPLES, techniques)?;
    let mut executors = executors(scene, techniques)?;
    let count = chosen_view.camera.image().map(|n| n as usize).iter().product();
    let mut trails: Vec<Trail> = techniques.iter().map(|_| Trail::new(count)).collect();
    for (i, Frame { view, plans }) in all.iter().enumerate() {
        progress.stage(&format!("noise: frame {} of {}", i + 1, all.len()));
        for (executor, plan) in executors.iter_mut().zip(plans) {
            executor.render(plan, &|_| {})?;
        }
        let centers = View::new(scene.tracer(), *view.camera(), *view.light(), 1)?;
        for rows in centers.bands() {
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

/// The true visibility of a pixel, and the sample at its centre.
struct Ideal {
    index: usize,
    truth: f32,
    sample: Sample,
}

/// Returns the counted pixels of some rows.
fn ideal(
    view: &View<'_>,
    centers: &View<'_>,
    rows: Range<u32>,
    progress: umbrage_trace::Progress<'_>,
) -> Vec<Ideal> {
    let width = view.camera().image()[0];
    let middles = centers.band(rows.clone(), &|_| {});
    let ideal = |row: (u32, &[Option<Sample>])| {
        let (y, middles) = row;
        let mut memory = PixelMemory::default();
        let pixels = (0..width).zip(middles).filter_map(|(x, middle)| {
            let sample = middle.filter(|s| view.counts(s.is_facing, s.depth))?;
            let truth = view.truth_of_filled([x, y], &sample, &mut memory)?;
            Some(Ideal { index: (y * width + x) as usize, truth, sample })
        });
        let pixels: Vec<Ideal> = pixels.collect();
        progress(1);
        pixels
    };
    let rows = rows.into_par_iter().zip(middles.samples().par_chunks(width as usize));
    rows.flat_map_iter(ideal).collect()
}

/// The errors of a technique's pixels in the present and the last frame, and their changes so far.
struct Trail {
    now: Vec<f32>,
    last: Vec<f32>,
    /// Sum and number of the changes, for each pixel.
    sums: Vec<(f32, u32)>,
}

impl Trail {
    fn new(pixels: usize) -> Self {
        let none = vec![f32::NAN; pixels];
        Self { now: none.clone(), last: none, sums: vec![(0.0, 0); pixels] }
    }

    /// Adds the changes since the last frame, and goes on to the next frame.
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
