//! Reproduces the papers' figures and tables from the closed forms and from shadow maps that are
//! planned and rendered. The output is SVG drawings, CSV tables and a page that shows them.
//!
//! ```
//! let figures = umbrage_figures::make(&["wp-storage".to_owned()], &())?;
//! let folder = tempfile::tempdir()?;
//! umbrage_figures::write(&figures, folder.path(), "an example")?;
//! assert!(folder.path().join("wp-storage.csv").is_file());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod aliasing;
mod axis;
mod chart;
mod contour;
mod convolution;
mod figure;
mod filtered;
mod heat;
mod hemisphere;
mod lispsm;
mod measured;
mod misprints;
mod ours;
mod planned;
mod rendered;
mod schemes;
mod table;
mod warping;

pub use figure::Figure;

use anyhow::{Context, Result};
use rayon::prelude::*;
use std::path::Path;
use umbrage_lab::{Contents, Progress};
use umbrage_measure::{FiguresPage, write_figures};

/// A function that makes one figure.
type Make = fn() -> Result<Figure>;

/// All figures, in the page's order.
const FIGURES: &[(&str, Make)] = &[
    ("lispsm-fig6", lispsm::fig6),
    ("wp-fig5", warping::fig5),
    ("wp-fig6", warping::fig6),
    ("wp-fig7", hemisphere::fig7),
    ("wp-fig10", warping::fig10),
    ("wp-fig12", warping::fig12),
    ("wp-fig13", warping::fig13),
    ("wp-storage", warping::storage),
    ("theory-fig3", aliasing::theory_fig3),
    ("csm-fig3", convolution::fig3),
    ("csm-fig6", convolution::fig6),
    ("csm-fig7", filtered::fig7),
    ("csm-fig8", filtered::fig8),
    ("ours-theta", ours::theta),
    ("ours-critical", ours::critical),
    ("ours-gain", ours::gain),
    ("misprints", misprints::misprints),
];

/// Which files a folder of figures may contain, and how an existing folder is recognised.
pub const CONTENTS: Contents = Contents {
    name: "figures of umbrage",
    is_former: |names| {
        let has = |file: &str| names.iter().any(|n| n == file);
        has("index.html") && has("figures.json")
    },
    may_have: |name| ["index.html", "figures.json"].contains(&name) || may_have_made(name),
};

/// Whether a file with this name may belong to a figure.
fn may_have_made(file: &str) -> bool {
    let Some((stem, extension)) = file.rsplit_once('.') else { return false };
    let mut rest = names().filter_map(|name| stem.strip_prefix(name));
    ["svg", "csv"].contains(&extension) && rest.any(|r| r.is_empty() || r.starts_with('-'))
}

/// The names of all figures, in the page's order, in lower-case letters, digits and hyphens.
pub fn names() -> impl Iterator<Item = &'static str> {
    FIGURES.iter().map(|(name, _)| *name)
}

/// Makes the figures with these names, or all figures if `only` is empty, in the page's order. Each
/// figure counts as one part of the job in `progress`.
///
/// # Errors
/// Returns errors of the planner, a closed form or a drawing. Any of these is a bug in this crate.
pub fn make(only: &[String], progress: &dyn Progress) -> Result<Vec<Figure>> {
    let is_wanted = |name: &str| only.is_empty() || only.iter().any(|o| o == name);
    let wanted: Vec<_> = FIGURES.iter().filter(|(name, _)| is_wanted(name)).collect();
    progress.parts(wanted.len() as u64);
    let figures = wanted.par_iter().map(|(name, make)| {
        progress.stage(name);
        let figure = make().with_context(|| format!("figure {name}"))?;
        progress.end_part();
        Ok(figure)
    });
    figures.collect()
}

/// Writes figures and their page into an empty `folder`. The page shows `command` as the command
/// line that makes the figures again.
///
/// # Errors
/// Fails if a file cannot be written.
pub fn write(figures: &[Figure], folder: &Path, command: &str) -> Result<()> {
    for figure in figures {
        for file in &figure.files {
            umbrage_measure::write_file(folder.join(file.name(figure.name)), &file.bytes)?;
        }
    }
    let shown: Vec<_> = figures.iter().map(Figure::shown).collect();
    Ok(write_figures(folder, &FiguresPage { figures: &shown, command })?)
}
