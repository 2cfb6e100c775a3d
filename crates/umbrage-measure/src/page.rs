//! The HTML report.

use crate::{Error, ErrorScale, Pictures, Report};
use std::path::Path;

/// A report with its pictures, ready to be shown.
#[derive(Clone, Debug)]
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
/// If there is not one set of pictures a result, or the files cannot be written.
pub fn write_report(folder: impl AsRef<Path>, page: &Page<'_>) -> Result<(), Error> {
    let _ = (folder, page);
    unimplemented!("within the hour")
}
