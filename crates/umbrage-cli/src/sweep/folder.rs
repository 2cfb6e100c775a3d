//! The folder of a sweep. It survives being stopped at any moment.
//!
//! ```text
//! sweep.json          what all views have in common; the first file, so it tells a sweep's folder
//! .lock               held while a process is at work
//! views/NAME/         a view's report and `view.json`, which says what it was made from
//! results.csv, results.json, index.html
//! ```
//!
//! A view's folder comes into being by a rename, whole. What was being made when a process died is left
//! under a name that begins with `.umbrage-`; the next process clears it away.

use super::views::View;
use crate::output::{Contents, ReportFolder, TEMPORARY, VIEW_RECORD, existing_parent};
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use umbrage_measure::{Report, SweepSettings, write_file};

const SETTINGS: &str = "sweep.json";
const LOCK: &str = ".lock";
const VIEWS: &str = "views";
const TABLES: [&str; 3] = ["index.html", "results.json", "results.csv"];

/// All that a view's figures depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Inputs {
    /// The program's.
    pub(super) version: String,
    /// Of all views.
    pub(super) settings: SweepSettings,
    /// The view itself.
    pub(super) view: View,
    /// Of the scene's files together; `None` for one that is built in or not there.
    pub(super) scene_sha256: Option<String>,
}

/// `view.json`.
#[derive(Serialize, Deserialize)]
struct Record {
    inputs: Inputs,
    /// Why there is no report.
    error: Option<String>,
}

/// What is there of a view.
pub(super) struct Stored {
    pub(super) inputs: Inputs,
    /// Its report, or why there is none.
    pub(super) outcome: Result<Report, String>,
}

/// The folder of a sweep that nobody else works in.
pub(super) struct SweepFolder {
    path: PathBuf,
    /// Unlocks when closed, however the process ends.
    _lock: File,
}

impl SweepFolder {
    /// Begins a sweep in a new or empty folder, or goes on with one of the same settings.
    pub(super) fn open(path: &Path, settings: &SweepSettings) -> Result<Self> {
        let shown = path.display();
        existing_parent(path)?;
        match std::fs::create_dir(path) {
            Err(e) if e.kind() != ErrorKind::AlreadyExists => {
                bail!("--output: cannot make {shown}: {e}")
            }
            _ => ensure!(path.is_dir(), "--output: {shown} is there and is not a folder"),
        }
        let names = names_in(path).with_context(|| format!("--output: cannot read {shown}"))?;
        let is_ours = |name: &String| name == LOCK || name.starts_with(TEMPORARY);
        ensure!(
            names.iter().any(|n| n == SETTINGS) || names.iter().all(is_ours),
            "--output: {shown} holds something other than a sweep; take another folder or empty it"
        );
        let lock = lock(path)?;
        if let Some(present) = read_settings(path).context("--output")? {
            let differences = differences(&present, settings);
            ensure!(
                differences.is_empty(),
                "--output: {shown} holds another sweep: {}; take another folder",
                differences.join(", ")
            );
        }
        let folder = Self { path: path.to_owned(), _lock: lock };
        let begin = || {
            folder.clear(path)?;
            write_file(path.join(SETTINGS), serde_json::to_string_pretty(settings)?.as_bytes())?;
            match std::fs::create_dir(path.join(VIEWS)) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => folder.clear(&path.join(VIEWS)),
                made => Ok(made?),
            }
        };
        begin().with_context(|| format!("--output: cannot write in {shown}"))?;
        Ok(folder)
    }

    /// Removes what others left unfinished.
    fn clear(&self, folder: &Path) -> Result<()> {
        for name in names_in(folder)?.iter().filter(|n| n.starts_with(TEMPORARY)) {
            let path = folder.join(name);
            if path.is_dir() { std::fs::remove_dir_all(path)? } else { std::fs::remove_file(path)? }
        }
        Ok(())
    }

    /// Names of the views that are there.
    pub(super) fn names(&self) -> Result<Vec<String>> {
        Ok(names_in(&self.path.join(VIEWS))?)
    }

    /// What is there of a view; `None` if nothing whole is.
    pub(super) fn stored(&self, name: &str) -> Option<Stored> {
        stored(&self.path, name)
    }

    /// Removes the tables, which are about to be out of date.
    pub(super) fn remove_tables(&self) -> Result<()> {
        for table in TABLES {
            match std::fs::remove_file(self.path.join(table)) {
                Err(e) if e.kind() != ErrorKind::NotFound => {
                    bail!("--output: cannot remove {table} in {}: {e}", self.path.display())
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Where a view's report goes, checked before any work.
    pub(super) fn place(&self, name: &str) -> Result<ReportFolder> {
        ReportFolder::check(&view_folder(&self.path, name), Contents::Comparison)
    }
}

/// Puts a view's result in place, whole: `write` fills a folder with its report, unless there is an `error`.
pub(super) fn put(
    place: &ReportFolder,
    inputs: &Inputs,
    error: Option<String>,
    write: impl FnOnce(&Path) -> Result<()>,
) -> Result<()> {
    let record = Record { inputs: inputs.clone(), error };
    place.replace(|folder| {
        write(folder)?;
        let text = serde_json::to_string_pretty(&record)?;
        Ok(write_file(folder.join(VIEW_RECORD), text.as_bytes())?)
    })
}

/// The folder of a view in that of a sweep.
pub(super) fn view_folder(sweep: &Path, name: &str) -> PathBuf {
    sweep.join(VIEWS).join(name)
}

/// The same, as part of an address.
pub(super) fn relative_view_folder(name: &str) -> String {
    format!("{VIEWS}/{name}")
}

/// What a sweep's folder has of a view; `None` if nothing whole is there.
pub(super) fn stored(sweep: &Path, name: &str) -> Option<Stored> {
    let folder = view_folder(sweep, name);
    let read = |file: &str| std::fs::read_to_string(folder.join(file)).ok();
    let Record { inputs, error } = serde_json::from_str(&read(VIEW_RECORD)?).ok()?;
    let outcome = match error {
        Some(error) => Err(error),
        None if !folder.join("index.html").is_file() => return None,
        None => Ok(Report::from_json(&read("report.json")?).ok()?.without_times()),
    };
    Some(Stored { inputs, outcome })
}

/// The settings of the sweep in a folder; `None` if there is none.
pub(super) fn read_settings(sweep: &Path) -> Result<Option<SweepSettings>> {
    let path = sweep.join(SETTINGS);
    let text = match std::fs::read_to_string(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        text => text.with_context(|| format!("cannot read {}", path.display()))?,
    };
    let settings = serde_json::from_str(&text)
        .with_context(|| format!("{} is not the settings of a sweep", path.display()))?;
    Ok(Some(settings))
}

/// In which options `present` is other than `wanted`.
pub(super) fn differences(present: &SweepSettings, wanted: &SweepSettings) -> Vec<String> {
    let options = |s: &SweepSettings| {
        [
            ("--shadows", s.shadows.join(" ")),
            ("--max-error", s.max_error.map_or("off".to_owned(), |pixels| pixels.to_string())),
            ("--size", format!("{}x{}", s.size[0], s.size[1])),
            ("--samples", s.samples.to_string()),
            ("--fit", s.fit.clone()),
            ("--opaque", if s.opaque { "on" } else { "off" }.to_owned()),
            ("--backend", s.backend.clone()),
        ]
    };
    let pairs = options(present).into_iter().zip(options(wanted));
    pairs
        .filter(|(present, wanted)| present != wanted)
        .map(|((option, present), (_, wanted))| format!("{option} was `{present}`, is `{wanted}`"))
        .collect()
}

fn lock(folder: &Path) -> Result<File> {
    let shown = folder.display();
    let open = File::options().create(true).truncate(false).write(true).open(folder.join(LOCK));
    let file = open.with_context(|| format!("--output: cannot write in {shown}"))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => bail!(
            "--output: another sweep is at work in {shown}; shares that run at the same time need folders \
             of their own"
        ),
        // Some network file systems have no locks; whoever starts two there has been told not to.
        Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => {}
        locked => locked.with_context(|| format!("--output: cannot lock {shown}"))?,
    }
    Ok(file)
}

fn names_in(folder: &Path) -> io::Result<Vec<String>> {
    let entries = std::fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    let mut names: Vec<String> =
        entries.iter().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    Ok(names)
}
