//! `umbrage figures` reproduces the papers' figures and tables.

use crate::args;
use crate::output::command_line;
use crate::progress::Bar;
use anyhow::Result;
use umbrage_lab::ReportFolder;

/// Makes the figures, and writes them with a page that shows them.
pub(crate) fn run(args: &args::Figures, quiet: bool) -> Result<()> {
    let folder = ReportFolder::check(&args.output, umbrage_figures::CONTENTS)?;
    let figures = umbrage_figures::make(&args.only, &Bar::of_parts(quiet))?;
    folder.replace(|path| umbrage_figures::write(&figures, path, &command_line()))
}
