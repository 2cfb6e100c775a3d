//! One view's comparison: techniques against ray-traced truth, as pictures, figures and a page in a folder.

use crate::args;
use crate::execute::{Execution, Executor, Sets};
use crate::motion::{Motion, Scenery, flicker, noise};
use crate::pixels::{self, Rows, Shadowed, Texels, casters, casters_culled, milliseconds};
use crate::progress::Progress;
use crate::setup::{Lamp, Onlooker, Receivers, lamp, onlooker};
use crate::spec::Spec;
use anyhow::{Context, Result};
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;
use umbrage::{Light, Plan, ShadowMap};
use umbrage_measure::{
    ErrorScale, Image, LightInfo, Measured, Page, Pictures, Report, Rgb, Seen, SeenTruth, Times,
    Truth, measure, measure_error_px, partition_map, texel_map, write_pictures, write_report,
    write_truth_pictures,
};
use umbrage_scene::Scene;
use umbrage_trace::View;

/// A scene, ready for rays of many views.
pub(crate) struct Stage<'a> {
    scene: &'a Scene,
    execution: &'a Execution,
    sets: Sets<'a>,
    receivers: Receivers,
    opaque: bool,
}

/// What to compare in which view, planned.
pub(crate) struct Comparison<'a> {
    stage: &'a Stage<'a>,
    options: &'a args::ComparisonArgs,
    onlooker: Onlooker,
    lamp: Lamp,
    view: View<'a>,
    /// One a technique, and how long planning took, milliseconds.
    plans: Vec<(Plan, f64)>,
}

/// A comparison whose rays are all cast; what is left is to measure and to write.
pub(crate) struct Compared<'a> {
    comparison: &'a Comparison<'a>,
    truth: TruthSoFar,
    contenders: Vec<Contender<'a>>,
    motion: Option<umbrage_measure::Motion>,
}

/// A technique at work: its maps, and the picture so far.
struct Contender<'a> {
    spec: &'a Spec,
    plan: &'a Plan,
    executor: Executor<'a>,
    flicker: Option<f64>,
    noise: Option<f64>,
    ms: Times,
    shadowed: Shadowed,
    texels: Texels,
}

/// The truth's picture so far.
#[derive(Default)]
struct TruthSoFar {
    shadowed: Shadowed,
    counted: Vec<bool>,
    seconds: f64,
}

/// What shadows look like, done.
struct Picture {
    color: Image<Rgb>,
    visibility: Image<f32>,
}

impl<'a> Stage<'a> {
    /// `opaque`: alpha-masked materials cast and show as solid.
    pub(crate) fn new(
        scene: &'a Scene,
        execution: &'a Execution,
        opaque: bool,
        fit: args::Fit,
    ) -> Result<Self> {
        let sets = Sets::new(scene, execution, opaque)?;
        let receivers = Receivers::new(scene, &sets.tracer, fit);
        Ok(Self { scene, execution, sets, receivers, opaque })
    }

    /// What readers of a report should know.
    fn notices(&self) -> Vec<String> {
        let mut notices: Vec<String> = self.scene.notices.iter().map(|n| n.0.clone()).collect();
        if self.opaque {
            notices
                .push("Alpha masks are ignored: masked materials show and cast as solid.".into());
        }
        notices
    }
}

impl<'a> Comparison<'a> {
    /// Plans every technique for this view and light.
    pub(crate) fn new(
        stage: &'a Stage<'a>,
        view: &args::ViewArgs,
        light: &args::LightArgs,
        options: &'a args::ComparisonArgs,
    ) -> Result<Self> {
        let onlooker = onlooker(view, Some(stage.scene))?;
        let lamp = lamp(light, Some(stage.scene))?;
        let view = View::new(&stage.sets.tracer, onlooker.camera, lamp.light, options.samples)
            .context("--samples")?;
        let bounds = stage.receivers.bounds();
        let plan = |t| pixels::plan(t, &onlooker.camera, &lamp.light, &bounds);
        let plans = options.techniques.shadows.iter().map(plan).collect::<Result<Vec<_>>>()?;
        Ok(Self { stage, options, onlooker, lamp, view, plans })
    }

    /// That all frames of a motion exist.
    pub(crate) fn check_motion(&self, motion: Motion, frames: u32) -> Result<()> {
        motion.check(frames, self.onlooker.look, self.lamp.light)
    }

    fn height(&self) -> u64 {
        u64::from(self.onlooker.camera.image()[1])
    }

    /// Rows of rays and of measuring that there are to do.
    pub(crate) fn rows(&self) -> u64 {
        let plans = self.plans.iter().zip(&self.options.techniques.shadows);
        let rows_of_maps: u64 = plans.map(|((plan, _), t)| self.stage.sets.rows(plan, t)).sum();
        // Of the picture: what is seen, the truth; each technique's lookups and measuring.
        rows_of_maps + self.height() * (2 + 2 * self.plans.len() as u64)
    }

    /// Renders the maps, and traces the truth and every technique's picture.
    pub(crate) fn trace(&self, progress: &Progress) -> Result<Compared<'_>> {
        let mut contenders = Vec::new();
        for (spec, (plan, ms)) in self.options.techniques.shadows.iter().zip(&self.plans) {
            progress.stage(format!("{}: shadow map", spec));
            let mut executor = self.stage.sets.executor(spec)?;
            let start = Instant::now();
            let filter = executor.render(plan, &|rows| progress.advance(rows))?;
            let depth = milliseconds(start) - filter.unwrap_or(0.0);
            contenders.push(Contender {
                spec,
                plan,
                executor,
                flicker: None,
                noise: None,
                ms: Times { plan: Some(*ms), depth: Some(depth), filter, shade: None },
                shadowed: Shadowed::default(),
                texels: Texels::default(),
            });
        }
        let truth = trace(&self.view, &mut contenders, progress)?;
        Ok(Compared { comparison: self, truth, contenders, motion: None })
    }
}

impl Compared<'_> {
    /// Whether any pixel [counts](counted).
    pub(crate) fn has_shadows(&self) -> bool {
        self.truth.counted.contains(&true)
    }

    /// Measures how much every technique flickers in a motion, and how much it sparkles on the way away.
    pub(crate) fn move_on(
        &mut self,
        motion: Motion,
        frames: u32,
        progress: &Progress,
    ) -> Result<()> {
        let Comparison { stage, options, onlooker, lamp, .. } = self.comparison;
        let scenery = Scenery {
            sets: &stage.sets,
            bounds: &stage.receivers.bounds(),
            look: onlooker.look,
            light: lamp.light,
            samples: options.samples,
        };
        let flicker = flicker(motion, frames, &scenery, &options.techniques.shadows, progress)?;
        for (contender, flicker) in self.contenders.iter_mut().zip(flicker) {
            contender.flicker = flicker;
        }
        if motion == Motion::Away {
            let noise = noise(motion, frames, &scenery, &options.techniques.shadows, progress)?;
            for (contender, noise) in self.contenders.iter_mut().zip(noise) {
                contender.noise = noise.mean;
            }
        }
        self.motion = Some(umbrage_measure::Motion { kind: motion.name().to_owned(), frames });
        Ok(())
    }

    /// Measures, and writes `index.html`, `report.json` and the pictures into an empty `folder`.
    /// `command` is what makes the report again.
    pub(crate) fn write(self, folder: &Path, command: &str, progress: &Progress) -> Result<Report> {
        progress.stage("measuring");
        let Comparison { stage, options, onlooker, lamp, .. } = self.comparison;
        let size = onlooker.camera.image();
        let seconds = Some(self.truth.seconds);
        let counted = Image::new(size, self.truth.counted)?;
        let truth = Picture::new(size, self.truth.shadowed)?;
        let seen =
            SeenTruth { color: &truth.color, visibility: &truth.visibility, counted: &counted };
        let truth_pictures = write_truth_pictures(folder, &seen)?;
        let finished = self.contenders.into_par_iter().enumerate().map(|(i, contender)| {
            let device = stage.execution.device();
            let finished = contender.finish(i + 1, folder, &seen, stage.scene, device);
            progress.advance(self.comparison.height());
            finished
        });
        let (results, pictures): (_, Vec<Pictures>) =
            finished.collect::<Result<Vec<_>>>()?.into_iter().unzip();
        let report = Report {
            scene: stage.scene.name.clone(),
            size,
            view: view_info(onlooker),
            light: light_info(lamp),
            truth: Truth { rays_per_pixel: options.samples.pow(2), seconds },
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
                notices: &stage.notices(),
                command: Some(command),
            },
        )?;
        Ok(report)
    }
}

/// Traces the truth and looks every technique's maps up, a band of the picture at a time, so that all
/// share what the camera sees.
fn trace(
    view: &View<'_>,
    contenders: &mut [Contender<'_>],
    progress: &Progress,
) -> Result<TruthSoFar> {
    let advance = |rows| progress.advance(rows);
    let mut truth = TruthSoFar::default();
    for range in view.bands() {
        progress.stage("ray-traced truth");
        let start = Instant::now();
        let rows = Rows::new(view, range.clone(), &advance);
        let strip = rows.truth();
        truth.seconds += start.elapsed().as_secs_f64();
        truth.counted.extend(strip.counted());
        truth.shadowed.push(&strip);
        for contender in contenders.iter_mut() {
            progress.stage(format!("{}: picture", contender.spec));
            let start = Instant::now();
            let strip = contender.executor.strip(&rows)?;
            *contender.ms.shade.get_or_insert(0.0) += milliseconds(start);
            contender.shadowed.push(&strip);
            contender.texels.push(&strip);
        }
    }
    Ok(truth)
}

impl Contender<'_> {
    /// Measures the technique and writes its pictures into `folder`.
    fn finish(
        self,
        index: usize,
        folder: &Path,
        truth: &SeenTruth<'_>,
        scene: &Scene,
        device: Option<String>,
    ) -> Result<(Measured, Pictures)> {
        let size = truth.visibility.size();
        let picture = Picture::new(size, self.shadowed)?;
        let error_px = Image::new(size, self.texels.error)?;
        let texels = texel_map(&Image::new(size, self.texels.texel)?, &picture.color)?;
        // Where one map serves all there is nothing to tell apart.
        let partition = if self.plan.maps.iter().filter(|m| !ShadowMap::is_empty(m)).count() > 1 {
            Some(partition_map(&Image::new(size, self.texels.map)?, &picture.color)?)
        } else {
            None
        };
        let shadows = self.spec.to_string();
        let seen = Seen {
            color: &picture.color,
            visibility: &picture.visibility,
            error_px: &error_px,
            partition: partition.as_ref(),
            texels: Some(&texels),
        };
        let pictures =
            write_pictures(folder, index, &shadows, &seen, truth, ErrorScale::default())?;
        let measured = Measured {
            shadows,
            technique: Some(self.spec.technique().to_string()),
            backend: self.executor.name().into(),
            device: device.filter(|_| self.executor.is_gpu()),
            maps: self.plan.maps.len() as u32,
            texels: self.plan.texels(),
            bytes: Some(self.executor.bytes()),
            metrics: measure(truth.visibility, &picture.visibility, truth.counted)?,
            error_px: measure_error_px(&error_px, truth.counted)?,
            storage_factor: Some(self.plan.storage_factor()),
            casters_culled: casters_culled(self.plan, &casters(self.plan, scene)),
            flicker: self.flicker,
            noise: self.noise,
            ms: self.ms,
        };
        Ok((measured, pictures))
    }
}

impl Picture {
    fn new(size: [u32; 2], pixels: Shadowed) -> Result<Self> {
        Ok(Self {
            color: Image::new(size, pixels.color)?,
            visibility: Image::new(size, pixels.visibility)?,
        })
    }
}

pub(crate) fn view_info(onlooker: &Onlooker) -> umbrage_measure::View {
    let look = &onlooker.look;
    umbrage_measure::View {
        name: onlooker.name.clone(),
        eye: look.eye.to_array(),
        target: look.target.to_array(),
        up: look.up.to_array(),
        fov: look.fov_y_rad.to_degrees(),
        near: look.near,
        far: look.far,
    }
}

pub(crate) fn light_info(lamp: &Lamp) -> LightInfo {
    let name = lamp.name.clone();
    match lamp.light {
        Light::Directional { direction } => {
            LightInfo::Directional { name, direction: direction.normalize_or_zero().to_array() }
        }
        Light::Spot(spot) => LightInfo::Spot {
            name,
            position: spot.position.to_array(),
            direction: spot.direction.normalize_or_zero().to_array(),
            half_angle: spot.half_angle_rad.to_degrees(),
            range: spot.range,
        },
        Light::Point(point) => {
            LightInfo::Point { name, position: point.position.to_array(), range: point.range }
        }
    }
}
