//! `umbrage render` renders one picture, or several of the same frame.

use crate::args::{self, Aov, PictureArgs, PictureKind};
use crate::output::{note, six_digits};
use crate::progress::Bar;
use crate::setup::{
    Chosen, announce, choose, open_changed, tell_chosen, tell_detail, tell_notices,
};
use anyhow::{Context, Result, ensure};
use umbrage::{Plan, Size};
use umbrage_lab::{
    Certainty, Detail, Executors, Motion, MovingView, NOTHING_TO_SHADOW, Progress, Receivers,
    RenderScene, Rows, SeenPage, Shadowed, Shape, Texels, check_file, fit_pages, noise, plan,
    plan_fading,
};
use umbrage_measure::{
    ErrorScale, Image, Rgb, cluster_map, difference_map, error_map, grey, noise_map, page_map,
    partition_map, texel_map, with_legend, with_level_legend, write_exr, write_png,
};
use umbrage_trace::{AreaLight, View, shade};

/// All data from which pictures can be made. Fields that no requested picture needs may stay empty.
#[derive(Default)]
struct Data {
    counted: Vec<bool>,
    truth: Shadowed,
    technique: Shadowed,
    texels: Texels,
    shape: Shape,
    noise: Vec<f32>,
    /// Number and level of detail of the cluster in the middle of each pixel.
    clusters: Vec<Option<[u32; 2]>>,
    certainty: Certainty,
}

/// Which data the pictures need.
#[derive(Clone, Copy)]
struct Needs {
    truth: bool,
    maps: bool,
    motion: bool,
    clusters: bool,
}

/// Number of frames of the motion that measures minification.
const FRAMES: u32 = 8;

/// Renders the pictures, and writes each to its file.
pub(crate) fn run(args: &args::Render, quiet: bool) -> Result<()> {
    let pictures = args.pictures()?;
    pictures.iter().try_for_each(|p| check_file(&p.path))?;
    let bar = Bar::of_parts(quiet);
    let scene = open_changed(args.scene.name(), &args.scene.changes, &bar)?;
    let Chosen { view: chosen, lights } =
        choose(&args.view, &[args.light.options()], Some(&scene), &bar)?;
    let light = lights[0].light;
    bar.stage("preparing the scene");
    let backend = args.execution.backend.into();
    let executors = Executors::open(backend, std::slice::from_ref(&args.shadows))?;
    let detail = Detail::new(&scene, &executors, &args.detail(), &bar)?;
    let render_scene = RenderScene::new(&scene, &executors, args.scene.changes.opaque, &detail)?;
    let needs = Needs::of(&pictures);
    ensure!(
        !needs.clusters || render_scene.on_gpu().is_some_and(|(_, scene)| scene.has_clusters()),
        "--aov: only a GPU with compute shaders and room for them draws clusters; here renders {}",
        executors.choice()
    );
    let tracer = render_scene.tracer();
    let view = View::new(tracer, chosen.camera, light, args.samples).context("--samples")?;
    if let Some(size) = args.light_size {
        AreaLight::new(&view, size).context("--light-size")?;
    }
    let receivers = Receivers::new(&scene, tracer, args.fit.into());
    let seen = render_scene.seen(&receivers, &chosen.camera)?;
    let bounds = receivers.bounds(seen.as_ref());
    bar.stage("planning");
    // A picture to look at hides where shadows end; data tell what the maps give.
    let plan = match &pictures[..] {
        [PictureArgs { aov: Aov::Color, .. }] => plan_fading,
        _ => plan,
    };
    let mut plan = plan(&args.shadows, &chosen.camera, &light, &bounds)?;
    fit_pages(&mut plan, tracer);
    if needs.motion {
        Motion::Away.check(FRAMES, &chosen, light)?;
    }
    bar.aside(|| {
        tell_notices(&scene);
        tell_detail(&render_scene);
        tell_chosen(&chosen, &lights);
        announce(&executors);
    });
    if let Size::MaxError(pixels) = args.shadows.technique().size
        && needs.maps
    {
        bar.note(&format!("texels: {} for at most {pixels} px a texel", plan.texels()));
    }
    let technique = args.shadows.technique();
    let map_rows = if needs.maps { render_scene.rows(&plan, technique) } else { 0 };
    let height = u64::from(chosen.camera.image()[1]);
    bar.one_part(map_rows + height * needs.passes());
    let mut data = Data::trace(args, needs, &render_scene, &view, &plan, &bar)?;
    if let Some(size) = args.light_size {
        let Certainty { pixels, rays, standard_error } = data.certainty;
        bar.note(&format!(
            "truth: a light of {size}, standard error at most {standard_error:.4} by {:.0} shadow \
             rays a pixel",
            rays as f64 / pixels as f64
        ));
    }
    if let Some(paging) = plan.paging.as_ref().filter(|_| needs.maps) {
        let limit = six_digits(paging.bound());
        bar.note(&format!("texels: at most {limit} px wide across the light"));
    }
    if needs.motion {
        let (scene, receivers, chosen_view) = (&render_scene, &receivers, &chosen);
        let moving = MovingView { scene, receivers, chosen_view, light, samples: 1 };
        let techniques = std::slice::from_ref(&args.shadows);
        let noise = noise(Motion::Away, FRAMES, &moving, techniques, &bar)?.swap_remove(0);
        data.noise = noise.pixels;
        if let Some(mean) = noise.mean {
            bar.note(&format!("noise: {mean:.4} (mean change of a pixel's error between frames)"));
        }
    }
    drop(bar);
    if (needs.maps || needs.truth) && !data.counted.contains(&true) {
        log::warn!("{NOTHING_TO_SHADOW}");
    }
    for picture in &pictures {
        match picture.kind {
            PictureKind::Png => data.write_png(picture, &view, &plan)?,
            PictureKind::Exr => data.write_exr(picture, chosen.camera.image())?,
        }
        note(&format!("wrote: {}", picture.path.display()));
    }
    Ok(())
}

impl Needs {
    fn of(pictures: &[PictureArgs]) -> Self {
        let any = |is_so: fn(Aov) -> bool| pictures.iter().any(|p| is_so(p.aov));
        Self {
            truth: any(Aov::shows_truth),
            maps: any(|aov| !matches!(aov, Aov::Truth | Aov::Depth | Aov::Normal)),
            motion: any(|aov| aov == Aov::Minification),
            clusters: any(|aov| aov == Aov::Clusters),
        }
    }

    /// Number of passes over all rows of the picture, for the progress bar.
    fn passes(self) -> u64 {
        let moving = if self.motion { u64::from(FRAMES) } else { 0 };
        1 + u64::from(self.truth) + u64::from(self.maps) + moving
    }
}

impl Data {
    /// Renders all data that the pictures need, except the noise of a motion.
    fn trace<'a>(
        args: &args::Render,
        needs: Needs,
        scene: &'a RenderScene<'_>,
        view: &View<'_>,
        plan: &'a Plan,
        bar: &Bar,
    ) -> Result<Self> {
        let advance = |rows| bar.advance(rows);
        let mut executor = scene.executor(args.shadows.technique(), plan.fade.is_some())?;
        if needs.maps {
            bar.stage("shadow map");
            executor.render(plan, &advance)?;
        }
        bar.stage("picture");
        let mut data = Self::default();
        for range in view.bands() {
            let rows = Rows::new(view, range, &advance);
            let truth = match args.light_size.filter(|_| needs.truth) {
                Some(size) => {
                    let (strip, certainty) = rows.area_truth(size)?;
                    data.certainty.add(certainty);
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
            data.counted.extend(shape.counted());
            if let Some(truth) = &truth {
                data.truth.push(truth);
            }
            if let Some(strip) = &strip {
                data.technique.push(strip);
                data.texels.push(strip);
            }
            data.shape.push(strip.as_ref().unwrap_or(shape));
            if needs.clusters {
                let clusters = executor.clusters(&rows)?.into_iter();
                data.clusters.extend(clusters.map(|seen| seen.map(|c| [c.number, c.level])));
            }
        }
        Ok(data)
    }

    /// Writes a picture as a PNG, in colours.
    fn write_png(&self, picture: &PictureArgs, view: &View<'_>, plan: &Plan) -> Result<()> {
        let path = &picture.path;
        let size = view.camera().image();
        let counted = Image::new(size, self.counted.clone())?;
        let rgb = |pixels: Vec<Rgb>| Image::new(size, pixels);
        let gray = |pixels: Vec<f32>| Image::new(size, pixels).map(|i| i.map(|&v| grey(v)));
        let colors = match picture.aov {
            Aov::Visibility => {
                return Ok(write_png(path, &gray(self.technique.visibility.clone())?)?);
            }
            Aov::Truth => return Ok(write_png(path, &gray(self.truth.visibility.clone())?)?),
            Aov::Color => rgb(self.technique.color.clone())?,
            Aov::Difference => difference_map(
                &Image::new(size, self.truth.visibility.clone())?,
                &Image::new(size, self.technique.visibility.clone())?,
                &counted,
                &rgb(self.truth.color.clone())?,
            )?,
            Aov::Error => {
                let scale = ErrorScale::default();
                let map = error_map(
                    &Image::new(size, self.texels.error.clone())?,
                    &counted,
                    &rgb(self.technique.color.clone())?,
                    scale,
                )?;
                with_legend(map, scale)
            }
            Aov::Texels => texel_map(
                &Image::new(size, self.texels.texel.clone())?,
                &rgb(self.technique.color.clone())?,
            )?,
            Aov::Partition => partition_map(
                &Image::new(size, self.texels.tints(plan))?,
                &rgb(self.technique.color.clone())?,
            )?,
            Aov::Pages => {
                let pages = self.texels.tints(plan).into_iter().zip(self.texels.pages());
                let shown = pages.map(|(tint, page)| tint.zip(page));
                page_map(&Image::new(size, shown.collect())?, &rgb(self.technique.color.clone())?)?
            }
            Aov::Clusters => with_level_legend(cluster_map(
                &Image::new(size, self.clusters.clone())?,
                &rgb(self.technique.color.clone())?,
            )?),
            Aov::Minification => noise_map(
                &Image::new(size, self.noise.clone())?,
                &rgb(self.technique.color.clone())?,
            )?,
            Aov::Depth => {
                let color = |&d: &f32| shade::depth_color(view.camera(), f64::from(d));
                rgb(self.shape.depth.iter().map(color).collect())?
            }
            Aov::Normal => {
                let color = |n: &glam::Vec3| shade::normal_color(n.as_dvec3());
                rgb(self.shape.normal.iter().map(color).collect())?
            }
        };
        Ok(write_png(path, &colors)?)
    }

    /// Writes a picture as an EXR, in numbers.
    fn write_exr(&self, picture: &PictureArgs, size: [u32; 2]) -> Result<()> {
        let path = &picture.path;
        let plane = |values: Vec<f32>| Ok(write_exr(path, &Image::new(size, values)?)?);
        let color = |values: Vec<[f32; 3]>| Ok(write_exr(path, &Image::new(size, values)?)?);
        match picture.aov {
            Aov::Color => color(self.shape.radiance.clone()),
            Aov::Normal => color(self.shape.normal.iter().map(glam::Vec3::to_array).collect()),
            Aov::Texels => color(self.texels.texel.iter().map(|&[s, t]| [s, t, 0.0]).collect()),
            Aov::Pages => {
                let values = |page: &Option<SeenPage>| {
                    page.map_or([-1.0; 3], |SeenPage { map, place: [i, j] }| {
                        [f32::from(map), i as f32, j as f32]
                    })
                };
                color(self.texels.pages().iter().map(values).collect())
            }
            Aov::Clusters => {
                let values = |seen: &Option<[u32; 2]>| {
                    seen.map_or([-1.0; 3], |[number, level]| [level as f32, number as f32, 0.0])
                };
                color(self.clusters.iter().map(values).collect())
            }
            Aov::Visibility => plane(self.technique.visibility.clone()),
            Aov::Truth => plane(self.truth.visibility.clone()),
            Aov::Difference => {
                let pairs = self.technique.visibility.iter().zip(&self.truth.visibility);
                let differences = pairs.zip(&self.counted);
                plane(
                    differences
                        .map(|((v, t), &counted)| if counted { v - t } else { 0.0 })
                        .collect(),
                )
            }
            Aov::Error => plane(self.texels.error.clone()),
            Aov::Minification => plane(self.noise.clone()),
            Aov::Depth => plane(self.shape.depth.clone()),
            Aov::Partition => {
                plane(self.texels.map.iter().map(|m| m.map_or(-1.0, f32::from)).collect())
            }
        }
    }
}
