//! Comparison of techniques with ray-traced truth in one view, as pictures, figures and a page in a
//! folder.

use crate::casters::{casters, casters_culled};
use crate::error::{About, Error, Field};
use crate::executor::Executor;
use crate::light::{ChosenLight, LightOptions, choose_light};
use crate::motion::{Motion, MovingView, flicker, noise};
use crate::picture::{Shadowed, Texels};
use crate::planning::{self, milliseconds};
use crate::prepared::PreparedScene;
use crate::progress::Progress;
use crate::strip::{Certainty, Rows};
use crate::technique::NamedTechnique;
use crate::view::{ChosenView, ViewOptions, choose_view};
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;
use umbrage::paged::PAGE_AREA;
use umbrage::visibility::LightSize;
use umbrage::{Plan, ShadowMap};
use umbrage_measure::{
    ErrorScale, Image, Measured, Page, Pictures, Report, Rgb, Seen, SeenTruth, Times, Truth,
    TruthKind, measure, measure_error_px, partition_map, texel_map, write_pictures, write_report,
    write_truth_pictures,
};
use umbrage_scene::Scene;
use umbrage_trace::{AreaLight, View};

/// The techniques to compare with the truth, and the number of rays.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparisonOptions {
    /// The techniques, which must all differ.
    pub techniques: Vec<NamedTechnique>,
    /// Rays along each side of a pixel, 1 to 64. Renderers shade at pixel centres only, as with 1.
    pub samples: u32,
    /// Size of the light, for a second truth. The techniques that are
    /// [soft](NamedTechnique::is_soft) are measured against this truth, and all others against that
    /// of a point light. `None`: all are measured against the latter.
    pub light_size: Option<LightSize>,
}

/// A planned comparison of techniques in one view.
pub struct Comparison<'a> {
    prepared: &'a PreparedScene<'a>,
    options: &'a ComparisonOptions,
    chosen_view: ChosenView,
    chosen_light: ChosenLight,
    view: View<'a>,
    /// Plan of each technique, and the time that planning took, milliseconds.
    plans: Vec<(Plan, f64)>,
}

/// A comparison with all pictures rendered. What remains is to measure and write the results.
pub struct Compared<'a> {
    comparison: &'a Comparison<'a>,
    truth: TruthSoFar,
    contenders: Vec<Contender<'a>>,
    motion: Option<umbrage_measure::Motion>,
}

/// A technique in a comparison: its executor with the rendered maps, and its picture so far.
struct Contender<'a> {
    technique: &'a NamedTechnique,
    plan: &'a Plan,
    executor: Executor<'a>,
    flicker: Option<f64>,
    noise: Option<f64>,
    ms: Times,
    shadowed: Shadowed,
    texels: Texels,
    /// Perspective error of each pixel, pixels per texel; NaN where no map serves it.
    perspective: Vec<f32>,
}

/// The ray-traced pictures so far, which are the truth.
#[derive(Default)]
struct TruthSoFar {
    shadowed: Shadowed,
    /// The picture with the shadows of an area light, if there is one.
    area: Option<Shadowed>,
    certainty: Certainty,
    counted: Vec<bool>,
    /// Cosine between surface and light of each pixel.
    cosine: Vec<f32>,
    seconds: f64,
}

/// What every technique's picture is measured by.
struct Yardstick<'a> {
    truth: SeenTruth<'a>,
    /// The kind of the truth, if there are two of them.
    kind: Option<TruthKind>,
    cosine: &'a Image<f32>,
}

/// A finished picture with shadows.
struct Picture {
    color: Image<Rgb>,
    visibility: Image<f32>,
}

impl<'a> Comparison<'a> {
    /// Plans every technique for this view and light.
    ///
    /// # Errors
    /// An error if the scene has no such camera or light, if the view is not one that a camera can
    /// have, if the number of rays is out of range, if the light cannot have the size in the
    /// options, or if the planner refuses a technique.
    pub fn new(
        prepared: &'a PreparedScene<'a>,
        view: &ViewOptions,
        light: &LightOptions,
        options: &'a ComparisonOptions,
    ) -> Result<Self, Error> {
        let chosen_view = choose_view(view, &prepared.defaults)?;
        let chosen_light = choose_light(light, &prepared.defaults)?;
        let (camera, light) = (chosen_view.camera, chosen_light.light);
        let view = View::new(prepared.render.tracer(), camera, light, options.samples)
            .about(Field::Samples)?;
        if let Some(size) = options.light_size {
            AreaLight::new(&view, size).about(Field::LightSize)?;
        }
        let seen = prepared.render.seen(&prepared.receivers, &camera)?;
        let bounds = prepared.receivers.bounds(seen.as_ref());
        let plan = |t| {
            let (mut plan, ms) = planning::timed_plan(t, &camera, &light, &bounds)?;
            planning::fit_pages(&mut plan, prepared.render.tracer());
            Ok((plan, ms))
        };
        let plans = options.techniques.iter().map(plan).collect::<Result<Vec<_>, Error>>()?;
        Ok(Self { prepared, options, chosen_view, chosen_light, view, plans })
    }

    /// Returns the view that was chosen.
    pub fn chosen_view(&self) -> &ChosenView {
        &self.chosen_view
    }

    /// Returns the light that was chosen.
    pub fn chosen_light(&self) -> &ChosenLight {
        &self.chosen_light
    }

    /// Checks that every frame of a motion has a valid view and light.
    ///
    /// # Errors
    /// An error if a frame's view is not one that a camera can have, or if the light cannot turn.
    pub fn check_motion(&self, motion: Motion, frames: u32) -> Result<(), Error> {
        motion.check(frames, &self.chosen_view, self.chosen_light.light)
    }

    fn height(&self) -> u64 {
        u64::from(self.chosen_view.camera.image()[1])
    }

    /// Returns the number of rows of rays and of pixels to measure in the whole comparison.
    pub fn rows(&self) -> u64 {
        let plans = self.plans.iter().zip(&self.options.techniques);
        let rows_of_maps: u64 =
            plans.map(|((plan, _), t)| self.prepared.render.rows(plan, t.technique())).sum();
        // Rows of the picture: its surfaces and the truth or truths, and each technique's lookup
        // and measuring.
        let truths = 1 + u64::from(self.options.light_size.is_some());
        rows_of_maps + self.height() * (1 + truths + 2 * self.plans.len() as u64)
    }

    /// Returns the number of rows that [`Compared::move_on`] adds.
    pub fn rows_of_motion(&self, motion: Motion, frames: u32) -> u64 {
        let passes = if motion == Motion::Away { 2 } else { 1 };
        passes * u64::from(frames) * self.height()
    }

    /// Renders the shadow maps, traces the truth, and renders every technique's picture.
    ///
    /// # Errors
    /// An error if a GPU fails, or if the maps do not fit into memory.
    pub fn trace(&self, progress: &dyn Progress) -> Result<Compared<'_>, Error> {
        let mut contenders = Vec::new();
        for (technique, (plan, ms)) in self.options.techniques.iter().zip(&self.plans) {
            progress.stage(&format!("{technique}: shadow map"));
            let mut executor = self.prepared.render.executor(technique.technique(), false)?;
            let start = Instant::now();
            let filter = executor.render(plan, &|rows| progress.advance(rows))?;
            let depth = milliseconds(start) - filter.unwrap_or(0.0);
            contenders.push(Contender {
                technique,
                plan,
                executor,
                flicker: None,
                noise: None,
                ms: Times { plan: Some(*ms), depth: Some(depth), filter, shade: None },
                shadowed: Shadowed::default(),
                texels: Texels::default(),
                perspective: Vec::new(),
            });
        }
        let truth = trace(&self.view, self.options.light_size, &mut contenders, progress)?;
        Ok(Compared { comparison: self, truth, contenders, motion: None })
    }
}

impl Compared<'_> {
    /// Returns whether any pixel has a shadow that [counts](View::counts).
    pub fn has_shadows(&self) -> bool {
        self.truth.counted.contains(&true)
    }

    /// Measures how much every technique flickers in a motion of this many frames. For
    /// [`Motion::Away`], also measures how much its pixels sparkle.
    ///
    /// # Errors
    /// An error if a frame's view or light is invalid, if the planner refuses a technique, or if a
    /// GPU fails.
    pub fn move_on(
        &mut self,
        motion: Motion,
        frames: u32,
        progress: &dyn Progress,
    ) -> Result<(), Error> {
        let Comparison { prepared, options, chosen_view, chosen_light, .. } = self.comparison;
        let moving = MovingView {
            scene: &prepared.render,
            receivers: &prepared.receivers,
            chosen_view,
            light: chosen_light.light,
            samples: options.samples,
        };
        let flicker = flicker(motion, frames, &moving, &options.techniques, progress)?;
        for (contender, flicker) in self.contenders.iter_mut().zip(flicker) {
            contender.flicker = flicker;
        }
        if motion == Motion::Away {
            let noise = noise(motion, frames, &moving, &options.techniques, progress)?;
            for (contender, noise) in self.contenders.iter_mut().zip(noise) {
                contender.noise = noise.mean;
            }
        }
        self.motion = Some(umbrage_measure::Motion { kind: motion.name().to_owned(), frames });
        Ok(())
    }

    /// Measures the results, and writes `index.html`, `report.json` and the pictures into an empty
    /// `folder`. The page shows `command`, which makes the report again, for readers to copy.
    ///
    /// # Errors
    /// An error if the results cannot be measured or a file cannot be written.
    pub fn write(
        self,
        folder: &Path,
        command: &str,
        progress: &dyn Progress,
    ) -> Result<Report, Error> {
        progress.stage("measuring");
        let Comparison { prepared, options, chosen_view, chosen_light, .. } = self.comparison;
        let size = chosen_view.camera.image();
        let seconds = Some(self.truth.seconds);
        let counted = Image::new(size, self.truth.counted)?;
        let cosine = Image::new(size, self.truth.cosine)?;
        let point = Picture::new(size, self.truth.shadowed)?;
        let area = self.truth.area.map(|shadowed| Picture::new(size, shadowed)).transpose()?;
        let yardstick = |is_soft| {
            let truth = area.as_ref().filter(|_| is_soft).unwrap_or(&point);
            let Picture { color, visibility } = truth;
            let kind = if is_soft { TruthKind::Area } else { TruthKind::Point };
            Yardstick {
                truth: SeenTruth { color, visibility, counted: &counted },
                kind: area.is_some().then_some(kind),
                cosine: &cosine,
            }
        };
        let truth_pictures = write_truth_pictures(folder, &yardstick(true).truth)?;
        let finished = self.contenders.into_par_iter().enumerate().map(|(i, contender)| {
            let device = prepared.executors.device();
            let yardstick = yardstick(contender.technique.is_soft());
            let finished = contender.finish(i + 1, folder, &yardstick, prepared.scene, device);
            progress.advance(self.comparison.height());
            finished
        });
        let (results, pictures): (_, Vec<Pictures>) =
            finished.collect::<Result<Vec<_>, Error>>()?.into_iter().unzip();
        let report = Report {
            scene: prepared.scene.name.clone(),
            size,
            view: chosen_view.info(),
            light: chosen_light.info(),
            truth: Truth {
                rays_per_pixel: options.samples.pow(2),
                seconds,
                area: options.light_size.map(|size| self.truth.certainty.of_light(size)),
            },
            motion: self.motion,
            results,
        };
        write_report(
            folder,
            &Page {
                report: &report,
                truth: &truth_pictures,
                pictures: &pictures,
                scale: ErrorScale::default(),
                notices: &[prepared.notices(), chosen_view.notices.clone()].concat(),
                command: Some(command),
            },
        )?;
        Ok(report)
    }
}

/// Traces the truth and renders every technique's picture, a band of rows at a time. The truth and
/// the CPU reference share the surfaces that the camera's rays hit.
fn trace(
    view: &View<'_>,
    light_size: Option<LightSize>,
    contenders: &mut [Contender<'_>],
    progress: &dyn Progress,
) -> Result<TruthSoFar, Error> {
    let advance = |rows| progress.advance(rows);
    let mut truth = TruthSoFar::default();
    for range in view.bands() {
        progress.stage("ray-traced truth");
        let start = Instant::now();
        let rows = Rows::new(view, range.clone(), &advance);
        let hard = rows.truth();
        if let Some(size) = light_size {
            let (soft, certainty) = rows.area_truth(size)?;
            truth.area.get_or_insert_default().push(&soft);
            truth.certainty.add(certainty);
        }
        truth.seconds += start.elapsed().as_secs_f64();
        truth.counted.extend(hard.counted());
        truth.cosine.extend(rows.cosines(&hard));
        truth.shadowed.push(&hard);
        for contender in contenders.iter_mut() {
            progress.stage(&format!("{}: picture", contender.technique));
            let start = Instant::now();
            let strip = contender.executor.strip(&rows)?;
            *contender.ms.shade.get_or_insert(0.0) += milliseconds(start);
            contender.shadowed.push(&strip);
            contender.texels.push(&strip);
            contender.perspective.extend(rows.perspective_errors(&hard, contender.plan));
        }
    }
    Ok(truth)
}

impl Contender<'_> {
    /// Measures the technique and writes its pictures into `folder`.
    fn finish(
        mut self,
        index: usize,
        folder: &Path,
        yardstick: &Yardstick<'_>,
        scene: &Scene,
        device: Option<String>,
    ) -> Result<(Measured, Pictures), Error> {
        let Yardstick { truth, kind, cosine } = yardstick;
        let size = truth.visibility.size();
        let picture = Picture::new(size, self.shadowed)?;
        let tints = self.texels.tints(self.plan);
        let error_px = Image::new(size, self.texels.error)?;
        let perspective_px = Image::new(size, self.perspective)?;
        let texels = texel_map(&Image::new(size, self.texels.texel)?, &picture.color)?;
        // If a single map serves the whole picture, there is no partition to show.
        let partition = if self.plan.maps.iter().filter(|m| !ShadowMap::is_empty(m)).count() > 1 {
            Some(partition_map(&Image::new(size, tints)?, &picture.color)?)
        } else {
            None
        };
        let shadows = self.technique.to_string();
        let seen = Seen {
            color: &picture.color,
            visibility: &picture.visibility,
            error_px: &error_px,
            partition: partition.as_ref(),
            texels: Some(&texels),
        };
        let pictures =
            write_pictures(folder, index, &shadows, &seen, truth, ErrorScale::default())?;
        let paging = self.plan.paging.as_ref();
        let pages = self.executor.pages().map(|pages| pages as u64);
        let metrics = measure(truth.visibility, &picture.visibility, truth.counted, cosine)?;
        let texels = match paging {
            Some(_) => pages.unwrap_or_default() * PAGE_AREA,
            None => self.plan.texels(),
        };
        let measured = Measured {
            shadows,
            technique: Some(self.technique.technique().to_string()),
            backend: self.executor.name().into(),
            device: device.filter(|_| self.executor.is_gpu()),
            maps: paging.and(pages).unwrap_or(self.plan.maps.len() as u64) as u32,
            texels,
            bytes: Some(self.executor.bytes()),
            truth: *kind,
            pages,
            texels_per_pixel: pages
                .filter(|_| metrics.counted > 0)
                .map(|_| texels as f64 / metrics.counted as f64),
            bound_px: self.executor.bound_px(),
            metrics,
            error_px: measure_error_px(&error_px, truth.counted)?,
            perspective_px: measure_error_px(&perspective_px, truth.counted)?,
            storage_factor: paging.is_none().then(|| self.plan.storage_factor()),
            casters_culled: casters_culled(self.plan, &casters(self.plan, scene)),
            flicker: self.flicker,
            noise: self.noise,
            ms: self.ms,
        };
        Ok((measured, pictures))
    }
}

impl Picture {
    fn new(size: [u32; 2], pixels: Shadowed) -> Result<Self, Error> {
        Ok(Self {
            color: Image::new(size, pixels.color)?,
            visibility: Image::new(size, pixels.visibility)?,
        })
    }
}
