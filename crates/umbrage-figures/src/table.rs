//! Writes tables as CSV.

use anyhow::Result;

/// A CSV table.
pub(crate) struct Table(csv::Writer<Vec<u8>>);

impl Table {
    pub(crate) fn new(headings: &[&str]) -> Result<Self> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        csv.write_record(headings)?;
        Ok(Self(csv))
    }

    /// Adds a row of cells, in the order of the headings.
    pub(crate) fn row(&mut self, cells: &[Cell<'_>]) -> Result<()> {
        let cells = cells.iter().map(|cell| match cell {
            Cell::Word(word) => (*word).to_owned(),
            // `to_string` gives the shortest text that parses to the same number.
            Cell::Number(n) if n.is_finite() => n.to_string(),
            Cell::Number(_) => String::new(),
        });
        Ok(self.0.write_record(cells)?)
    }

    pub(crate) fn finish(self) -> Result<Vec<u8>> {
        self.0.into_inner().map_err(|e| e.into_error().into())
    }
}

/// A cell of a table. A number that is not finite gives an empty cell.
pub(crate) enum Cell<'a> {
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

/// Formats a number with five significant digits.
pub(crate) fn rounded(n: f64) -> String {
    if n == 0.0 || !n.is_finite() {
        return n.to_string();
    }
    let unit = 10_f64.powi(4 - n.abs().log10().floor() as i32);
    format!("{}", (n * unit).round() / unit)
}
