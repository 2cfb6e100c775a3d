//! The page with the figures of the papers.

use super::view::url;
use crate::{Error, write_file};
use askama::Template;
use serde::Serialize;
use std::path::Path;

/// Figures with their files, and all else that their page shows.
#[derive(Clone, Copy, Debug)]
pub struct FiguresPage<'a> {
    /// The figures in the order of the page.
    pub figures: &'a [FigureShown],
    /// The command line that produced this page.
    pub command: &'a str,
}

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FigureShown {
    /// The figure's anchor on the page: lower-case letters, digits and hyphens.
    pub name: String,
    /// What the figure shows.
    pub title: String,
    /// The paper that the figure comes from, and its number there.
    pub source: String,
    /// A paragraph about what the figure tells.
    pub text: String,
    /// The figure's pictures and tables.
    pub files: Vec<FigureFile>,
}

/// A picture or a table of a figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FigureFile {
    /// The file's name in the page's folder. Files that end in `.csv` are tables, all others are
    /// pictures.
    pub file: String,
    /// For a picture, a description for readers who cannot see it; for a table, what its rows are.
    pub about: String,
    /// The rows of a table that the page shows, starting with the headings; empty for pictures and
    /// for tables that are only linked.
    #[serde(skip)]
    pub rows: Vec<Vec<String>>,
}

impl FigureFile {
    fn is_table(&self) -> bool {
        self.file.ends_with(".csv")
    }
}

#[derive(Template)]
#[template(path = "figures.html")]
struct Html<'a> {
    css: &'static str,
    version: &'static str,
    figures: &'a [FigureShown],
    command: &'a str,
}

/// Writes `figures.json`, the list of figures, and then `index.html` into `folder`, which must
/// exist and contain the figures' files. The page opens offline.
///
/// # Errors
/// A file is missing in `folder`, or one of the two cannot be written.
pub fn write_figures(folder: impl AsRef<Path>, page: &FiguresPage<'_>) -> Result<(), Error> {
    let folder = folder.as_ref();
    let mut files = page.figures.iter().flat_map(|f| &f.files);
    if let Some(missing) = files.find(|f| !folder.join(&f.file).is_file()) {
        let problem = format!("{} is not in {}", missing.file, folder.display());
        return Err(Error::Report { field: "figures", problem });
    }
    let path = folder.join("index.html");
    let html = Html {
        css: include_str!("../../assets/report.css"),
        version: env!("CARGO_PKG_VERSION"),
        figures: page.figures,
        command: page.command,
    };
    let html =
        html.render().map_err(|e| Error::Encode { path: path.clone(), reason: e.to_string() })?;
    let json = serde_json::to_string_pretty(page.figures)? + "\n";
    write_file(folder.join("figures.json"), json.as_bytes())?;
    write_file(path, html.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_files_are_refused_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let file = |file: &str, rows: &[[&str; 2]]| FigureFile {
            file: file.to_owned(),
            about: "what <it> shows".to_owned(),
            rows: rows.iter().map(|row| row.map(str::to_owned).to_vec()).collect(),
        };
        let figure = FigureShown {
            name: "one".to_owned(),
            title: "One & only".to_owned(),
            source: "Somebody 2004".to_owned(),
            text: "n < f".to_owned(),
            files: vec![file("one a.svg", &[]), file("one.csv", &[["k", "m < 1"], ["7", "0.5"]])],
        };
        let write = || {
            let page = FiguresPage { figures: std::slice::from_ref(&figure), command: "umbrage" };
            write_figures(folder.path(), &page).map_err(|e| e.to_string())
        };
        write_file(folder.path().join("one a.svg"), b"<svg/>").unwrap();
        assert!(write().unwrap_err().starts_with("figures: one.csv is not in "));
        assert!(!folder.path().join("figures.json").exists());
        write_file(folder.path().join("one.csv"), b"").unwrap();
        write().unwrap();
        let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
        for part in
            ["One &#38; only", "n &#60; f", "src=\"one%20a.svg\"", "m &#60; 1", "<td>0.5</td>"]
        {
            assert!(page.contains(part), "{part}: {page}");
        }
        let json = std::fs::read_to_string(folder.path().join("figures.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json[0]["files"][0]["file"], "one a.svg");
    }
}
