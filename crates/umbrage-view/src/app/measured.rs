//! What is measured while the window is used: costs, errors and presets.

use crate::stage::{Costs, Frame, Measurement, SharedTruth, Visibility, errors};
use egui::{Color32, ColorImage, TextureHandle, TextureOptions};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};
use umbrage::visibility::LightSize;
use umbrage::{Camera, Light};
use umbrage_measure::{Image, Rgb, Tally, difference_map};

/// The costs of the last frames.
#[derive(Default)]
pub(super) struct History {
    /// Those of the first technique, the oldest first.
    pub(super) costs: VecDeque<Costs>,
    drawn: VecDeque<Instant>,
}

impl History {
    /// The number of frames that are kept.
    pub(super) const FRAMES: usize = 240;

    pub(super) fn add(&mut self, frame: &Frame) {
        if let Some(Ok(drawn)) = frame.pictures.first().map(|p| &p.drawn) {
            self.costs.push_back(drawn.costs);
        }
        self.drawn.push_back(Instant::now());
        while self.costs.len() > Self::FRAMES {
            self.costs.pop_front();
        }
        while self.drawn.len() > Self::FRAMES {
            self.drawn.pop_front();
        }
    }

    /// Frames per second over the last second; `None` if the view rests.
    pub(super) fn rate(&self) -> Option<f64> {
        let second = Duration::from_secs(1);
        let recent: Vec<&Instant> = self.drawn.iter().filter(|t| t.elapsed() < second).collect();
        let (first, last) = (recent.first()?, recent.last()?);
        let span = last.duration_since(**first).as_secs_f64();
        (recent.len() > 2 && span > 0.0).then(|| (recent.len() - 1) as f64 / span)
    }
}

/// The truth of the frame that is shown, and how wrong its pictures are.
#[derive(Default)]
pub(super) struct Judged {
    pub(super) truth: Option<SharedTruth>,
    visibility: [Option<Visibility>; 2],
    pub(super) tallies: [Option<Tally>; 2],
    /// Whether more is known than was counted.
    pub(super) is_stale: bool,
    /// When it was counted last, and how long counting and composing took then.
    counted_at: Option<Instant>,
    took: Duration,
    /// The truth, and the difference of each technique to it, as egui shows them, with the version
    /// of the truth that they show.
    truth_texture: Option<(TextureHandle, u64)>,
    differences: [Option<(TextureHandle, u64)>; 2],
    /// Grows with each change of what is known.
    version: u64,
}

impl Judged {
    /// Counting and drawing again at most this often keeps the window quick.
    const EVERY: Duration = Duration::from_millis(100);

    pub(super) fn begin(&mut self, truth: SharedTruth) {
        self.truth = Some(truth);
        self.visibility = Default::default();
        self.tallies = Default::default();
        self.version += 1;
        self.is_stale = true;
    }

    /// Takes more rows of a picture.
    pub(super) fn add(&mut self, rows: Visibility) {
        let Some(place) = self.visibility.get_mut(rows.technique) else { return };
        match place {
            Some(known) if known.frame == rows.frame => known.values.extend(rows.values),
            _ => *place = Some(rows),
        }
        self.is_stale = true;
    }

    /// Forgets what is of another frame.
    pub(super) fn frame_changed(&mut self, frame: u64) {
        if self.truth.as_ref().is_some_and(|truth| truth.lock().frame != frame) {
            self.truth = None;
            self.visibility = Default::default();
            self.tallies = Default::default();
            self.version += 1;
        }
    }

    /// Counts wrong pixels as far as they are known. If it is too early for that, gives the time
    /// after which to come again.
    pub(super) fn count(&mut self, frame: &Option<Arc<Frame>>) -> Option<Duration> {
        let (Some(truth), Some(frame)) = (&self.truth, frame) else { return None };
        if !self.is_stale {
            return None;
        }
        // At most a quarter of the window's time goes into this.
        let pause = Self::EVERY.max(self.took * 3);
        if let Some(at) = self.counted_at.filter(|at| at.elapsed() < pause) {
            return Some(pause.saturating_sub(at.elapsed()));
        }
        let start = Instant::now();
        self.is_stale = false;
        self.version += 1;
        let truth = truth.lock();
        for (i, picture) in frame.pictures.iter().enumerate().take(2) {
            // The first rows alone would tell of the upper part of the picture.
            let visibility = self.visibility[i].as_ref();
            let visibility = visibility.filter(|v| v.values.len() == truth.sharp.len());
            self.tallies[i] =
                visibility.and_then(|v| errors(&truth, v, picture.technique.is_soft()));
        }
        self.took = start.elapsed();
        self.counted_at = Some(Instant::now());
        None
    }

    /// Notes what composing a picture of the truth took.
    fn composed(&mut self, start: Instant) {
        self.took += start.elapsed();
        self.counted_at = Some(Instant::now());
    }

    /// Why there is no truth, and the shares of it that are known and exact.
    pub(super) fn state(&self) -> Option<(Option<String>, [f32; 2])> {
        let truth = self.truth.as_ref()?.lock();
        let exact = if truth.soft.is_empty() { 1.0 } else { truth.exact };
        Some((truth.problem.clone(), [truth.share, exact]))
    }

    /// The distance along the view of what a pixel shows, metres, as far as it is known.
    pub(super) fn depth(&self, x: u32, y: u32) -> Option<f64> {
        let truth = self.truth.as_ref()?.lock();
        let [width, height] = truth.size;
        let known = (x < width && y < height).then(|| truth.known(x, y)).flatten()?;
        Some(f64::from(truth.depth[known])).filter(|depth| depth.is_finite())
    }

    /// Whether the truth of a frame is traced and all that is known is counted.
    pub(super) fn is_done(&self, frame: &Frame) -> bool {
        let Some(truth) = &self.truth else { return false };
        let truth = truth.lock();
        let is_read = |i: usize| {
            let values = self.visibility[i].as_ref().map_or(0, |v| v.values.len());
            frame.pictures[i].drawn.is_err() || values == truth.sharp.len()
        };
        truth.is_done() && !self.is_stale && (0..frame.pictures.len().min(2)).all(is_read)
    }

    /// The truth as a texture.
    pub(super) fn truth_texture(&mut self, context: &egui::Context) -> Option<TextureHandle> {
        let truth = self.truth.as_ref()?.lock();
        if truth.step == 0 {
            return None;
        }
        let is_new =
            self.truth_texture.as_ref().is_none_or(|(_, version)| *version != self.version);
        if is_new {
            let start = Instant::now();
            let [width, height] = truth.size;
            let colors = pixels(width, height)
                .map(|(x, y)| truth.known(x, y).map_or(Color32::BLACK, |i| color(truth.color[i])));
            let image = ColorImage::new([width as usize, height as usize], colors.collect());
            let version = self.version;
            drop(truth);
            set(&mut self.truth_texture, context, "truth", image, version);
            self.composed(start);
        }
        self.truth_texture.as_ref().map(|(texture, _)| texture.clone())
    }

    /// The difference of a technique to the truth as a texture.
    pub(super) fn difference(
        &mut self,
        context: &egui::Context,
        technique: usize,
        is_soft: bool,
    ) -> Option<TextureHandle> {
        let truth = self.truth.as_ref()?.lock();
        let visibility = self.visibility.get(technique)?.as_ref()?;
        if truth.step == 0 || visibility.frame != truth.frame {
            return None;
        }
        let place = &mut self.differences[technique];
        if place.as_ref().is_none_or(|(_, version)| *version != self.version) {
            let start = Instant::now();
            let [width, height] = truth.size;
            let of_truth = truth.visibility(is_soft);
            let known: Vec<Option<usize>> =
                pixels(width, height).map(|(x, y)| truth.known(x, y)).collect();
            let counts = |i: usize| truth.counts[i] && i < visibility.values.len();
            let all = |value: &dyn Fn(usize) -> f32| {
                let values = known.iter().map(|i| i.filter(|&i| counts(i)).map_or(0.0, value));
                Image::new(truth.size, values.collect())
            };
            let counted = known.iter().map(|i| i.is_some_and(counts)).collect();
            let picture = known.iter().map(|i| i.map_or([0; 3], |i| truth.color[i])).collect();
            let map = difference_map(
                &all(&|i| of_truth[i]).ok()?,
                &all(&|i| visibility.values[i]).ok()?,
                &Image::new(truth.size, counted).ok()?,
                &Image::new(truth.size, picture).ok()?,
            )
            .ok()?;
            let colors = map.pixels().iter().map(|&rgb| color(rgb)).collect();
            let image = ColorImage::new([width as usize, height as usize], colors);
            set(place, context, "difference", image, self.version);
            drop(truth);
            self.composed(start);
        }
        self.differences[technique].as_ref().map(|(texture, _)| texture.clone())
    }
}

/// The coordinates of a picture's pixels, row by row.
fn pixels(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

fn color([r, g, b]: Rgb) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// Gives a texture new contents.
fn set(
    place: &mut Option<(TextureHandle, u64)>,
    context: &egui::Context,
    name: &str,
    image: ColorImage,
    version: u64,
) {
    match place {
        Some((texture, shown)) => {
            texture.set(image, TextureOptions::LINEAR);
            *shown = version;
        }
        None => *place = Some((context.load_texture(name, image, TextureOptions::LINEAR), version)),
    }
}

/// What the presets are worth in the view that they were measured in.
#[derive(Default)]
pub(super) struct Presets {
    pub(super) measured: Vec<Measurement>,
    /// The view and the light that they were measured in.
    pub(super) view: Option<(Camera, Light, Option<LightSize>)>,
}

impl Presets {
    pub(super) fn add(&mut self, measurement: Measurement) {
        self.measured.retain(|known| known.shadows != measurement.shadows);
        self.measured.push(measurement);
    }

    /// What is known of the technique of this text.
    pub(super) fn of(&self, shadows: &str) -> Option<&Measurement> {
        self.measured.iter().find(|known| known.shadows == shadows)
    }
}
