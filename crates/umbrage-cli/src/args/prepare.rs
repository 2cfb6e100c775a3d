//! `umbrage prepare`: its options.

use super::view::SceneArgs;
use clap::Args;
use std::path::PathBuf;

/// `umbrage prepare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Commands that draw on a GPU take the file by --clusters, in place of making the levels of detail
themselves, which they do for scenes of a million triangles or more.

Examples:
  umbrage prepare huge.glb -o huge.clusters
  umbrage compare huge.glb --clusters huge.clusters
  umbrage prepare colossus:20 -o colossus.clusters --json")]
pub(crate) struct Prepare {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// File to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}
