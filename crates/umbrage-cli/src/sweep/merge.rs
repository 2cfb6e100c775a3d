//! Shares of a sweep, joined.

use super::folder::{self, Stored, differences, stored};
use super::views::View;
use anyhow::{Context, Result, bail, ensure};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use umbrage_measure::SweepSettings;

/// A view's result that is to be taken.
pub(super) struct Found {
    /// The sweep's folder that has it.
    pub(super) sweep: PathBuf,
    pub(super) stored: Stored,
}

/// Finds each view's result in `output`, as far as it is there, and in the `shares`. A report goes before
/// a failure.
///
/// # Errors
/// Shares of another sweep; views that no share has or for which shares differ, all of them listed.
pub(super) fn find(
    output: &Path,
    shares: &[PathBuf],
    views: &[View],
    settings: &SweepSettings,
) -> Result<Vec<Found>> {
    for share in shares {
        let shown = share.display();
        let Some(present) = folder::read_settings(share).context("--merge")? else {
            bail!("--merge: {shown} is not the folder of a sweep");
        };
        let differences = differences(&present, settings);
        ensure!(
            differences.is_empty(),
            "--merge: {shown} holds another sweep: {}",
            differences.join(", ")
        );
    }
    let (mut found, mut missing, mut conflicts) = (Vec::new(), Vec::new(), Vec::new());
    // Which share saw which content of a scene.
    let mut contents: HashMap<&str, (String, &Path)> = HashMap::new();
    for view in views {
        let mut taken: Option<Found> = None;
        let sweeps = std::iter::once(output).chain(shares.iter().map(PathBuf::as_path));
        for (i, sweep) in sweeps.enumerate() {
            let Some(stored) = stored(sweep, &view.name) else { continue };
            let is_output = i == 0;
            if let Some(problem) = unfit(&stored, view, settings) {
                // What is out of date in the output itself will be replaced.
                if !is_output {
                    conflicts.push(format!("`{}` of {} {problem}", view.name, sweep.display()));
                }
                continue;
            }
            if let Some(content) = &stored.inputs.scene_sha256 {
                let (known, first) =
                    contents.entry(&view.scene).or_insert_with(|| (content.clone(), sweep));
                if known != content {
                    conflicts.push(format!(
                        "the scene {} is not the same file in {} and {}",
                        view.scene,
                        first.display(),
                        sweep.display()
                    ));
                    continue;
                }
            }
            match (&taken, &stored.outcome) {
                (
                    Some(Found { sweep: first, stored: Stored { outcome: Ok(one), .. } }),
                    Ok(other),
                ) => {
                    if one != other {
                        conflicts.push(format!(
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
        match taken {
            Some(taken) => found.push(taken),
            None => missing.push(format!("`{}`", view.name)),
        }
    }
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
    ensure!(problems.is_empty(), "--merge: {}", problems.join("; "));
    Ok(found)
}

/// Why a result is not one of this sweep.
fn unfit(stored: &Stored, view: &View, settings: &SweepSettings) -> Option<String> {
    let inputs = &stored.inputs;
    if inputs.version != super::VERSION {
        Some(format!("was made by umbrage {}, not {}", inputs.version, super::VERSION))
    } else if inputs.view != *view {
        Some("is another view of that name".to_owned())
    } else if inputs.settings != *settings {
        Some("was made with other options".to_owned())
    } else {
        None
    }
}

/// Copies the files of a view's folder.
pub(super) fn copy(from: &Path, to: &Path) -> Result<()> {
    let copy = || -> std::io::Result<()> {
        for entry in std::fs::read_dir(from)? {
            let entry = entry?;
            std::fs::copy(entry.path(), to.join(entry.file_name()))?;
        }
        Ok(())
    };
    copy().with_context(|| format!("--merge: cannot copy {}", from.display()))
}
