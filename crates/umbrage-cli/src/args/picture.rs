//! `umbrage render`: its options.

use super::technique::{ExecutionArgs, Fit, TexelArgs};
use super::view::{LightArgs, SceneArgs, ViewArgs};
use crate::values;
use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use umbrage::visibility::LightSize;
use umbrage_lab::NamedTechnique;

/// `umbrage render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage render town -o town.png --shadows lispsm:pcf3@2048
  umbrage render model.glb -o error.exr --shadows uniform@512 --aov error \\
      --eye 0,2,5 --target 0,0,0 --sun=-0.5,-1,-0.3")]
pub(crate) struct Render {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Picture to write: .png, or .exr for raw floats.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// How to make shadows, as in lispsm:pcf3@2048 (`umbrage help shadows` has all words).
    #[arg(long, value_name = "SPEC", default_value = "adaptive")]
    pub(crate) shadows: NamedTechnique,
    #[command(flatten)]
    pub(crate) texels: TexelArgs,
    /// What to write.
    #[arg(long, value_enum, default_value_t = Aov::Color)]
    pub(crate) aov: Aov,
    /// Rays along each side of a pixel: K×K samples.
    #[arg(long, value_name = "K", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) samples: u32,
    /// Size of the light in the truth: an angle for a sun, as in 0.53deg, or a length for a lamp, as
    /// in 0.2m. Only for `--aov truth` and `--aov difference`.
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
    /// How much pixels sparkle while the viewer moves away (8 frames of `compare --motion away`),
    /// against supersampled truth. EXR: the mean change of a pixel's error from frame to frame, NaN
    /// where pixels show more than one surface.
    Minification,
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
            self.light_size.is_none() || self.aov.shows_truth(),
            "--light-size: only --aov truth and --aov difference show the truth"
        );
        self.picture_kind().map(drop)
    }

    /// Which kind of file to write, by the output's extension.
    pub(crate) fn picture_kind(&self) -> Result<PictureKind> {
        let extension = self.output.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(PictureKind::Png),
            Some("exr") => Ok(PictureKind::Exr),
            _ => bail!("--output: {} must end in .png or .exr", self.output.display()),
        }
    }
}

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureKind {
    /// 8-bit colours, for looking at.
    Png,
    /// Raw floats.
    Exr,
}
