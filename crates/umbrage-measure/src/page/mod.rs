//! The HTML report.

mod chart;
mod numbers;
mod table;
mod techniques;
mod view;

use crate::{Error, ErrorScale, Pictures, Report, write_file};
use askama::Template;
use std::path::Path;

/// A report with its pictures, ready to be shown.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// The figures.
    pub report: &'a Report,
    /// The truth's pictures.
    pub truth: &'a Pictures,
    /// The techniques' pictures, one a result, in the results' order.
    pub pictures: &'a [Pictures],
    /// What the error maps were drawn with.
    pub scale: ErrorScale,
    /// What the reader should know about how this was made (repairs on loading the scene, options
    /// that were left out), a sentence each.
    pub notices: &'a [String],
    /// The command line that makes this report again, if there is one.
    pub command: Option<&'a str>,
}

/// Writes `report.json` and then `index.html` into `folder`, which must exist and hold the pictures.
/// The page opens offline and needs nothing but the pictures beside it.
///
/// # Errors
/// If there are no results, not one set of pictures a result, a picture is missing in `folder`, or
/// the files cannot be written.
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
        return wrong("pictures", format!("must be one set a result ({results}), are {sets}"));
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
