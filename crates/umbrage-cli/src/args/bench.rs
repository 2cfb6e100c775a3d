//! `umbrage bench` and `umbrage devices`: what may be asked for.

use super::technique::TechniqueArgs;
use super::view::{LightArgs, SceneArgs, ViewArgs};
use anyhow::Result;
use clap::Args;

/// `umbrage bench`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each frame plans, draws the maps, and draws the picture; techniques take turns, so that ratios between them hold on a
noisy machine. `depth` and `shade` are the GPU's own time where it tells (`umbrage devices`), else wall-clock time;
`frame` is all from planning to the GPU's being done, on the wall clock. `cost` is what the shadows add: plan + depth +
filter + shade, less the shade of `none`, the same frame without shadows, which takes turns too.

Examples:
  umbrage bench town --shadows uniform --shadows lispsm --shadows lispsm+z4
  umbrage bench level.glb --shadows adaptive:pcf3@2048 --still --json
  umbrage bench town --shadows paged --turn 0.25 --renew 30")]
pub(crate) struct Bench {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    pub(crate) techniques: TechniqueArgs,
    /// Frames that count, after two that do not.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(20..=10000))]
    pub(crate) frames: u32,
    /// Nothing moves: maps that are as they were are not drawn again.
    #[arg(long)]
    pub(crate) still: bool,
    /// The camera goes forward at this speed, 60 frames a second, and nothing else moves: pages stay
    /// where they are, and maps follow the camera.
    #[arg(long, value_name = "M/S", conflicts_with = "still", value_parser = speed)]
    pub(crate) walk: Option<f64>,
    /// The light turns about the vertical, so many degrees a second, 60 frames a second, and casters
    /// are unmoved.
    #[arg(long, value_name = "DEG/S", conflicts_with = "still", value_parser = turn)]
    pub(crate) turn: Option<f64>,
    /// Paged maps of the light that turns are renewed over so many frames, in which shadows are
    /// those of where it was: `age_deg` tells how far behind that is.
    #[arg(long, value_name = "FRAMES", requires = "turn", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub(crate) renew: u32,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
}

/// Parses a speed in metres a second.
fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    speed.ok_or_else(|| "must be a positive number of metres a second".to_owned())
}

/// Parses a speed in degrees a second.
fn turn(text: &str) -> Result<f64, String> {
    let turn = text.parse().ok().filter(|v: &f64| v.abs() <= 360.0 && *v != 0.0);
    turn.ok_or_else(|| "must be a number of degrees a second, up to 360, and not 0".to_owned())
}

impl Bench {
    /// Whether no caster moves, so that maps may be kept.
    pub(crate) fn are_casters_unmoved(&self) -> bool {
        self.still || self.walk.is_some() || self.turn.is_some()
    }

    pub(super) fn check(&mut self) -> Result<()> {
        self.view.options().check()?;
        self.light.options().check()?;
        self.techniques.check()
    }
}

/// `umbrage devices`.
#[derive(Debug, Args)]
#[command(after_help = "\
The first that can do what shadows need is taken. WGPU_ADAPTER_NAME takes another by a part of its name,
WGPU_BACKEND by its kind: vulkan, metal, dx12, gl.

Examples:
  umbrage devices
  umbrage devices --json")]
pub(crate) struct Devices {
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}
