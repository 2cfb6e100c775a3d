//! `umbrage view` opens a window.

use crate::args;
use anyhow::Result;

/// Opens the window, and returns when it is closed.
pub(crate) fn run(args: &args::Window) -> Result<()> {
    let script = args.script.clone().zip(args.screenshot.clone());
    Ok(umbrage_view::run(&umbrage_view::Options { scene: args.scene.clone(), script })?)
}
