//! `umbrage render`: one picture.

use crate::args::{self, Aov, PictureKind};
use crate::execute::{Execution, Sets};
use crate::motion::{Motion, Scenery, noise};
use crate::output::{check_file, note};
use crate::pixels::{self, NOTHING_TO_SHADOW, Rows, Shadowed, Shape, Texels};
use crate::progress::Progress;
use crate::setup::{Onlooker, Receivers, lamp, onlooker, open_scene, tell_notices};
use anyhow::{Context, Result};
use umbrage::Size;
use umbrage_measure::{
    ErrorScale, Image, Rgb, difference_map, error_map, grey, noise_map, partition_map, texel_map,
    write_exr, write_png,
};
use umbrage_trace::{View, shade};

/// Everything that pictures are made of; what the picture asked for does not need stays empty.
#[derive(Default)]
struct Layers {
    counted: Vec<bool>,
    truth: Shadowed,
    technique: Shadowed,
    texels: Texels,
    shape: Shape,
    noise: Vec<f32>,
}

/// Frames of the motion that shows minification.
const FRAMES: u32 = 8;

/// Renders, and writes the picture.
pub(crate) fn run(args: &args::Render, quiet: bool) -> Result<()> {
    let kind = args.picture_kind()?;
    check_file(&args.output)?;
    let scene = open_scene(&args.scene.name)?;
    let Onlooker { camera, look, .. } = onlooker(&args.view, Some(&scene))?;
    let light = lamp(&args.light, Some(&scene))?.light;
    let execution = Execution::open(&args.execution, std::slice::from_ref(&args.shadows))?;
    let sets = Sets::new(&scene, &execution, args.scene.opaque)?;
    let view = View::new(&sets.tracer, camera, light, args.samples).context("--samples")?;
    let receivers = Receivers::new(&scene, &sets.tracer, args.fit);
    let (plan, _) = pixels::plan(&args.shadows, &camera, &light, &receivers.bounds())?;

    let needs_truth = matches!(args.aov, Aov::Truth | Aov::Difference);
    let needs_map = !matches!(args.aov, Aov::Truth | Aov::Depth | Aov::Normal);
    let height = u64::from(camera.image()[1]);
    let map_rows = if needs_map { sets.rows(&plan, &args.shadows) } else { 0 };
    let moves = args.aov == Aov::Minification;
    if moves {
        Motion::Away.check(FRAMES, look, light)?;
    }
    let moving = if moves { u64::from(FRAMES) } else { 0 };
    let passes = 1 + u64::from(needs_truth) + u64::from(needs_map) + moving;
    tell_notices(&scene);
    execution.announce();
    if let Size::MaxError(pixels) = args.shadows.technique().size
        && needs_map
    {
        note(&format!("texels: {} for at most {pixels} px a texel", plan.texels()));
    }
    let progress = Progress::new(map_rows + height * passes, quiet);
    let advance = |rows| progress.advance(rows);

    let mut executor = sets.executor(&args.shadows)?;
    if needs_map {
        progress.stage("shadow map");
        executor.render(&plan, &advance)?;
    }
    progress.stage("picture");
    let mut layers = Layers::default();
    for range in view.bands() {
        let rows = Rows::new(&view, range, &advance);
        let truth = needs_truth.then(|| rows.truth());
        let strip = if needs_map { Some(executor.strip(&rows)?) } else { None };
        let shape = match (&truth, &strip) {
            (Some(truth), _) => truth,
            (_, Some(strip)) => strip,
            _ => &executor.shape(&rows)?,
        };
        layers.counted.extend(shape.counted());
        if let Some(truth) = &truth {
            layers.truth.push(truth);
        }
        if let Some(strip) = &strip {
            layers.technique.push(strip);
            layers.texels.push(strip);
        }
        layers.shape.push(strip.as_ref().unwrap_or(shape));
    }
    if moves {
        let bounds = &receivers.bounds();
        let scenery = Scenery { sets: &sets, bounds, look, light, samples: 1 };
        let technique = std::slice::from_ref(&args.shadows);
        let noise = noise(Motion::Away, FRAMES, &scenery, technique, &progress)?.swap_remove(0);
        layers.noise = noise.pixels;
        if let Some(mean) = noise.mean {
            note(&format!("noise: {mean:.4} (mean change of a pixel's error between frames)"));
        }
    }
    drop(progress);
    if (needs_map || needs_truth) && !layers.counted.contains(&true) {
        log::warn!("{NOTHING_TO_SHADOW}");
    }
    match kind {
        PictureKind::Png => layers.write_png(args, &view),
        PictureKind::Exr => layers.write_exr(args, camera.image()),
    }
}

impl Layers {
    fn write_png(self, args: &args::Render, view: &View<'_>) -> Result<()> {
        let path = &args.output;
        let size = view.camera().image();
        let counted = Image::new(size, self.counted)?;
        let rgb = |pixels: Vec<Rgb>| Image::new(size, pixels);
        let gray = |pixels: Vec<f32>| Image::new(size, pixels).map(|i| i.map(|&v| grey(v)));
        let picture = match args.aov {
            Aov::Visibility => return Ok(write_png(path, &gray(self.technique.visibility)?)?),
            Aov::Truth => return Ok(write_png(path, &gray(self.truth.visibility)?)?),
            Aov::Color => rgb(self.technique.color)?,
            Aov::Difference => difference_map(
                &Image::new(size, self.truth.visibility)?,
                &Image::new(size, self.technique.visibility)?,
                &counted,
                &rgb(self.truth.color)?,
            )?,
            Aov::Error => error_map(
                &Image::new(size, self.texels.error)?,
                &counted,
                &rgb(self.technique.color)?,
                ErrorScale::default(),
            )?,
            Aov::Texels => {
                texel_map(&Image::new(size, self.texels.texel)?, &rgb(self.technique.color)?)?
            }
            Aov::Partition => {
                partition_map(&Image::new(size, self.texels.map)?, &rgb(self.technique.color)?)?
            }
            Aov::Minification => {
                noise_map(&Image::new(size, self.noise)?, &rgb(self.technique.color)?)?
            }
            Aov::Depth => {
                let color = |&d: &f32| shade::depth_color(view.camera(), f64::from(d));
                rgb(self.shape.depth.iter().map(color).collect())?
            }
            Aov::Normal => {
                let color = |n: &glam::Vec3| shade::normal_color(n.as_dvec3());
                rgb(self.shape.normal.iter().map(color).collect())?
            }
        };
        Ok(write_png(path, &picture)?)
    }

    fn write_exr(self, args: &args::Render, size: [u32; 2]) -> Result<()> {
        let path = &args.output;
        let plane = |values: Vec<f32>| Ok(write_exr(path, &Image::new(size, values)?)?);
        let color = |values: Vec<[f32; 3]>| Ok(write_exr(path, &Image::new(size, values)?)?);
        match args.aov {
            Aov::Color => color(self.shape.radiance),
            Aov::Normal => color(self.shape.normal.iter().map(glam::Vec3::to_array).collect()),
            Aov::Texels => color(self.texels.texel.iter().map(|&[s, t]| [s, t, 0.0]).collect()),
            Aov::Visibility => plane(self.technique.visibility),
            Aov::Truth => plane(self.truth.visibility),
            Aov::Difference => {
                let pairs = self.technique.visibility.iter().zip(&self.truth.visibility);
                let differences = pairs.zip(&self.counted);
                plane(
                    differences
                        .map(|((v, t), &counted)| if counted { v - t } else { 0.0 })
                        .collect(),
                )
            }
            Aov::Error => plane(self.texels.error),
            Aov::Minification => plane(self.noise),
            Aov::Depth => plane(self.shape.depth),
            Aov::Partition => {
                plane(self.texels.map.iter().map(|m| m.map_or(-1.0, f32::from)).collect())
            }
        }
    }
}
