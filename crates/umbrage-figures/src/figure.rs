//! A figure and its files.

use crate::table::{Table, rounded};
use anyhow::Result;
use umbrage_measure::{FigureFile, FigureShown};

/// One figure with its files.
#[derive(Clone, Debug)]
pub struct Figure {
    /// How its files' names begin: small letters, digits and hyphens.
    pub(crate) name: &'static str,
    /// What it shows.
    pub(crate) title: String,
    /// Which figure of which paper.
    pub(crate) source: &'static str,
    /// What to see in it, a paragraph.
    pub(crate) text: String,
    /// Pictures and tables, in the page's order.
    pub(crate) files: Vec<File>,
}

/// A file of a figure: `NAME.svg`, or `NAME-PART.svg` where the part has a name.
#[derive(Clone, Debug)]
pub(crate) struct File {
    part: &'static str,
    extension: &'static str,
    /// What it shows, for those who cannot see it; for tables, what their rows are.
    about: String,
    pub(crate) bytes: Vec<u8>,
    /// Whether the page shows what is in a table.
    is_table_shown: bool,
}

impl Figure {
    pub(crate) fn shown(&self) -> FigureShown {
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
    pub(crate) fn svg(part: &'static str, about: impl Into<String>, svg: String) -> Self {
        let bytes = svg.into_bytes();
        Self { part, extension: "svg", about: about.into(), bytes, is_table_shown: false }
    }

    /// A table.
    pub(crate) fn csv(part: &'static str, about: impl Into<String>, table: Table) -> Result<Self> {
        let bytes = table.finish()?;
        Ok(Self { part, extension: "csv", about: about.into(), bytes, is_table_shown: false })
    }

    /// A table so small that the page shows it.
    pub(crate) fn shown_csv(
        part: &'static str,
        about: impl Into<String>,
        table: Table,
    ) -> Result<Self> {
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

    pub(crate) fn name(&self, figure: &str) -> String {
        let hyphen = if self.part.is_empty() { "" } else { "-" };
        format!("{figure}{hyphen}{}.{}", self.part, self.extension)
    }
}
