//! Prints to standard output and standard error, and words errors for the command line.

use anyhow::{Context, Error, Result};
use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write};
use umbrage_lab::Field;
use umbrage_measure::quoted;

/// Writes to standard output. A closed pipe is no error, because its reader has seen enough.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("standard output"),
        _ => Ok(()),
    }
}

/// Writes a line to standard error, and ignores failure.
pub(crate) fn note(line: &str) {
    // If standard error fails, there is nowhere left to report it.
    let _ = writeln!(io::stderr(), "{line}");
}

/// The command line of this process, quoted so that it can be pasted into a shell.
pub(crate) fn command_line() -> String {
    let mut words = vec!["umbrage".to_owned()];
    words.extend(std::env::args_os().skip(1).map(|w| quoted(&w.to_string_lossy())));
    words.join(" ")
}

/// Formats rows with equal numbers of cells as lines of text. The first column is aligned to the
/// left, the others to the right.
pub(crate) fn aligned(rows: &[impl AsRef<[String]>]) -> String {
    let rows: Vec<&[String]> = rows.iter().map(AsRef::as_ref).collect();
    let columns = rows.iter().map(|r| r.len()).max().unwrap_or(0);
    let width = |c: usize| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        for (i, (cell, &width)) in row.iter().zip(&widths).enumerate() {
            // Writing to a string cannot fail.
            let _ = match i {
                0 => write!(text, "{cell:<width$}"),
                _ => write!(text, "  {cell:>width$}"),
            };
        }
        text.push('\n');
    }
    text
}

/// The name of a field on the command line.
pub(crate) fn option(field: Field) -> String {
    match field {
        Field::Scene | Field::Views => field.name().to_uppercase(),
        field => format!("--{field}"),
    }
}

/// Formats an error and its causes on one line, with fields named as on the command line.
pub(crate) fn one_line(error: &Error) -> String {
    let told = |cause: &(dyn std::error::Error + 'static)| match cause.downcast_ref() {
        Some(error) => umbrage_lab::Error::in_words(error, &option),
        None => cause.to_string(),
    };
    let text = umbrage_lab::joined(error.chain().map(told));
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Rounds a number to six significant digits, which is enough to read.
pub(crate) fn six_digits(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}
