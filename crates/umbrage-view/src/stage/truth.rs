//! Ray-traced truth that refines while the view rests.

use super::mailbox::{Mail, Mailbox};
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use umbrage::visibility::LightSize;
use umbrage::{Camera, Light};
use umbrage_measure::Rgb;
use umbrage_scene::Scene;
use umbrage_trace::{AreaLight, Sample, Tracer, View, shade};

/// The truth that is wanted.
#[derive(Clone, Debug)]
pub(super) struct TruthJob {
    pub(super) camera: Camera,
    pub(super) light: Light,
    pub(super) light_size: Option<LightSize>,
    /// The scene in the pose of an animation; `None`: the scene at rest.
    pub(super) posed: Option<Arc<Scene>>,
    pub(super) picture: SharedTruth,
}

/// The truth as it grows, shared between the threads that trace and show it.
#[derive(Clone, Debug, Default)]
pub(crate) struct SharedTruth(Arc<Mutex<TruthPicture>>);

impl SharedTruth {
    pub(crate) fn new(frame: u64, camera: &Camera) -> Self {
        Self(Arc::new(Mutex::new(TruthPicture::new(frame, camera.image()))))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, TruthPicture> {
        // Pixels are complete one by one, so nothing is half done after a panic.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A picture with ray-traced shadows, of which some pixels are known.
#[derive(Clone, Debug, Default)]
pub(crate) struct TruthPicture {
    /// Number of the frame whose view and light it shows.
    pub(crate) frame: u64,
    /// Width and height, pixels.
    pub(crate) size: [u32; 2],
    /// Visibility of the light as a point: 0 or 1, and NaN where it is not known yet.
    pub(crate) sharp: Vec<f32>,
    /// Visibility of the light with its size; empty if it has none.
    pub(crate) soft: Vec<f32>,
    /// Distance along the view, metres; infinite in the sky.
    pub(crate) depth: Vec<f32>,
    /// Whether the shadow on a pixel counts.
    pub(crate) counts: Vec<bool>,
    /// The shaded picture, with soft shadows if the light has a size.
    pub(crate) color: Vec<Rgb>,
    /// Every pixel whose coordinates are multiples of this is known, or none if it is 0.
    pub(crate) step: u32,
    /// The share of the pixels that are known.
    pub(crate) share: f32,
    /// The share of the rows in which `soft` is as exact as it will be. Before, it is known by few
    /// rays.
    pub(crate) exact: f32,
    /// Why there is no truth.
    pub(crate) problem: Option<String>,
    /// Seconds that tracing took.
    pub(crate) seconds: f64,
    /// Grows with each change.
    pub(crate) version: u64,
}

impl TruthPicture {
    fn new(frame: u64, size: [u32; 2]) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        Self {
            frame,
            size,
            sharp: vec![f32::NAN; pixels],
            depth: vec![f32::INFINITY; pixels],
            counts: vec![false; pixels],
            color: vec![[0; 3]; pixels],
            ..Self::default()
        }
    }

    /// Whether all pixels are known, or none will be.
    pub(crate) fn is_done(&self) -> bool {
        self.step == 1 && (self.soft.is_empty() || self.exact == 1.0) || self.problem.is_some()
    }

    /// The pixel that stands for a pixel: itself, or as long as it is not known the nearest one to
    /// the left and above that is. `None` if nothing is known.
    pub(crate) fn known(&self, x: u32, y: u32) -> Option<usize> {
        let index = |x: u32, y: u32| (y * self.size[0] + x) as usize;
        let own = index(x, y);
        if !self.sharp[own].is_nan() {
            return Some(own);
        }
        (self.step > 0).then(|| index(x - x % self.step, y - y % self.step))
    }

    /// The visibility that techniques are measured by: soft ones by the light with its size.
    pub(crate) fn visibility(&self, of_soft: bool) -> &[f32] {
        if of_soft && !self.soft.is_empty() { &self.soft } else { &self.sharp }
    }
}

/// The distances between the pixels of the levels, of which each contains those before.
const STEPS: [u32; 4] = [8, 4, 2, 1];

/// About how many rays are cast before others may see what they found, or another job may begin.
const CHUNK: u32 = 1 << 13;

/// About how many rays a pixel takes with a light that has a size, at a glance and exactly.
const AREA_RAYS: [u32; 2] = [64, 1024];

/// Traces the jobs that come, until there are none any more. A job ends early if another one comes,
/// or if the number of the newest frame is no longer that of its own. `grew` is called whenever
/// more is known.
pub(super) fn trace_jobs(
    tracer: &Tracer<'_>,
    jobs: &Mailbox<TruthJob>,
    newest_frame: &AtomicU64,
    grew: impl Fn(),
) {
    loop {
        match jobs.take(None) {
            Mail::New(job) => {
                let frame = job.picture.lock().frame;
                let is_out_of_date =
                    || jobs.is_pending() || newest_frame.load(Ordering::Relaxed) != frame;
                if let Err(problem) = trace_posed(tracer, &job, &is_out_of_date, &grew) {
                    let mut picture = job.picture.lock();
                    picture.problem = Some(problem);
                    picture.version += 1;
                }
                grew();
            }
            Mail::None => {}
            Mail::Closed => return,
        }
    }
}

/// Traces one job in its pose, as long as it is not out of date.
fn trace_posed(
    at_rest: &Tracer<'_>,
    job: &TruthJob,
    is_out_of_date: &dyn Fn() -> bool,
    grew: &dyn Fn(),
) -> Result<(), String> {
    match &job.posed {
        None => trace(at_rest, job, is_out_of_date, grew),
        Some(scene) => {
            let tracer = Tracer::new(scene).map_err(|e| e.to_string())?;
            trace(&tracer.opaque(at_rest.is_opaque()), job, is_out_of_date, grew)
        }
    }
}

/// Traces one job, as long as it is not out of date.
pub(super) fn trace(
    tracer: &Tracer<'_>,
    job: &TruthJob,
    is_out_of_date: &dyn Fn() -> bool,
    grew: &dyn Fn(),
) -> Result<(), String> {
    let start = Instant::now();
    let view = View::new(tracer, job.camera, job.light, 1).map_err(|e| e.to_string())?;
    let area = job.light_size.map(|size| AreaLight::new(&view, size));
    let area = area.transpose().map_err(|e| e.to_string())?;
    let [width, height] = job.camera.image();
    if area.is_some() {
        job.picture.lock().soft = vec![f32::NAN; (width * height) as usize];
    }
    let mut known = 0;
    for step in STEPS {
        let rows: Vec<u32> = (0..height).step_by(step as usize).collect();
        let rays = if area.is_some() { AREA_RAYS[0] } else { 1 };
        for rows in rows.chunks((CHUNK * step / (width * rays)).max(1) as usize) {
            if is_out_of_date() {
                return Ok(());
            }
            let trace_row = |&y: &u32| {
                let row =
                    level(width, y, step).map(|x| (x, Pixel::trace(&view, area.as_ref(), x, y)));
                (y, row.collect::<Vec<_>>())
            };
            let traced: Vec<_> = rows.par_iter().map(trace_row).collect();
            let mut picture = job.picture.lock();
            for (y, row) in traced {
                known += row.len();
                for (x, pixel) in row {
                    picture.set((y * width + x) as usize, &pixel);
                }
            }
            picture.share = known as f32 / (width * height) as f32;
            picture.seconds = start.elapsed().as_secs_f64();
            picture.version += 1;
            drop(picture);
            grew();
        }
        job.picture.lock().step = step;
    }
    if let Some(area) = &area
        && !refine(&view, area, job, is_out_of_date, grew)
    {
        return Ok(());
    }
    let mut picture = job.picture.lock();
    picture.seconds = start.elapsed().as_secs_f64();
    picture.version += 1;
    Ok(())
}

/// Makes the penumbrae of a picture exact, which take most of the rays. Gives whether all are.
fn refine(
    view: &View<'_>,
    area: &AreaLight<'_, '_>,
    job: &TruthJob,
    is_out_of_date: &dyn Fn() -> bool,
    grew: &dyn Fn(),
) -> bool {
    let [width, height] = job.camera.image();
    let at_a_time = (CHUNK * STEPS[0] / (width * AREA_RAYS[1])).max(1);
    for first in (0..height).step_by(at_a_time as usize) {
        if is_out_of_date() {
            return false;
        }
        let rows = first..height.min(first + at_a_time);
        let index = |x: u32, y: u32| (y * width + x) as usize;
        let pixels: Vec<(u32, u32)> = {
            let picture = job.picture.lock();
            let is_penumbra = |&(x, y): &(u32, u32)| {
                let soft = picture.soft[index(x, y)];
                soft > 0.0 && soft < 1.0
            };
            rows.clone().flat_map(|y| (0..width).map(move |x| (x, y))).filter(is_penumbra).collect()
        };
        let exact = |&(x, y): &(u32, u32)| {
            let sample = view.sample(DVec2::new(f64::from(x), f64::from(y)) + 0.5)?;
            let visibility = area.visibility(&sample).visibility;
            let color = displayed(shade::radiance(view.light(), &sample, visibility));
            Some((index(x, y), visibility, color))
        };
        let found: Vec<_> = pixels.par_iter().filter_map(exact).collect();
        let mut picture = job.picture.lock();
        for (index, visibility, color) in found {
            picture.soft[index] = visibility;
            picture.color[index] = color;
        }
        picture.exact = rows.end as f32 / height as f32;
        picture.version += 1;
        drop(picture);
        grew();
    }
    true
}

/// The pixels of a row that belong to a level and to none before it.
fn level(width: u32, y: u32, step: u32) -> impl Iterator<Item = u32> {
    let is_first = step == STEPS[0];
    let Range { start, end } = 0..width;
    (start..end)
        .step_by(step as usize)
        .filter(move |x| is_first || !x.is_multiple_of(2 * step) || !y.is_multiple_of(2 * step))
}

/// What rays find at the centre of a pixel.
struct Pixel {
    sharp: f32,
    soft: Option<f32>,
    depth: f32,
    counts: bool,
    color: Rgb,
}

impl Pixel {
    fn trace(view: &View<'_>, area: Option<&AreaLight<'_, '_>>, x: u32, y: u32) -> Self {
        let center = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
        let Some(sample) = view.sample(center) else {
            let sky = shade::sky(view.light(), view.camera(), center);
            let soft = area.map(|_| 1.0);
            let depth = f32::INFINITY;
            return Self { sharp: 1.0, soft, depth, counts: false, color: displayed(sky) };
        };
        let sharp = view.truth(&sample);
        let soft = area.map(|area| area.glance(&sample).visibility);
        let Sample { is_facing, depth, .. } = sample;
        let radiance = shade::radiance(view.light(), &sample, soft.unwrap_or(sharp));
        let counts = view.counts(is_facing, depth);
        Self { sharp, soft, depth: depth as f32, counts, color: displayed(radiance) }
    }
}

fn displayed(radiance: glam::Vec3) -> Rgb {
    shade::pixels(&[radiance], 1)[0]
}

impl TruthPicture {
    fn set(&mut self, index: usize, pixel: &Pixel) {
        self.sharp[index] = pixel.sharp;
        if let Some(soft) = pixel.soft {
            self.soft[index] = soft;
        }
        self.depth[index] = pixel.depth;
        self.counts[index] = pixel.counts;
        self.color[index] = pixel.color;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use umbrage::LookAt;

    fn job(image: [u32; 2], light_size: Option<LightSize>) -> TruthJob {
        let camera = Camera::look_at(LookAt {
            eye: DVec3::new(-2.5, 3.4, 7.5),
            target: DVec3::Y,
            up: DVec3::Y,
            fov_y_rad: 1.0,
            near: 0.1,
            far: 100.0,
            image,
        })
        .unwrap();
        let light = Light::Directional { direction: DVec3::new(0.3, -1.0, 0.5) };
        TruthJob { camera, light, light_size, posed: None, picture: SharedTruth::new(7, &camera) }
    }

    #[test]
    fn every_pixel_belongs_to_one_level() {
        for [width, height] in [[1, 1], [8, 8], [19, 13]] {
            let mut seen = vec![0; (width * height) as usize];
            for step in STEPS {
                for y in (0..height).step_by(step as usize) {
                    level(width, y, step).for_each(|x| seen[(y * width + x) as usize] += 1);
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{width}x{height}: {seen:?}");
        }
    }

    #[test]
    fn the_finished_picture_is_the_truth() {
        let scene = umbrage_scene::builtin("pole", None).unwrap();
        let tracer = Tracer::new(&scene).unwrap();
        let job = job([41, 30], Some(LightSize::Degrees(5.0)));
        let grown = std::cell::Cell::new(0);
        trace(&tracer, &job, &|| false, &|| grown.set(grown.get() + 1)).unwrap();
        assert!(grown.get() >= STEPS.len());
        let picture = job.picture.lock();
        assert!(picture.is_done() && picture.share == 1.0 && picture.frame == 7);
        let view = View::new(&tracer, job.camera, job.light, 1).unwrap();
        let band = view.band(0..30, &|_| {});
        let truth = band.map(|s| view.truth(s), &|_| {});
        let mut shadowed = 0;
        for (i, sample) in band.samples().iter().enumerate() {
            let Some(sample) = sample else {
                assert!(!picture.counts[i] && picture.sharp[i] == 1.0);
                continue;
            };
            assert_eq!(picture.sharp[i], truth[i]);
            assert_eq!(picture.counts[i], view.counts(sample.is_facing, sample.depth));
            shadowed += u32::from(picture.counts[i] && picture.sharp[i] == 0.0);
        }
        assert!(shadowed > 0, "{shadowed} pixels in shadow");
        let area = AreaLight::new(&view, LightSize::Degrees(5.0)).unwrap();
        let soft = band.map(|s| area.visibility(s).visibility, &|_| {});
        let penumbra: Vec<usize> =
            (0..soft.len()).filter(|&i| picture.soft[i] > 0.0 && picture.soft[i] < 1.0).collect();
        assert!(penumbra.len() > 3, "{} pixels of a penumbra", penumbra.len());
        assert!(penumbra.iter().all(|&i| picture.soft[i] == soft[i]), "exact in the end");
    }

    #[test]
    fn a_job_that_is_out_of_date_stops() {
        let scene = umbrage_scene::builtin("pole", None).unwrap();
        let tracer = Tracer::new(&scene).unwrap();
        let job = job([640, 360], None);
        let looks = std::cell::Cell::new(0);
        let is_out_of_date = || {
            looks.set(looks.get() + 1);
            looks.get() > 1
        };
        trace(&tracer, &job, &is_out_of_date, &|| {}).unwrap();
        let picture = job.picture.lock();
        assert!(!picture.is_done() && picture.step == STEPS[0]);
        assert!((picture.share - 1.0 / 64.0).abs() < 1e-3, "{}", picture.share);
        // As long as a pixel is not known, another one stands for it.
        assert_eq!(picture.known(9, 15), picture.known(8, 8));
        assert_eq!(picture.known(8, 8), Some(8 * 640 + 8));
    }

    #[test]
    fn a_light_that_cannot_have_its_size_is_a_problem() {
        let scene = umbrage_scene::builtin("pole", None).unwrap();
        let tracer = Tracer::new(&scene).unwrap();
        let job = job([8, 8], Some(LightSize::Metres(1.0)));
        assert!(trace(&tracer, &job, &|| false, &|| {}).unwrap_err().contains("sun"));
    }
}
