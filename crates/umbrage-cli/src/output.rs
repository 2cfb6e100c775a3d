//! Standard output, standard error, and files that are there whole or not at all.

use anyhow::{Context, Result, bail, ensure};
use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// How the names of all that is unfinished begin.
pub(crate) const TEMPORARY: &str = ".umbrage-";

/// What a view of a sweep was made from, beside its report or instead of one.
pub(crate) const VIEW_RECORD: &str = "view.json";

/// Writes to standard output. A reader that went away has seen enough: no error.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("standard output"),
        _ => Ok(()),
    }
}

/// Writes a line to standard error, if anyone listens.
pub(crate) fn note(line: &str) {
    // There is nowhere left to complain to.
    let _ = writeln!(io::stderr(), "{line}");
}

/// The command line of this process, to be pasted into a shell.
pub(crate) fn command_line() -> String {
    let mut words = vec!["umbrage".to_owned()];
    words.extend(std::env::args_os().skip(1).map(|w| quoted(&w.to_string_lossy())));
    words.join(" ")
}

fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=+,./:@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Rows of equally many cells as lines of text: the first column flush left, the others right.
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

/// An error and its causes on one line, whatever they say.
pub(crate) fn one_line(error: &anyhow::Error) -> String {
    format!("{error:#}").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The folder that holds `path`, or an error of the option `--output` that names what is missing.
pub(crate) fn existing_parent(path: &Path) -> Result<PathBuf> {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    ensure!(path.file_name().is_some(), "--output: {} has no name of its own", path.display());
    match parent.metadata() {
        Ok(meta) if meta.is_dir() => Ok(parent.to_owned()),
        Ok(_) => bail!("--output: {} is not a folder", parent.display()),
        Err(e) => bail!("--output: the folder {} must exist: {e}", parent.display()),
    }
}

/// Checks, before any work, that a file can be written to `path`.
pub(crate) fn check_file(path: &Path) -> Result<()> {
    let parent = existing_parent(path)?;
    ensure!(!path.is_dir(), "--output: {} is a folder, must be a file", path.display());
    Staging::new(&parent).map(drop)
}

/// A folder beside its destination in which files grow unseen. Dropped, it vanishes with all in it.
pub(crate) struct Staging {
    path: PathBuf,
}

impl Staging {
    /// An empty folder in `parent`.
    pub(crate) fn new(parent: &Path) -> Result<Self> {
        for attempt in 0..1000 {
            let path = parent.join(format!("{TEMPORARY}{}-{attempt}", std::process::id()));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path }),
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => bail!("--output: cannot write in {}: {e}", parent.display()),
            }
        }
        bail!("--output: {} is full of unfinished work of other runs", parent.display())
    }

    /// Where to put the files.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // An empty or half-filled temporary folder that cannot be removed is no reason to fail.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// What a report's folder holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Contents {
    /// A comparison of techniques.
    Comparison,
    /// The papers' figures.
    Figures,
}

impl Contents {
    /// What it is called.
    fn name(self) -> &'static str {
        match self {
            Self::Comparison => "a report",
            Self::Figures => "figures of umbrage",
        }
    }

    /// Whether a folder with these files is a former one.
    fn is_former(self, names: &[String]) -> bool {
        let has = |file: &str| names.iter().any(|n| n == file);
        match self {
            Self::Comparison => has("index.html") && has("report.json") || has(VIEW_RECORD),
            Self::Figures => has("index.html") && has("figures.json"),
        }
    }

    /// Whether a former one may have had this file.
    fn has_file(self, name: &str) -> bool {
        match self {
            Self::Comparison => {
                ["index.html", "report.json", VIEW_RECORD].contains(&name) || name.ends_with(".png")
            }
            Self::Figures => {
                ["index.html", "figures.json"].contains(&name)
                    || crate::figures::may_have_made(name)
            }
        }
    }
}

/// The folder of a report: where it will stand, and what stands there now.
pub(crate) struct ReportFolder {
    target: PathBuf,
    parent: PathBuf,
    contents: Contents,
}

impl ReportFolder {
    /// Checks, before any work, that a report can be written to `target`: a new folder, an empty one,
    /// or a former report, which will be replaced.
    pub(crate) fn check(target: &Path, contents: Contents) -> Result<Self> {
        let parent = existing_parent(target)?;
        Staging::new(&parent)?;
        let folder = Self { target: target.to_owned(), parent, contents };
        folder.check_replaceable()?;
        Ok(folder)
    }

    fn check_replaceable(&self) -> Result<()> {
        let target = self.target.display();
        let Ok(meta) = self.target.symlink_metadata() else {
            return Ok(());
        };
        ensure!(meta.is_dir(), "--output: {target} is there and is not a folder");
        let entries = std::fs::read_dir(&self.target)
            .and_then(Iterator::collect::<io::Result<Vec<_>>>)
            .with_context(|| format!("--output: cannot read {target}"))?;
        let names: Vec<String> =
            entries.iter().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        let what = self.contents.name();
        ensure!(
            names.is_empty() || self.contents.is_former(&names),
            "--output: {target} holds something other than {what}; take another folder or empty it"
        );
        if let Some(strange) = names.iter().find(|n| !self.contents.has_file(n)) {
            bail!(
                "--output: {target} holds {strange}, which is not part of {what}; take another folder \
                 or move it away"
            );
        }
        Ok(())
    }

    /// Puts a new report in place, whole: `write` fills a folder, which then takes the place of
    /// whatever stood there.
    pub(crate) fn replace<T>(&self, write: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
        let new = Staging::new(&self.parent)?;
        let report = new.path().join("new");
        std::fs::create_dir(&report).context("--output")?;
        let written = write(&report)?;
        // Someone may have put something there while we worked.
        self.check_replaceable()?;
        let former = new.path().join("former");
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
        swap().with_context(|| format!("--output: cannot write {}", self.target.display()))?;
        Ok(written)
    }
}
