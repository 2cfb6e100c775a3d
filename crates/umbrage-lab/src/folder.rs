//! Files and folders that are written whole or not at all.

use crate::error::{About, Error, Field};
use std::io;
use std::path::{Path, PathBuf};
use umbrage_measure::{TemporaryFolder, remove_abandoned};

/// File that records what a view of a sweep was made from, beside the view's report if it has one.
pub(crate) const VIEW_RECORD: &str = "view.json";

/// Returns an error about the output path.
fn wrong<T>(problem: String) -> Result<T, Error> {
    Err(Error::field(Field::Output, problem))
}

/// Returns the folder that contains `path`.
///
/// # Errors
/// An error if `path` has no file name, or if the folder does not exist or is not a folder.
pub(crate) fn existing_parent(path: &Path) -> Result<PathBuf, Error> {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.file_name().is_none() {
        return wrong(format!("{} has no name of its own", path.display()));
    }
    match parent.metadata() {
        Ok(meta) if meta.is_dir() => Ok(parent.to_owned()),
        Ok(_) => wrong(format!("{} is not a folder", parent.display())),
        Err(e) => wrong(format!("the folder {} must exist: {e}", parent.display())),
    }
}

/// Checks, before any work is done, that a file can be written to `path`.
///
/// # Errors
/// An error if `path` has no file name or is a folder, or if the folder that contains it does not
/// exist or cannot be written to.
pub fn check_file(path: &Path) -> Result<(), Error> {
    let parent = existing_parent(path)?;
    if path.is_dir() {
        return wrong(format!("{} is a folder, must be a file", path.display()));
    }
    staging(&parent).map(drop)
}

/// Makes an empty temporary folder in `parent`, in which files are written before they are moved
/// into place, and removes what killed processes left there.
fn staging(parent: &Path) -> Result<TemporaryFolder, Error> {
    remove_abandoned(parent);
    TemporaryFolder::new_in(parent)
        .about_trying(Field::Output, || format!("cannot write in {}", parent.display()))
}

/// Contents of a report's folder, by which a former report is told from files that somebody needs.
#[derive(Clone, Copy, Debug)]
pub struct Contents {
    /// Name of the report with its article, such as `a report`.
    pub name: &'static str,
    /// Whether a folder with files of these names holds a former report.
    pub is_former: fn(&[String]) -> bool,
    /// Whether a former report may contain a file of this name.
    pub may_have: fn(&str) -> bool,
}

impl Contents {
    /// Contents of the report of a comparison.
    pub const COMPARISON: Self = Self {
        name: "a report",
        is_former: |names| {
            let has = |file: &str| names.iter().any(|n| n == file);
            has("index.html") && has("report.json") || has(VIEW_RECORD)
        },
        may_have: |name| {
            ["index.html", "report.json", VIEW_RECORD].contains(&name) || name.ends_with(".png")
        },
    };
}

/// The place for a report's folder, where a former report may be now.
pub struct ReportFolder {
    target: PathBuf,
    parent: PathBuf,
    contents: Contents,
}

impl ReportFolder {
    /// Checks, before any work is done, that a report can be written to `target`. The folder must
    /// be new, empty, or a former report, which will be replaced.
    ///
    /// # Errors
    /// An error if the folder holds something else, or if it cannot be written.
    pub fn check(target: &Path, contents: Contents) -> Result<Self, Error> {
        let parent = existing_parent(target)?;
        staging(&parent)?;
        let folder = Self { target: target.to_owned(), parent, contents };
        folder.check_replaceable()?;
        Ok(folder)
    }

    fn check_replaceable(&self) -> Result<(), Error> {
        let target = self.target.display();
        let Ok(meta) = self.target.symlink_metadata() else {
            return Ok(());
        };
        if !meta.is_dir() {
            return wrong(format!("{target} is there and is not a folder"));
        }
        let names = names_in(&self.target)
            .about_trying(Field::Output, || format!("cannot read {target}"))?;
        let what = self.contents.name;
        if !names.is_empty() && !(self.contents.is_former)(&names) {
            return wrong(format!(
                "{target} holds something other than {what}; take another folder or empty it"
            ));
        }
        match names.iter().find(|n| !(self.contents.may_have)(n)) {
            Some(strange) => wrong(format!(
                "{target} holds {strange}, which is not part of {what}; take another folder or move \
                 it away"
            )),
            None => Ok(()),
        }
    }

    /// Writes a new report, whole or not at all: `write` fills a temporary folder, which then
    /// replaces what was at the destination.
    ///
    /// # Errors
    /// The errors of `write`. Also an error if the report cannot be moved to its destination. In
    /// both cases the former report is kept.
    pub fn replace<T, E: From<Error>>(
        &self,
        write: impl FnOnce(&Path) -> Result<T, E>,
    ) -> Result<T, E> {
        let new = staging(&self.parent)?;
        let report = new.path().join("new");
        std::fs::create_dir(&report).about(Field::Output)?;
        let written = write(&report)?;
        // Somebody may have put files there in the meantime.
        self.check_replaceable()?;
        let tried = || format!("cannot write {}", self.target.display());
        new.put(&report, &self.target).about_trying(Field::Output, tried)?;
        Ok(written)
    }
}

/// Returns the names of all files and folders in a folder, sorted.
pub(crate) fn names_in(folder: &Path) -> io::Result<Vec<String>> {
    let entries = std::fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    let mut names: Vec<String> =
        entries.iter().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    Ok(names)
}
