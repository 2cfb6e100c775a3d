//! `umbrage compare` and `umbrage sweep`: their options.

use super::session::SessionSceneArgs;
use super::technique::ComparisonArgs;
use super::view::{DEFAULT_SIZE, LightArgs, SceneChangeArgs, ViewArgs};
use crate::values;
use anyhow::Result;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use umbrage_lab::{Motion, Share};

/// `umbrage compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage compare town -o report --shadows uniform --shadows psm --shadows adaptive
  umbrage compare level.glb -o report --shadows lispsm@2048 --shadows tsm:pcf3@2048 \\
      --eye 0,6,30 --target=-15,0,0 --near 0.25 --far 125 --sun=-0.58,-0.71,-0.41 --json")]
pub(crate) struct Compare {
    #[command(flatten)]
    pub(crate) scene: SessionSceneArgs,
    /// Folder for the report; a former report there is replaced, anything else is not.
    #[arg(short, long, value_name = "DIR", default_value = "report")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) comparison: ComparisonArgs,
    /// Measure flicker too: how often shadows change in a motion where the truth does not; and with
    /// `away` noise: how much pixels sparkle.
    #[arg(long, value_enum)]
    pub(crate) motion: Option<MotionArg>,
    /// Frames of the motion.
    #[arg(
        long, value_name = "N", default_value_t = 8, requires = "motion",
        value_parser = clap::value_parser!(u32).range(2..=1000)
    )]
    pub(crate) frames: u32,
    /// Print report.json to standard output.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
}

/// `umbrage sweep`.
#[derive(Debug, Args)]
#[command(after_help = "\
VIEWS is a JSON list of objects. Each needs `name` and `scene`; what `compare` takes as options may
follow, with the same defaults: `eye`, `target`, `up` (three numbers), `fov`, `ortho`, `near`, `far`, `size` (two),
`camera`, `sun` (three), `sun-angles` (two) and `light`. For example
  [{\"name\": \"noon\", \"scene\": \"town\", \"sun\": [0.1, -1, 0.2]},
   {\"name\": \"gate\", \"scene\": \"city/level.glb\", \"eye\": [0, 2, 9], \"target\": [0, 1, 0], \"far\": 80}]
A sweep that was stopped goes on where it was if the same command is given again. What failed is tried
again.

Examples:
  umbrage sweep views.json -o sweep --shadows uniform --shadows lispsm:pcf3@2048
  umbrage sweep views.json -o share2 --shard 2/8
  umbrage sweep views.json -o sweep --merge share1 share2 share3 share4 share5 share6 share7 share8")]
pub(crate) struct Sweep {
    /// A JSON list of views (the end of this help shows one).
    #[arg(value_name = "VIEWS")]
    pub(crate) views: PathBuf,
    /// Folder for the results; a sweep that was begun there goes on.
    #[arg(short, long, value_name = "DIR", default_value = "sweep")]
    pub(crate) output: PathBuf,
    /// Folder that the scenes' paths start from; without it, the folder of VIEWS.
    #[arg(long, value_name = "DIR")]
    pub(crate) scenes: Option<PathBuf>,
    /// Do the I-th of N equal shares of the views, in their order, into a folder of its own.
    #[arg(long, value_name = "I/N", value_parser = values::share)]
    pub(crate) shard: Option<Share>,
    /// Take what there is from these folders of other shares of this sweep, and compute nothing.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "shard")]
    pub(crate) merge: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) comparison: ComparisonArgs,
    #[command(flatten)]
    pub(crate) changes: SceneChangeArgs,
    /// Size of the pictures, pixels, where a view has none of its own.
    #[arg(
        long, value_name = "WxH", value_parser = values::picture_size, allow_hyphen_values = true,
        default_value = DEFAULT_SIZE
    )]
    pub(crate) size: [u32; 2],
    /// Print results.json to standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// A motion, in steps as small as between the frames of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MotionArg {
    /// The viewer moves forward, by a hundredth of the distance to the target a frame.
    Dolly,
    /// The viewer circles the target, half a degree a frame.
    Orbit,
    /// The light turns about the vertical, a tenth of a degree a frame.
    Sun,
    /// The viewer moves away from the target, by a two-hundredth of the distance a frame, so that
    /// more and more texels fall into a pixel.
    Away,
}

impl From<MotionArg> for Motion {
    fn from(motion: MotionArg) -> Self {
        match motion {
            MotionArg::Dolly => Self::Dolly,
            MotionArg::Orbit => Self::Orbit,
            MotionArg::Sun => Self::Sun,
            MotionArg::Away => Self::Away,
        }
    }
}

impl Compare {
    /// Takes what is not asked for from the session, if there is one.
    pub(super) fn take_session(&mut self) -> Result<()> {
        let Some(session) = self.scene.take_session(&mut self.view, &mut self.light)? else {
            return Ok(());
        };
        let told = self.scene.session.told;
        let comparison = &mut self.comparison;
        comparison.light_size = comparison.light_size.or(session.light_size);
        if !told.shadows {
            comparison.techniques.shadows = session.techniques;
        }
        if !told.fit {
            comparison.techniques.fit = session.fit.into();
        }
        self.check()
    }

    pub(super) fn check(&mut self) -> Result<()> {
        self.view.options().check()?;
        self.light.options().check()?;
        self.comparison.techniques.check()
    }
}
