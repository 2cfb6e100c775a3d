//! Joins the shares of a sweep.

use super::folder::{self, Stored, VERSION, check_same, stored};
use super::views::SweepView;
use crate::error::{About, Error, Field};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use umbrage_measure::SweepSettings;

/// The result of a view, and where it was found.
pub(super) struct Found {
    /// Folder of the sweep that holds the result.
    pub(super) sweep: PathBuf,
    pub(super) stored: Stored,
}

/// Finds each view's result in the `shares` and, as far as it is there, in `output`. A report takes
/// precedence over a failure.
///
/// # Errors
/// An error if a share is not the folder of this sweep, if a view has no result, or if the shares
/// contradict one another. It lists all such views and contradictions.
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

/// A search for the results of views.
struct Search<'a> {
    output: &'a Path,
    shares: &'a [PathBuf],
    settings: &'a SweepSettings,
    /// For each scene, the digest of its files and the first sweep that used them.
    contents: HashMap<&'a str, (String, &'a Path)>,
    /// Contradictions between the sweeps.
    conflicts: Vec<String>,
}

impl<'a> Search<'a> {
    /// Returns the result of a view; `None` if no sweep has a valid one.
    fn take(&mut self, view: &'a SweepView) -> Option<Found> {
        let mut taken: Option<Found> = None;
        let sweeps = std::iter::once(self.output).chain(self.shares.iter().map(PathBuf::as_path));
        for (i, sweep) in sweeps.enumerate() {
            let Some(stored) = stored(sweep, &view.name) else { continue };
            let is_output = i == 0;
            if let Some(problem) = unfit(&stored, view, self.settings) {
                // Outdated results in the output itself will be replaced.
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

    /// Returns whether a sweep used the same files of a view's scene as the sweeps before it.
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

/// Returns why a result does not belong to this sweep; `None` if it does.
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
/// An error if a file cannot be read or written.
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
