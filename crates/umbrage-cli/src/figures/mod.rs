//! `umbrage figures`: the papers' figures and tables once more, from the closed forms, and from maps that
//! were really planned and rendered.

mod aliasing;
mod chart;
mod contour;
mod convolution;
mod filtered;
mod lispsm;
mod measured;
mod misprints;
mod ours;
mod planned;
mod rendered;
mod warping;

use crate::args;
use crate::output::{Contents, ReportFolder, command_line};
use crate::progress::Progress;
use anyhow::{Context, Result};
use rayon::prelude::*;
use umbrage_measure::{FigureFile, FigureShown, FiguresPage, write_figures};

/// One figure with its files.
pub(super) struct Figure {
    /// How its files' names begin: small letters, digits and hyphens.
    name: &'static str,
    /// What it shows.
    title: String,
    /// Which figure of which paper.
    source: &'static str,
    /// What to see in it, a paragraph.
    text: String,
    /// Pictures and tables, in the page's order.
    files: Vec<File>,
}

/// A file of a figure: `NAME.svg`, or `NAME-PART.svg` where the part has a name.
struct File {
    part: &'static str,
    extension: &'static str,
    /// What it shows, for those who cannot see it; for tables, what their rows are.
    about: String,
    bytes: Vec<u8>,
    /// Whether the page shows what is in a table.
    is_table_shown: bool,
}

impl Figure {
    fn shown(&self) -> FigureShown {
        let file = |f: &File| FigureFile {
            file: f.name(self.name),
            about: f.about.clone(),
            rows: f.rows(),
        };
        FigureShown {
            name: self.name.to_owned(),
            title: self.title.clone(),
            source: self.source.to_owned(),
            text: self.text.clone(),
            files: self.files.iter().map(file).collect(),
        }
    }
}

impl File {
    /// A drawing.
    fn svg(part: &'static str, about: impl Into<String>, svg: String) -> Self {
        let bytes = svg.into_bytes();
        Self { part, extension: "svg", about: about.into(), bytes, is_table_shown: false }
    }

    /// A table.
    fn csv(part: &'static str, about: impl Into<String>, table: Table) -> Result<Self> {
        let bytes = table.finish()?;
        Ok(Self { part, extension: "csv", about: about.into(), bytes, is_table_shown: false })
    }

    /// A table so small that the page shows it.
    fn shown_csv(part: &'static str, about: impl Into<String>, table: Table) -> Result<Self> {
        Ok(Self { is_table_shown: true, ..Self::csv(part, about, table)? })
    }

    /// What the page shows of a table: the headings first, numbers rounded.
    fn rows(&self) -> Vec<Vec<String>> {
        if !self.is_table_shown {
            return Vec::new();
        }
        let mut csv = csv::ReaderBuilder::new().has_headers(false).from_reader(&*self.bytes);
        let cell = |cell: &str| cell.parse().map_or(cell.to_owned(), rounded);
        // It was written here, so it can be read.
        csv.records().flatten().map(|row| row.iter().map(cell).collect()).collect()
    }

    fn name(&self, figure: &str) -> String {
        let hyphen = if self.part.is_empty() { "" } else { "-" };
        format!("{figure}{hyphen}{}.{}", self.part, self.extension)
    }
}

/// A CSV table.
struct Table(csv::Writer<Vec<u8>>);

impl Table {
    fn new(headings: &[&str]) -> Result<Self> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        csv.write_record(headings)?;
        Ok(Self(csv))
    }

    /// A row, in the headings' order.
    fn row(&mut self, cells: &[Cell<'_>]) -> Result<()> {
        let cells = cells.iter().map(|cell| match cell {
            Cell::Word(word) => (*word).to_owned(),
            // The shortest text that reads back as the same number.
            Cell::Number(n) if n.is_finite() => n.to_string(),
            Cell::Number(_) => String::new(),
        });
        Ok(self.0.write_record(cells)?)
    }

    fn finish(self) -> Result<Vec<u8>> {
        self.0.into_inner().map_err(|e| e.into_error().into())
    }
}

/// A cell of a table; numbers that are not finite are left out.
enum Cell<'a> {
    Word(&'a str),
    Number(f64),
}

impl From<f64> for Cell<'_> {
    fn from(n: f64) -> Self {
        Self::Number(n)
    }
}

impl From<u32> for Cell<'_> {
    fn from(n: u32) -> Self {
        Self::Number(n.into())
    }
}

impl<'a> From<&'a str> for Cell<'a> {
    fn from(word: &'a str) -> Self {
        Self::Word(word)
    }
}

/// Five digits of a number.
fn rounded(n: f64) -> String {
    if n == 0.0 || !n.is_finite() {
        return n.to_string();
    }
    let unit = 10_f64.powi(4 - n.abs().log10().floor() as i32);
    format!("{}", (n * unit).round() / unit)
}

/// How a figure is made.
type Make = fn() -> Result<Figure>;

/// All figures, in the page's order.
const FIGURES: &[(&str, Make)] = &[
    ("lispsm-fig6", lispsm::fig6),
    ("wp-fig5", warping::fig5),
    ("wp-fig6", warping::fig6),
    ("wp-fig7", warping::fig7),
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

/// The names of all figures.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    FIGURES.iter().map(|(name, _)| *name)
}

/// Whether a file of this name may come from here.
pub(crate) fn may_have_made(file: &str) -> bool {
    let Some((stem, extension)) = file.rsplit_once('.') else { return false };
    let rest = names().filter_map(|name| stem.strip_prefix(name));
    ["svg", "csv"].contains(&extension)
        && rest.into_iter().any(|r| r.is_empty() || r.starts_with('-'))
}

/// Makes the figures and writes them with their page.
pub(crate) fn run(args: &args::Figures, quiet: bool) -> Result<()> {
    let folder = ReportFolder::check(&args.output, Contents::Figures)?;
    let wanted: Vec<_> = FIGURES
        .iter()
        .filter(|(name, _)| args.only.is_empty() || args.only.iter().any(|o| o == name))
        .collect();
    let progress = Progress::of_parts(wanted.len() as u64, quiet);
    let figures = wanted
        .par_iter()
        .map(|(name, make)| {
            progress.stage(*name);
            let figure = make().with_context(|| format!("figure {name}"))?;
            progress.end();
            Ok(figure)
        })
        .collect::<Result<Vec<_>>>()?;
    folder.replace(|path| {
        for figure in &figures {
            for file in &figure.files {
                umbrage_measure::write_file(path.join(file.name(figure.name)), &file.bytes)?;
            }
        }
        let shown: Vec<_> = figures.iter().map(Figure::shown).collect();
        Ok(write_figures(path, &FiguresPage { figures: &shown, command: &command_line() })?)
    })
}
