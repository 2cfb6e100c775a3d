//! The HTML pages of reports, of sweeps, and of the papers' figures.

mod chart;
mod command;
mod figures;
mod finding;
mod numbers;
mod sweep;
mod table;
mod view;

use crate::{Error, ErrorScale, Pictures, Report, write_file};
use askama::Template;
pub(crate) use chart::ticks;
pub use command::{comma_separated, quoted, quoted_option};
pub use figures::{FigureFile, FigureShown, FiguresPage, write_figures};
use std::path::Path;
pub use sweep::{SweepPage, write_sweep};

/// A report with its pictures and all else that its page shows.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// The report and its figures.
    pub report: &'a Report,
    /// The pictures of the truth.
    pub truth: &'a Pictures,
    /// The pictures of the techniques, one set for each result, in the order of the results.
    pub pictures: &'a [Pictures],
    /// The colour scale of the error maps.
    pub scale: ErrorScale,
    /// Notices for the reader about how the report was made (repairs on loading the scene, options
    /// without effect), one sentence each.
    pub notices: &'a [String],
    /// The command line that produced this report; `None` leaves it out.
    pub command: Option<&'a str>,
}

/// Writes `report.json` and then `index.html` into `folder`, which must exist and contain the
/// pictures. The page opens offline and needs only the pictures beside it.
///
/// # Errors
/// There are no results, the number of picture sets is not that of the results, a picture is
/// missing in `folder`, or a file cannot be written.
pub fn write_report(folder: impl AsRef<Path>, page: &Page<'_>) -> Result<(), Error> {
    let folder = folder.as_ref();
    check(folder, page)?;
    let path = folder.join("index.html");
    let html = view::Html::new(page)?
        .render()
        .map_err(|e| Error::Encode { path: path.clone(), reason: e.to_string() })?;
    write_file(folder.join("report.json"), page.report.to_json()?.as_bytes())?;
    write_file(path, html.as_bytes())
}

fn check(folder: &Path, page: &Page<'_>) -> Result<(), Error> {
    let wrong = |field, problem| Err(Error::Report { field, problem });
    let (results, sets) = (page.report.results.len(), page.pictures.len());
    if results == 0 {
        return wrong("report.results", "must not be empty".to_owned());
    }
    if page.report.size.contains(&0) {
        return wrong("report.size", "must be at least 1 pixel each way".to_owned());
    }
    if results != sets {
        return wrong("pictures", format!("must be one set per result ({results}), not {sets}"));
    }
    let missing = page
        .pictures
        .iter()
        .chain([page.truth])
        .flat_map(Pictures::files)
        .find(|(_, file)| !folder.join(file).is_file());
    match missing {
        Some((_, file)) => wrong("pictures", format!("{file} is not in {}", folder.display())),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::report;

    #[test]
    fn incomplete_reports_are_refused_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let there = Pictures {
            color: "there.png".to_owned(),
            visibility: "there.png".to_owned(),
            ..Pictures::default()
        };
        write_file(folder.path().join("there.png"), b"").unwrap();
        let gone = Pictures { error: Some("gone.png".to_owned()), ..there.clone() };
        let write = |results: usize, pictures: &[Pictures]| {
            let report = &report(&vec![Some(0.5); results]);
            let scale = ErrorScale::default();
            let page = Page { report, truth: &there, pictures, scale, notices: &[], command: None };
            write_report(folder.path(), &page).map_err(|e| e.to_string())
        };
        assert_eq!(write(0, &[]).unwrap_err(), "report.results: must not be empty");
        let one_too_few = "pictures: must be one set per result (2), not 1";
        assert_eq!(write(2, std::slice::from_ref(&there)).unwrap_err(), one_too_few);
        assert!(write(1, &[gone]).unwrap_err().starts_with("pictures: gone.png is not in "));
        assert!(!folder.path().join("report.json").exists());
        write(1, std::slice::from_ref(&there)).unwrap();
        let mut files: Vec<_> =
            std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().file_name()).collect();
        files.sort();
        assert_eq!(files, ["index.html", "report.json", "there.png"]);
    }
}
