//! Files that are there whole or not at all.

use crate::error::{About, Error, Field};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// How the names of all that is unfinished begin.
pub(crate) const TEMPORARY: &str = ".umbrage-";

/// What a view of a sweep was made from, beside its report or instead of one.
pub(crate) const VIEW_RECORD: &str = "view.json";

/// An error about what is to be written.
fn wrong<T>(problem: String) -> Result<T, Error> {
    Err(Error::field(Field::Output, problem))
}

/// The folder that holds `path`.
///
/// # Errors
/// A path without a name of its own, or whose folder is not there.
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

/// Checks, before any work, that a file can be written to `path`.
///
/// # Errors
/// A path of a folder, or whose folder is not there or cannot be written in.
pub fn check_file(path: &Path) -> Result<(), Error> {
    let parent = existing_parent(path)?;
    if path.is_dir() {
        return wrong(format!("{} is a folder, must be a file", path.display()));
    }
    Staging::new(&parent).map(drop)
}

/// A folder beside its destination in which files grow unseen. Dropped, it vanishes with all in it.
struct Staging {
    path: PathBuf,
}

impl Staging {
    /// An empty folder in `parent`.
    fn new(parent: &Path) -> Result<Self, Error> {
        for attempt in 0..1000 {
            let path = parent.join(format!("{TEMPORARY}{}-{attempt}", std::process::id()));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path }),
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return wrong(format!("cannot write in {}: {e}", parent.display())),
            }
        }
        wrong(format!("{} is full of unfinished work of other runs", parent.display()))
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // An empty or half-filled temporary folder that cannot be removed is no reason to fail.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// What a report's folder holds, so that a former report is told from what somebody needs.
#[derive(Clone, Copy, Debug)]
pub struct Contents {
    /// What it is called, as in `a report`.
    pub name: &'static str,
    /// Whether a folder with files of these names is a former one.
    pub is_former: fn(&[String]) -> bool,
    /// Whether a former one may have had a file of this name.
    pub may_have: fn(&str) -> bool,
}

impl Contents {
    /// A comparison of techniques.
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

/// The folder of a report: where it will stand, and what stands there now.
pub struct ReportFolder {
    target: PathBuf,
    parent: PathBuf,
    contents: Contents,
}

impl ReportFolder {
    /// Checks, before any work, that a report can be written to `target`: a new folder, an empty
    /// one, or a former report, which will be replaced.
    ///
    /// # Errors
    /// A folder that holds something else, or that cannot be written.
    pub fn check(target: &Path, contents: Contents) -> Result<Self, Error> {
        let parent = existing_parent(target)?;
        Staging::new(&parent)?;
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

    /// Puts a new report in place, whole: `write` fills a folder, which then takes the place of
    /// whatever stood there.
    ///
    /// # Errors
    /// Those of `write`, and whatever keeps the report from its place; then what stood there still
    /// does.
    pub fn replace<T, E: From<Error>>(
        &self,
        write: impl FnOnce(&Path) -> Result<T, E>,
    ) -> Result<T, E> {
        let new = Staging::new(&self.parent)?;
        let report = new.path.join("new");
        std::fs::create_dir(&report).about(Field::Output)?;
        let written = write(&report)?;
        // Someone may have put something there while we worked.
        self.check_replaceable()?;
        let former = new.path.join("former");
        let has_former = self.target.exists();
        let swap = || {
            if has_former {
                std::fs::rename(&self.target, &former)?;
            }
            std::fs::rename(&report, &self.target).inspect_err(|_| {
                if has_former {
                    // The former report is better than none; the first error is the one to tell.
                    let _ = std::fs::rename(&former, &self.target);
                }
            })
        };
        let tried = || format!("cannot write {}", self.target.display());
        swap().about_trying(Field::Output, tried)?;
        Ok(written)
    }
}

/// Names of all that is in a folder, sorted.
pub(crate) fn names_in(folder: &Path) -> io::Result<Vec<String>> {
    let entries = std::fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    let mut names: Vec<String> =
        entries.iter().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    Ok(names)
}
