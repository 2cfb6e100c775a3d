//! The folder of a sweep. It stays valid if the process is stopped at any moment.
//!
//! ```text
//! sweep.json          settings of all views; a folder that has this file is that of a sweep
//! .lock               locked while a process works in the folder
//! views/NAME/         a view's report and `view.json`, which records what it was made from
//! results.csv, results.json, index.html
//! ```
//!
//! A view's folder is written under a temporary name and renamed when it is complete. What a
//! process leaves unfinished has a name that begins with `.umbrage-`; the next process removes it.

use super::views::SweepView;
use crate::error::{About, Difference, Error, Field};
use crate::folder::{Contents, ReportFolder, VIEW_RECORD, existing_parent, names_in};
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use umbrage_measure::{Report, SweepSettings, TEMPORARY, write_file};

/// Version of the program. Results of another version are not valid for this one.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

const SETTINGS: &str = "sweep.json";
const LOCK: &str = ".lock";
const VIEWS: &str = "views";
const TABLES: [&str; 3] = ["index.html", "results.json", "results.csv"];

/// Everything that a view's results depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Inputs {
    /// Version of the program.
    pub(super) version: String,
    /// Settings that all views of the sweep share.
    pub(super) settings: SweepSettings,
    /// The view in the file of views.
    pub(super) view: SweepView,
    /// SHA-256 of all files of the scene; `None` if the scene is built in or cannot be read.
    pub(super) scene_sha256: Option<String>,
}

/// Contents of `view.json`.
#[derive(Serialize, Deserialize)]
struct Record {
    inputs: Inputs,
    /// Why the view failed; `None` if there is a report.
    error: Option<String>,
    /// Names of the report's files, without all of which it counts as missing.
    files: Vec<String>,
}

/// The stored result of a view.
pub(super) struct Stored {
    pub(super) inputs: Inputs,
    /// The report, or why the view failed.
    pub(super) outcome: Result<Report, String>,
}

/// The folder of a sweep, locked so that no other process works in it.
pub(super) struct SweepFolder {
    path: PathBuf,
    /// The lock ends when the file is closed, however the process ends.
    _lock: File,
}

impl SweepFolder {
    /// Begins a sweep in a new or empty folder, or continues a sweep with the same settings.
    ///
    /// # Errors
    /// An error if the folder holds something else or a sweep with other settings, if another
    /// process works in it, or if it cannot be written.
    pub(super) fn open(path: &Path, settings: &SweepSettings) -> Result<Self, Error> {
        let wrong = |problem: String| Err(Error::field(Field::Output, problem));
        let shown = path.display();
        existing_parent(path)?;
        match std::fs::create_dir(path) {
            Err(e) if e.kind() != ErrorKind::AlreadyExists => {
                return wrong(format!("cannot make {shown}: {e}"));
            }
            _ if !path.is_dir() => {
                return wrong(format!("{shown} is there and is not a folder"));
            }
            _ => {}
        }
        let names =
            names_in(path).about_trying(Field::Output, || format!("cannot read {shown}"))?;
        let is_ours = |name: &String| name == LOCK || name.starts_with(TEMPORARY);
        if !names.iter().any(|n| n == SETTINGS) && !names.iter().all(is_ours) {
            return wrong(format!(
                "{shown} holds something other than a sweep; take another folder or empty it"
            ));
        }
        let lock = lock(path)?;
        if let Some(present) = read_settings(path, Field::Output)? {
            check_same(path, Field::Output, &present, settings)?;
        }
        begin(path, settings).about_trying(Field::Output, || format!("cannot write in {shown}"))?;
        Ok(Self { path: path.to_owned(), _lock: lock })
    }

    /// Returns the names of the views that have a folder.
    pub(super) fn names(&self) -> Result<Vec<String>, Error> {
        names_in(&self.path.join(VIEWS)).about(Field::Output)
    }

    /// Returns the stored result of a view; `None` if there is no complete one.
    pub(super) fn stored(&self, name: &str) -> Option<Stored> {
        stored(&self.path, name)
    }

    /// Removes the tables and the page, which are about to be out of date.
    pub(super) fn remove_tables(&self) -> Result<(), Error> {
        for table in TABLES {
            match std::fs::remove_file(self.path.join(table)) {
                Err(e) if e.kind() != ErrorKind::NotFound => {
                    let problem = format!("cannot remove {table} in {}: {e}", self.path.display());
                    return Err(Error::field(Field::Output, problem));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns the place for a view's report, after checking that it can be written there.
    pub(super) fn place(&self, name: &str) -> Result<ReportFolder, Error> {
        ReportFolder::check(&view_folder(&self.path, name), Contents::COMPARISON)
    }
}

/// Removes what other processes left unfinished, and writes the settings and the folder of views.
fn begin(path: &Path, settings: &SweepSettings) -> io::Result<()> {
    clear(path)?;
    let text = serde_json::to_string_pretty(settings)?;
    write_file(path.join(SETTINGS), text.as_bytes()).map_err(io::Error::other)?;
    match std::fs::create_dir(path.join(VIEWS)) {
        Err(e) if e.kind() == ErrorKind::AlreadyExists => clear(&path.join(VIEWS)),
        made => made,
    }
}

/// Removes what other processes left unfinished.
fn clear(folder: &Path) -> io::Result<()> {
    for name in names_in(folder)?.iter().filter(|n| n.starts_with(TEMPORARY)) {
        let path = folder.join(name);
        if path.is_dir() { std::fs::remove_dir_all(path)? } else { std::fs::remove_file(path)? }
    }
    Ok(())
}

/// Writes a view's result, whole or not at all. `write` fills a folder with the report; it writes
/// nothing if there is an `error`.
pub(super) fn put(
    place: &ReportFolder,
    inputs: &Inputs,
    error: Option<String>,
    write: impl FnOnce(&Path) -> Result<(), Error>,
) -> Result<(), Error> {
    place.replace(|folder| {
        write(folder)?;
        let files = names_in(folder).about(Field::Output)?;
        let record = Record { inputs: inputs.clone(), error, files };
        let text = serde_json::to_string_pretty(&record).about(Field::Output)?;
        Ok(write_file(folder.join(VIEW_RECORD), text.as_bytes())?)
    })
}

/// Returns the folder of a view, given that of its sweep.
pub(super) fn view_folder(sweep: &Path, name: &str) -> PathBuf {
    sweep.join(VIEWS).join(name)
}

/// Returns the folder of a view relative to that of its sweep, as part of a URL.
pub(super) fn relative_view_folder(name: &str) -> String {
    format!("{VIEWS}/{name}")
}

/// Reads the stored result of a view; `None` if there is no complete one.
pub(super) fn stored(sweep: &Path, name: &str) -> Option<Stored> {
    let folder = view_folder(sweep, name);
    let read = |file: &str| std::fs::read_to_string(folder.join(file)).ok();
    let Record { inputs, error, files } = serde_json::from_str(&read(VIEW_RECORD)?).ok()?;
    if !files.iter().all(|file| folder.join(file).is_file()) {
        return None;
    }
    let outcome = match error {
        Some(error) => Err(error),
        None => Ok(Report::from_json(&read("report.json")?).ok()?.without_times()),
    };
    Some(Stored { inputs, outcome })
}

/// Reads the settings of a sweep's folder; `None` if it has none. Errors are about `field`.
///
/// # Errors
/// An error if the settings cannot be read.
pub(super) fn read_settings(sweep: &Path, field: Field) -> Result<Option<SweepSettings>, Error> {
    let path = sweep.join(SETTINGS);
    let shown = path.display();
    let text = match std::fs::read_to_string(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        text => text.about_trying(field, || format!("cannot read {shown}"))?,
    };
    let settings = serde_json::from_str(&text)
        .about_trying(field, || format!("{shown} is not the settings of a sweep"))?;
    Ok(Some(settings))
}

/// Checks that the settings of a folder are the `wanted` ones. Errors are about `field`.
pub(super) fn check_same(
    folder: &Path,
    field: Field,
    present: &SweepSettings,
    wanted: &SweepSettings,
) -> Result<(), Error> {
    let on = |is_on: bool| if is_on { "on" } else { "off" }.to_owned();
    let values = |s: &SweepSettings| {
        [
            (Field::Shadows, s.shadows.join(" ")),
            (Field::MaxError, s.max_error.map_or("off".to_owned(), |pixels| pixels.to_string())),
            (Field::Size, format!("{}x{}", s.size[0], s.size[1])),
            (Field::Samples, s.samples.to_string()),
            (Field::LightSize, s.light_size.clone().unwrap_or_else(|| "off".to_owned())),
            (Field::Fit, s.fit.clone()),
            (Field::Opaque, on(s.opaque)),
            (Field::FullDetail, on(s.full_detail)),
            (Field::Animation, s.animation.clone().unwrap_or_else(|| "off".to_owned())),
            (Field::Time, s.time_s.map_or("off".to_owned(), |time| time.to_string())),
            (Field::Without, s.without.join(" ")),
            (Field::Ground, on(s.ground)),
            (Field::Backend, s.backend.clone()),
        ]
    };
    let pairs = values(present).into_iter().zip(values(wanted));
    let differences: Vec<Difference> = pairs
        .filter(|(present, wanted)| present != wanted)
        .map(|((field, was), (_, is))| Difference { field, was, is })
        .collect();
    match differences.is_empty() {
        true => Ok(()),
        false => Err(Error::OtherSweep { field, folder: folder.to_owned(), differences }),
    }
}

fn lock(folder: &Path) -> Result<File, Error> {
    let shown = folder.display();
    let open = File::options().create(true).truncate(false).write(true).open(folder.join(LOCK));
    let file = open.about_trying(Field::Output, || format!("cannot write in {shown}"))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let problem = format!(
                "another sweep is at work in {shown}; shares that run at the same time need folders \
                 of their own"
            );
            return Err(Error::field(Field::Output, problem));
        }
        // Some network file systems have no locks; users are told not to start two processes there.
        Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => {}
        locked => locked.about_trying(Field::Output, || format!("cannot lock {shown}"))?,
    }
    Ok(file)
}
