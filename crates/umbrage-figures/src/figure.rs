//! A figure and the files that belong to it.

use crate::table::{Table, rounded};
use anyhow::Result;
use umbrage_measure::{FigureFile, FigureShown};

/// One figure with its files.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Prefix of its files' names, in lower-case letters, digits and hyphens.
    pub(crate) name: &'static str,
    /// Title, which says what the figure shows.
    pub(crate) title: String,
    /// The paper and the figure or equations that it reproduces.
    pub(crate) source: &'static str,
    /// A paragraph that explains the figure.
    pub(crate) text: String,
    /// Drawings and tables, in the page's order.
    pub(crate) files: Vec<File>,
}

/// One file of a figure. It is called `NAME.svg`, or `NAME-PART.svg` if `part` is not empty; tables
/// end in `.csv`.
#[derive(Clone, Debug)]
pub(crate) struct File {
    part: &'static str,
    extension: &'static str,
    /// Alternative text for a drawing. For a table, it says what a row stands for.
    about: String,
    pub(crate) bytes: Vec<u8>,
    /// Whether the page shows the rows of this table.
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
    /// Creates the file of a drawing.
    pub(crate) fn svg(part: &'static str, about: impl Into<String>, svg: String) -> Self {
        let bytes = svg.into_bytes();
        Self { part, extension: "svg", about: about.into(), bytes, is_table_shown: false }
    }

    /// Creates the file of a table.
    pub(crate) fn csv(part: &'static str, about: impl Into<String>, table: Table) -> Result<Self> {
        let bytes = table.finish()?;
        Ok(Self { part, extension: "csv", about: about.into(), bytes, is_table_shown: false })
    }

    /// Creates the file of a table that is small enough for the page to show its rows.
    pub(crate) fn shown_csv(
        part: &'static str,
        about: impl Into<String>,
        table: Table,
    ) -> Result<Self> {
        Ok(Self { is_table_shown: true, ..Self::csv(part, about, table)? })
    }

    /// The rows that the page shows: the headings first, then the cells with rounded numbers.
    fn rows(&self) -> Vec<Vec<String>> {
        if !self.is_table_shown {
            return Vec::new();
        }
        let mut csv = csv::ReaderBuilder::new().has_headers(false).from_reader(&*self.bytes);
        let cell = |cell: &str| cell.parse().map_or(cell.to_owned(), rounded);
        // Reading cannot fail, because this crate wrote the table.
        csv.records().flatten().map(|row| row.iter().map(cell).collect()).collect()
    }

    pub(crate) fn name(&self, figure: &str) -> String {
        let hyphen = if self.part.is_empty() { "" } else { "-" };
        format!("{figure}{hyphen}{}.{}", self.part, self.extension)
    }
}
