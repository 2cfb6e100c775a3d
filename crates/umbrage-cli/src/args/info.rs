//! `umbrage info`: its options.

use super::view::{LightArgs, SceneArgs, ViewArgs};
use anyhow::Result;
use clap::Args;

/// `umbrage info`.
#[derive(Debug, Args)]
#[command(after_help = "\
Cameras, lights and nodes are listed with the words that choose them: for --camera, --light and
--without.

Examples:
  umbrage info town
  umbrage info level.glb --json")]
pub(crate) struct Info {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
}

impl Info {
    pub(super) fn check(&self) -> Result<()> {
        self.view.options().check()?;
        Ok(self.light.options().check()?)
    }
}
