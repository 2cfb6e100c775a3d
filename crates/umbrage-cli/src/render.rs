//! `umbrage render` renders one picture.

use crate::args::{self, Aov, PictureKind};
use crate::output::note;
use crate::progress::Bar;
use crate::setup::{announce, open_scene, tell_notices};
use anyhow::{Context, Result};
use umbrage::{Plan, Size};
use umbrage_lab::{
    Certainty, Executors, Motion, MovingView, NOTHING_TO_SHADOW, Progress, Receivers, RenderScene,
    Rows, Shadowed, Shape, Texels, check_file, choose_light, choose_view, noise, plan,
};
use umbrage_measure::{
    ErrorScale, Image, Rgb, difference_map, error_map, grey, noise_map, partition_map, texel_map,
    with_legend, write_exr, write_png,
};
use umbrage_trace::{View, shade};

/// All data from which a picture can be made. Fields that the requested picture does not need may
/// stay empty.
#[derive(Default)]
struct Picture {
    counted: Vec<bool>,
    truth: Shadowed,
    technique: Shadowed,
    texels: Texels,
    shape: Shape,
    noise: Vec<f32>,
    certainty: Certainty,
}

/// Which data a picture needs.
#[derive(Clone, Copy)]
struct Needs {
    truth: bool,
    maps: bool,
    motion: bool,
}

/// Number of frames of the motion that measures minification.
const FRAMES: u32 = 8;

/// Renders the picture, and writes it to a file.
pub(crate) fn run(args: &args::Render, quiet: bool) -> Result<()> {
    let kind = args.picture_kind()?;
    check_file(&args.output)?;
    let scene = open_scene(&args.scene.name)?;
    let chosen = choose_view(&args.view.options(), Some(&scene))?;
    let light = choose_light(&args.light.options(), Some(&scene))?.light;
    let backend = args.execution.backend.into();
    let executors = Executors::open(backend, std::slice::from_ref(&args.shadows))?;
    let render_scene = RenderScene::new(&scene, &executors, args.scene.opaque)?;
    let tracer = render_scene.tracer();
    let view = View::new(tracer, chosen.camera, light, args.samples).context("--samples")?;
    let receivers = Receivers::new(&scene, tracer, args.fit.into());
    let seen = render_scene.seen(&receivers, &chosen.camera)?;
    let bounds = receivers.bounds(seen.as_ref());
    let plan = plan(&args.shadows, &chosen.camera, &light, &bounds)?;
    let needs = Needs::of(args.aov);
    if needs.motion {
        Motion::Away.check(FRAMES, chosen.look_at, light)?;
    }
    tell_notices(&scene);
    announce(&executors);
    if let Size::MaxError(pixels) = args.shadows.technique().size
        && needs.maps
    {
        note(&format!("texels: {} for at most {pixels} px a texel", plan.texels()));
    }
    let technique = args.shadows.technique();
    let map_rows = if needs.maps { render_scene.rows(&plan, technique) } else { 0 };
    let height = u64::from(chosen.camera.image()[1]);
    let bar = Bar::new(map_rows + height * needs.passes(), quiet);
    let mut picture = Picture::trace(args, needs, &render_scene, &view, &plan, &bar)?;
    if let Some(size) = args.light_size {
        let Certainty { pixels, rays, standard_error } = picture.certainty;
        note(&format!(
            "truth: a light of {size}, standard error at most {standard_error:.4} by {:.0} shadow \
             rays a pixel",
            rays as f64 / pixels as f64
        ));
    }
    if needs.motion {
        let (scene, receivers, look_at) = (&render_scene, &receivers, chosen.look_at);
        let moving = MovingView { scene, receivers, look_at, light, samples: 1 };
        let techniques = std::slice::from_ref(&args.shadows);
        let noise = noise(Motion::Away, FRAMES, &moving, techniques, &bar)?.swap_remove(0);
        picture.noise = noise.pixels;
        if let Some(mean) = noise.mean {
            note(&format!("noise: {mean:.4} (mean change of a pixel's error between frames)"));
        }
    }
    drop(bar);
    if (needs.maps || needs.truth) && !picture.counted.contains(&true) {
        log::warn!("{NOTHING_TO_SHADOW}");
    }
    match kind {
        PictureKind::Png => picture.write_png(args, &view),
        PictureKind::Exr => picture.write_exr(args, chosen.camera.image()),
    }
}

impl Needs {
    fn of(aov: Aov) -> Self {
        Self {
            truth: aov.shows_truth(),
            maps: !matches!(aov, Aov::Truth | Aov::Depth | Aov::Normal),
            motion: aov == Aov::Minification,
        }
    }

    /// Number of passes over all rows of the picture, for the progress bar.
    fn passes(self) -> u64 {
        let moving = if self.motion { u64::from(FRAMES) } else { 0 };
        1 + u64::from(self.truth) + u64::from(self.maps) + moving
    }
}

impl Picture {
    /// Renders all data that the picture needs, except the noise of a motion.
    fn trace<'a>(
        args: &args::Render,
        needs: Needs,
        scene: &'a RenderScene<'_>,
        view: &View<'_>,
        plan: &'a Plan,
        bar: &Bar,
    ) -> Result<Self> {
        let advance = |rows| bar.advance(rows);
        let mut executor = scene.executor(args.shadows.technique())?;
        if needs.maps {
            bar.stage("shadow map");
            executor.render(plan, &advance)?;
        }
        bar.stage("picture");
        let mut picture = Self::default();
        for range in view.bands() {
            let rows = Rows::new(view, range, &advance);
            let truth = match args.light_size.filter(|_| needs.truth) {
                Some(size) => {
                    let (strip, certainty) = rows.area_truth(size)?;
                    picture.certainty.add(certainty);
                    Some(strip)
                }
                None => needs.truth.then(|| rows.truth()),
            };
            let strip = if needs.maps { Some(executor.strip(&rows)?) } else { None };
            let shape = match (&truth, &strip) {
                (Some(truth), _) => truth,
                (_, Some(strip)) => strip,
                _ => &executor.shape(&rows)?,
            };
            picture.counted.extend(shape.counted());
            if let Some(truth) = &truth {
                picture.truth.push(truth);
            }
            if let Some(strip) = &strip {
                picture.technique.push(strip);
                picture.texels.push(strip);
            }
            picture.shape.push(strip.as_ref().unwrap_or(shape));
        }
        Ok(picture)
    }

    /// Writes the requested picture as a PNG, in colours.
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
            Aov::Error => {
                let scale = ErrorScale::default();
                let map = error_map(
                    &Image::new(size, self.texels.error)?,
                    &counted,
                    &rgb(self.technique.color)?,
                    scale,
                )?;
                with_legend(map, scale)
            }
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

    /// Writes the requested picture as an EXR, in numbers.
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
