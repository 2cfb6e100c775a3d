//! Shares of a sweep, joined.

use super::folder::{self, Stored, VERSION, check_same, stored};
use super::views::SweepView;
use crate::error::{About, Error, Field};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use umbrage_measure::SweepSettings;

/// A view's result that is to be taken.
pub(super) struct Found {
    /// The sweep's folder that has it.
    pub(super) sweep: PathBuf,
    pub(super) stored: Stored,
}

/// Finds each view's result in `output`, as far as it is there, and in the `shares`. A report goes
/// before a failure.
///
/// # Errors
/// Shares of another sweep; views that no share has or for which shares differ, all of them listed.
pub(super) fn find(
    output: &Path,
    shares: &[PathBuf],
    views: &[SweepView],
    settings: &SweepSettings,
) -> Result<Vec<Found>, Error> {
    for share in shares {
        let Some(present) = folder::read_settings(share, Field::Merge)? else {
            let problem = format!("{} is not the folder of a sweep", share.display());
            return Err(Error::field(Field::Merge, problem));
        };
        check_same(share, Field::Merge, &present, settings)?;
    }
    let mut search =
        Search { output, shares, settings, contents: HashMap::new(), conflicts: Vec::new() };
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    for view in views {
        match search.take(view) {
            Some(taken) => found.push(taken),
            None => missing.push(format!("`{}`", view.name)),
        }
    }
    let mut conflicts = search.conflicts;
    conflicts.dedup();
    let mut problems = Vec::new();
    if !missing.is_empty() {
        problems.push(format!(
            "{} of {} views are missing: {}",
            missing.len(),
            views.len(),
            missing.join(", ")
        ));
    }
    if !conflicts.is_empty() {
        problems.push(format!("the shares contradict one another: {}", conflicts.join("; ")));
    }
    match problems.is_empty() {
        true => Ok(found),
        false => Err(Error::field(Field::Merge, problems.join("; "))),
    }
}

/// A search for views' results, and what it came across.
struct Search<'a> {
    output: &'a Path,
    shares: &'a [PathBuf],
    settings: &'a SweepSettings,
    /// Which sweep saw which content of a scene.
    contents: HashMap<&'a str, (String, &'a Path)>,
    /// Where sweeps contradict one another.
    conflicts: Vec<String>,
}

impl<'a> Search<'a> {
    /// The result of a view; `None` if nobody has one that fits.
    fn take(&mut self, view: &'a SweepView) -> Option<Found> {
        let mut taken: Option<Found> = None;
        let sweeps = std::iter::once(self.output).chain(self.shares.iter().map(PathBuf::as_path));
        for (i, sweep) in sweeps.enumerate() {
            let Some(stored) = stored(sweep, &view.name) else { continue };
            let is_output = i == 0;
            if let Some(problem) = unfit(&stored, view, self.settings) {
                // What is out of date in the output itself will be replaced.
                if !is_output {
                    let shown = sweep.display();
                    self.conflicts.push(format!("`{}` of {shown} {problem}", view.name));
                }
                continue;
            }
            if !self.has_same_scene(view, &stored, sweep) {
                continue;
            }
            match (&taken, &stored.outcome) {
                (
                    Some(Found { sweep: first, stored: Stored { outcome: Ok(one), .. } }),
                    Ok(other),
                ) => {
                    if one != other {
                        self.conflicts.push(format!(
                            "`{}` has other figures in {} than in {}",
                            view.name,
                            first.display(),
                            sweep.display()
                        ));
                    }
                }
                (Some(_), Err(_)) => {}
                _ => taken = Some(Found { sweep: sweep.to_owned(), stored }),
            }
        }
        taken
    }

    /// Whether a sweep saw the same files of a view's scene as those before it.
    fn has_same_scene(&mut self, view: &'a SweepView, stored: &Stored, sweep: &'a Path) -> bool {
        let Some(content) = &stored.inputs.scene_sha256 else { return true };
        let (known, first) =
            self.contents.entry(&view.scene).or_insert_with(|| (content.clone(), sweep));
        if known != content {
            self.conflicts.push(format!(
                "the scene {} is not the same file in {} and {}",
                view.scene,
                first.display(),
                sweep.display()
            ));
            return false;
        }
        true
    }
}

/// Why a result is not one of this sweep.
fn unfit(stored: &Stored, view: &SweepView, settings: &SweepSettings) -> Option<String> {
    let inputs = &stored.inputs;
    if inputs.version != VERSION {
        Some(format!("was made by umbrage {}, not {}", inputs.version, VERSION))
    } else if inputs.view != *view {
        Some("is another view of that name".to_owned())
    } else if inputs.settings != *settings {
        Some("was made with other options".to_owned())
    } else {
        None
    }
}

/// Copies the files of a view's folder.
///
/// # Errors
/// Files that cannot be read or written.
pub(super) fn copy(from: &Path, to: &Path) -> Result<(), Error> {
    let copy = || -> std::io::Result<()> {
        for entry in std::fs::read_dir(from)? {
            let entry = entry?;
            std::fs::copy(entry.path(), to.join(entry.file_name()))?;
        }
        Ok(())
    };
    copy().about_trying(Field::Merge, || format!("cannot copy {}", from.display()))
}
