//! `umbrage render`: its options.

use super::session::SessionSceneArgs;
use super::technique::{BackendArg, ExecutionArgs, Fit, TexelArgs};
use super::view::{LightArgs, ViewArgs};
use crate::values;
use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use umbrage::visibility::LightSize;
use umbrage_lab::{DetailOptions, NamedTechnique};

/// `umbrage render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage render town -o town.png --shadows lispsm:pcf3@2048
  umbrage render town -o town.png --aov color,visibility,truth
  umbrage render model.glb -o error.exr --shadows uniform@512 --aov error \\
      --eye 0,2,5 --target 0,0,0 --sun=-0.5,-1,-0.3")]
pub(crate) struct Render {
    #[command(flatten)]
    pub(crate) scene: SessionSceneArgs,
    /// Picture to write: .png, or .exr for raw floats. Of several --aov, each has its name added:
    /// town-truth.png. Left out: a new PNG named after the scene.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// How to make shadows, as in lispsm:pcf3@2048 (`umbrage help shadows` has all words).
    #[arg(long, value_name = "SPEC", default_value = "adaptive")]
    pub(crate) shadows: NamedTechnique,
    #[command(flatten)]
    pub(crate) texels: TexelArgs,
    /// What to write, one picture or more of the same frame.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "color")]
    aov: Vec<Aov>,
    /// Rays along each side of a pixel: K×K samples.
    #[arg(long, value_name = "K", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) samples: u32,
    /// Size of the light in the truth: an angle for a sun, as in 0.53deg, or a length for a lamp,
    /// as in 0.2m. Only for `--aov truth` and `--aov difference`.
    #[arg(long, value_name = "SIZE", value_parser = values::light_size, allow_hyphen_values = true)]
    pub(crate) light_size: Option<LightSize>,
    /// What the map is fitted to.
    #[arg(long, value_enum, default_value_t = Fit::Surfaces)]
    pub(crate) fit: Fit,
    #[command(flatten)]
    pub(crate) execution: ExecutionArgs,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
}

/// What a rendered picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Aov {
    /// The shaded scene.
    Color,
    /// What the shadow map says: 255 lit, 0 in shadow.
    Visibility,
    /// What ray tracing says: 255 lit, 0 in shadow.
    Truth,
    /// Where the shadow map is lighter or darker than the truth. EXR: visibility minus truth.
    Difference,
    /// Pixels per texel on the surface, in the worst direction.
    Error,
    /// Distance along the view. PNG: by its logarithm, the nearest white. EXR: metres.
    Depth,
    /// World-space surface normal. PNG: −1 … 1 as 0 … 255.
    Normal,
    /// The shadow map's texels as they lie on the surfaces. EXR: texel coordinates s and t.
    Texels,
    /// Which map of the plan serves each pixel. EXR: its index, −1 for none.
    Partition,
    /// The pages of a paged map, tinted by their level, with dark borders. EXR: the index of the
    /// level's window in the plan, and the page's place in the window; −1 for none.
    Pages,
    /// How much pixels sparkle while the viewer moves away (8 frames of `compare --motion away`),
    /// against supersampled truth. EXR: the mean change of a pixel's error from frame to frame, NaN
    /// where pixels show more than one surface.
    Minification,
    /// The clusters of triangles that a GPU draws frames of, tinted by their level of detail.
    /// Scenes of any size are then drawn as clusters. EXR: level and number of the cluster, −1 in
    /// the sky.
    Clusters,
}

impl Aov {
    /// Whether the picture shows what ray tracing says.
    pub(crate) fn shows_truth(self) -> bool {
        matches!(self, Self::Truth | Self::Difference)
    }
}

impl Render {
    pub(super) fn check(&mut self) -> Result<()> {
        self.texels.apply(std::slice::from_mut(&mut self.shadows))?;
        self.view.options().check()?;
        self.light.options().check()?;
        ensure!(
            self.light_size.is_none() || self.aov.iter().any(|aov| aov.shows_truth()),
            "--light-size: only --aov truth and --aov difference show the truth"
        );
        ensure!(
            !self.aov.contains(&Aov::Pages) || self.shadows.technique().paged_error().is_some(),
            "--aov: `{}` has no pages to show; take --shadows paged",
            self.shadows
        );
        if self.shows_clusters() {
            ensure!(
                !self.execution.full_detail,
                "--full-detail: leave it out for --aov clusters, which shows levels of detail"
            );
            ensure!(
                self.execution.backend != BackendArg::Reference,
                "--backend: --aov clusters shows what a GPU draws; take gpu"
            );
        }
        for (i, aov) in self.aov.iter().enumerate() {
            ensure!(!self.aov[..i].contains(aov), "--aov: `{}` is given twice", aov.word());
        }
        self.pictures().map(drop)
    }

    /// Takes what is not asked for from the session, if there is one.
    pub(super) fn take_session(&mut self) -> Result<()> {
        let Some(session) = self.scene.take_session(&mut self.view, &mut self.light)? else {
            return Ok(());
        };
        let told = self.scene.session.told;
        if !told.shadows
            && let Some(shown) = session.techniques.into_iter().next()
        {
            self.shadows = shown;
        }
        if !told.fit {
            self.fit = session.fit.into();
        }
        if self.aov.iter().any(|aov| aov.shows_truth()) {
            self.light_size = self.light_size.or(session.light_size);
        }
        self.check()
    }

    fn shows_clusters(&self) -> bool {
        self.aov.contains(&Aov::Clusters)
    }

    /// How much detail a GPU draws: levels of it in any scene whose clusters are to be shown.
    pub(crate) fn detail(&self) -> DetailOptions {
        match self.execution.detail() {
            DetailOptions::Auto if self.shows_clusters() => DetailOptions::Levels,
            detail => detail,
        }
    }

    /// The pictures to write, each with a file of its own.
    pub(crate) fn pictures(&self) -> Result<Vec<PictureArgs>> {
        let Some(output) = &self.output else { return Ok(self.new_pictures()) };
        let extension = output.extension().map(|e| e.to_string_lossy().to_lowercase());
        let kind = match extension.as_deref() {
            Some("png") => PictureKind::Png,
            Some("exr") => PictureKind::Exr,
            _ => bail!("--output: {} must end in .png or .exr", output.display()),
        };
        let path = |aov: Aov| match self.aov.len() {
            1 => output.clone(),
            _ => {
                let mut name = output.file_stem().unwrap_or_default().to_owned();
                name.push(format!("-{}.", aov.word()));
                name.push(output.extension().unwrap_or_default());
                output.with_file_name(name)
            }
        };
        Ok(self.aov.iter().map(|&aov| PictureArgs { aov, kind, path: path(aov) }).collect())
    }

    /// PNGs that are named after the scene, none of which is there yet.
    fn new_pictures(&self) -> Vec<PictureArgs> {
        let name = self.scene.name().split(':').next().unwrap_or_default();
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let numbered = (1..).map(|n| match n {
            1 => stem.clone(),
            n => format!("{stem}-{n}"),
        });
        let named = numbered.map(|stem| {
            let path = |aov: Aov| match self.aov[..] {
                [Aov::Color] => PathBuf::from(format!("{stem}.png")),
                _ => PathBuf::from(format!("{stem}-{}.png", aov.word())),
            };
            let pictures = self.aov.iter();
            pictures
                .map(|&aov| PictureArgs { aov, kind: PictureKind::Png, path: path(aov) })
                .collect::<Vec<_>>()
        });
        let is_new = |pictures: &Vec<PictureArgs>| {
            pictures.iter().all(|p| p.path.symlink_metadata().is_err())
        };
        named.into_iter().find(is_new).unwrap_or_default()
    }
}

impl Aov {
    /// The word for it on the command line.
    fn word(self) -> String {
        self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
    }
}

/// A picture to write.
#[derive(Clone, Debug)]
pub(crate) struct PictureArgs {
    pub(crate) aov: Aov,
    pub(crate) kind: PictureKind,
    pub(crate) path: PathBuf,
}

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureKind {
    /// 8-bit colours, for looking at.
    Png,
    /// Raw floats.
    Exr,
}
