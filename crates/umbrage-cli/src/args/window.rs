//! `umbrage view`: its options.

use clap::Args;
use std::path::PathBuf;

/// `umbrage view`.
#[derive(Debug, Args)]
#[command(after_help = "\
Drag to turn, scroll to go nearer, Alt and drag to move the sun; F1 lists the keys. Scenes and
sessions can also be dropped onto the window.

A script has a JSON object a line, each with one key: load, shadows, compare, camera, sun, overlay,
size, wait, screenshot, quit; or do, for all else (docs/program.md lists the words).

Examples:
  umbrage view
  umbrage view level.glb
  umbrage view umbrage-session.json
  umbrage view town --script tour.jsonl --screenshot pictures")]
pub(crate) struct Window {
    /// A built-in scene, or the path of a .gltf, .glb or session file.
    #[arg(value_name = "SCENE", default_value = "town")]
    pub(crate) scene: String,
    /// Drive the window by the lines of a file, and close it at the end.
    #[arg(long, value_name = "FILE", requires = "screenshot")]
    pub(crate) script: Option<PathBuf>,
    /// Folder for the pictures that the script takes.
    #[arg(long, value_name = "DIR", requires = "script")]
    pub(crate) screenshot: Option<PathBuf>,
}
