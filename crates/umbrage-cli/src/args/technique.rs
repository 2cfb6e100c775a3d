//! Techniques and what renders them: options that many commands share.

use crate::values;
use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use umbrage::visibility::LightSize;
use umbrage_lab::{Backend, ComparisonOptions, DetailOptions, NamedTechnique};

/// What is compared if not told: the papers' maps, and what renderers ship beside its counterpart
/// of this library.
pub(crate) const DEFAULT_TECHNIQUES: [&str; 7] =
    ["uniform", "psm", "lispsm", "tsm", "adaptive", "uniform(stable)+z4:pcf3", "adaptive:pcf3"];

/// Techniques that compete.
#[derive(Clone, Debug, Args)]
pub(crate) struct TechniqueArgs {
    /// How to make shadows, as in lispsm:pcf3@2048; once for each technique (`umbrage help shadows`
    /// has all words).
    #[arg(long, value_name = "SPEC", default_values = DEFAULT_TECHNIQUES)]
    pub(crate) shadows: Vec<NamedTechnique>,
    #[command(flatten)]
    pub(crate) texels: TexelArgs,
    /// What the maps are fitted to.
    #[arg(long, value_enum, default_value_t = Fit::Surfaces)]
    pub(crate) fit: Fit,
    #[command(flatten)]
    pub(crate) execution: ExecutionArgs,
}

impl TechniqueArgs {
    pub(super) fn check(&mut self) -> Result<()> {
        self.texels.apply(&mut self.shadows)?;
        check_distinct(&self.shadows)
    }
}

/// What to compare with the truth, and how finely.
#[derive(Clone, Debug, Args)]
pub(crate) struct ComparisonArgs {
    #[command(flatten)]
    pub(crate) techniques: TechniqueArgs,
    /// Rays along each side of a pixel: K×K samples. Renderers shade at pixel centres only, so
    /// comparisons use 1.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) samples: u32,
    /// Size of the light: an angle for a sun, as in 0.53deg, or a length for a lamp, as in 0.2m.
    /// The soft shadows of a light of this size are then the truth for soft techniques (pcss, and
    /// blurs in metres); all others are measured against the sharp ones.
    #[arg(long, value_name = "SIZE", value_parser = values::light_size, allow_hyphen_values = true)]
    pub(crate) light_size: Option<LightSize>,
}

/// What shadow maps are fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Fit {
    /// The box around the scene, air and all.
    Box,
    /// Some hundred boxes around its surfaces.
    Surfaces,
    /// What the picture shows, tile by tile.
    Seen,
}

impl From<Fit> for umbrage_lab::Fit {
    fn from(fit: Fit) -> Self {
        match fit {
            Fit::Box => Self::Box,
            Fit::Surfaces => Self::Surfaces,
            Fit::Seen => Self::Seen,
        }
    }
}

impl From<umbrage_lab::Fit> for Fit {
    fn from(fit: umbrage_lab::Fit) -> Self {
        match fit {
            umbrage_lab::Fit::Box => Self::Box,
            umbrage_lab::Fit::Surfaces => Self::Surfaces,
            umbrage_lab::Fit::Seen => Self::Seen,
        }
    }
}

impl ComparisonArgs {
    /// What to compare.
    pub(crate) fn options(&self) -> ComparisonOptions {
        ComparisonOptions {
            techniques: self.techniques.shadows.clone(),
            samples: self.samples,
            light_size: self.light_size,
        }
    }
}

/// How many texels there are where specifications do not say.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct TexelArgs {
    /// Take the fewest texels with which none gets wider than PX pixels, before any surface's
    /// slope, in place of @TEXELS.
    #[arg(long, value_name = "PX", value_parser = values::pixels_per_texel, allow_hyphen_values = true)]
    pub(crate) max_error: Option<f64>,
}

/// What does the work.
#[derive(Clone, Debug, Args)]
pub(crate) struct ExecutionArgs {
    /// What renders the shadow maps.
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub(crate) backend: BackendArg,
    /// Draw all triangles. Else a GPU draws scenes of a million triangles or more in levels of
    /// detail, of which texels and pixels can tell no more than half of their width.
    #[arg(long)]
    pub(crate) full_detail: bool,
    /// Take the levels of detail from a file that `umbrage prepare` wrote of this scene.
    #[arg(long, value_name = "FILE", conflicts_with = "full_detail")]
    pub(crate) clusters: Option<PathBuf>,
}

impl ExecutionArgs {
    /// How much detail a GPU draws.
    pub(crate) fn detail(&self) -> DetailOptions {
        match &self.clusters {
            Some(file) => DetailOptions::File(file.clone()),
            None if self.full_detail => DetailOptions::Full,
            None => DetailOptions::Auto,
        }
    }
}

/// What renders shadow maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackendArg {
    /// The GPU if there is one, else the reference.
    Auto,
    /// A GPU.
    Gpu,
    /// Rays on the CPU.
    Reference,
}

impl From<BackendArg> for Backend {
    fn from(backend: BackendArg) -> Self {
        match backend {
            BackendArg::Auto => Self::Auto,
            BackendArg::Gpu => Self::Gpu,
            BackendArg::Reference => Self::Reference,
        }
    }
}

/// That no technique is given twice.
fn check_distinct(techniques: &[NamedTechnique]) -> Result<()> {
    for (i, technique) in techniques.iter().enumerate() {
        let is_new = !techniques[..i].contains(technique);
        ensure!(is_new, "--shadows: `{technique}` is given twice");
    }
    Ok(())
}

impl TexelArgs {
    /// Gives the error to the techniques that do not say how many texels they have.
    pub(super) fn apply(self, techniques: &mut [NamedTechnique]) -> Result<()> {
        let Some(pixels) = self.max_error else { return Ok(()) };
        if let Some(told) = techniques.iter().find(|t| t.is_sized())
            && techniques.iter().all(NamedTechnique::is_sized)
        {
            bail!("--max-error: `{told}` says how many texels there are; leave out either of them");
        }
        for technique in techniques {
            technique.limit_error(pixels);
        }
        Ok(())
    }
}
