//! `umbrage sweep`: comparisons in many views, in shares if there are many, with means over all.

mod folder;
mod merge;
mod views;

use crate::args;
use crate::comparison::{Comparison, Stage};
use crate::execute::Execution;
use crate::output::{ReportFolder, aligned, command_line, note, one_line, print};
use crate::pixels::NOTHING_TO_SHADOW;
use crate::progress::Progress;
use crate::setup::{open_scene_in, scene_file, tell_notices};
use anyhow::{Error, Result, anyhow, ensure};
use folder::{Inputs, SweepFolder};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::path::Path;
use umbrage_measure::{Sweep, SweepPage, SweepSettings, SweptView, write_sweep};
use views::View;

/// Figures of another version are no figures of this one.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A view that is still to be compared.
struct Pending {
    inputs: Inputs,
    place: ReportFolder,
}

/// Compares what is missing, or joins shares; then writes tables and the page of all views.
pub(crate) fn run(args: &args::Sweep, quiet: bool) -> Result<()> {
    let mut views = views::read(&args.views)?;
    if let Some(scenes) = &args.scenes {
        ensure!(scenes.is_dir(), "--scenes: {} is not a folder", scenes.display());
    }
    let execution = Execution::open(
        &args.comparison.techniques.execution,
        &args.comparison.techniques.shadows,
    )?;
    let settings = SweepSettings {
        shadows: args.comparison.techniques.shadows.iter().map(|t| t.to_string()).collect(),
        max_error: args.comparison.techniques.texels.max_error,
        size: args.size,
        samples: args.comparison.samples,
        opaque: args.opaque,
        fit: args.comparison.techniques.fit.name().into(),
        backend: execution.name().into(),
    };
    let folder = if args.merge.is_empty() {
        let folder = SweepFolder::open(&args.output, &settings)?;
        check_names(&folder, args, &views)?;
        if let Some(args::Share { index, count }) = args.shard {
            let first =
                |share: u32| (views.len() as u64 * u64::from(share) / u64::from(count)) as usize;
            views = views[first(index - 1)..first(index)].to_vec();
        }
        compare_missing(args, &execution, &folder, &views, &settings, quiet)?;
        folder
    } else {
        join(args, &views, &settings)?
    };

    let outcome = |view: View| {
        let stored = folder.stored(&view.name);
        let gone = || anyhow!("--output: the result of `{}` was removed meanwhile", view.name);
        Ok(SweptView {
            folder: folder::relative_view_folder(&view.name),
            outcome: stored.ok_or_else(gone)?.outcome,
            name: view.name,
            scene: view.scene,
        })
    };
    let sweep = Sweep {
        name: args.views.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        share: args.shard.map(|s| format!("{}/{}", s.index, s.count)),
        settings,
        views: views.into_iter().map(outcome).collect::<Result<_>>()?,
    };
    write_sweep(&args.output, &SweepPage { sweep: &sweep, command: Some(&command_line()) })?;
    let page = args.output.join("index.html");
    if args.json {
        note(&format!("report: {}", page.display()));
        print(&sweep.to_json()?)?;
    } else {
        print(&format!("{}\nreport: {}\n", table(&sweep), page.display()))?;
    }
    let failed: Vec<&str> =
        sweep.views.iter().filter(|v| v.outcome.is_err()).map(|v| v.name.as_str()).collect();
    ensure!(
        failed.is_empty(),
        "{} of {} views failed: {}",
        failed.len(),
        sweep.views.len(),
        failed.join(", ")
    );
    Ok(())
}

/// That the folder is not one of other views altogether; says which of its views are no longer wanted.
fn check_names(folder: &SweepFolder, args: &args::Sweep, views: &[View]) -> Result<()> {
    let present = folder.names()?;
    let (known, others): (Vec<&String>, Vec<&String>) =
        present.iter().partition(|name| views.iter().any(|v| v.name == **name));
    let (output, file) = (args.output.display(), args.views.display());
    ensure!(
        others.is_empty() || !known.is_empty(),
        "--output: {output} holds another sweep: none of its views is in {file}; take another folder"
    );
    for name in others {
        note(&format!("{output} has a view `{name}`, which is not in {file}: left alone"));
    }
    Ok(())
}

/// Compares the views that the folder has no result of, one that failed being none.
fn compare_missing(
    args: &args::Sweep,
    execution: &Execution,
    folder: &SweepFolder,
    views: &[View],
    settings: &SweepSettings,
    quiet: bool,
) -> Result<()> {
    let scenes = args.scenes.as_deref().or(args.views.parent()).unwrap_or(Path::new(""));
    let mut digests: HashMap<&str, Option<String>> = HashMap::new();
    let mut pending = Vec::new();
    for view in views {
        let digest = digests.entry(&view.scene).or_insert_with(|| digest(scenes, &view.scene));
        let inputs = Inputs {
            version: VERSION.to_owned(),
            settings: settings.clone(),
            view: view.clone(),
            scene_sha256: digest.clone(),
        };
        let stored = folder.stored(&view.name);
        if !stored.is_some_and(|s| s.outcome.is_ok() && s.inputs == inputs) {
            pending.push(Pending { inputs, place: folder.place(&view.name)? });
        }
    }
    if pending.is_empty() {
        return Ok(());
    }
    let done = views.len() - pending.len();
    if done > 0 {
        note(&format!("{done} of {} views are done already", views.len()));
    }
    folder.remove_tables()?;
    execution.announce();
    let progress = Progress::of_parts(pending.len() as u64, quiet);
    let mut number = done;
    for pending in pending.chunk_by(|a, b| a.inputs.view.scene == b.inputs.view.scene) {
        let scene = open_scene_in(scenes, &pending[0].inputs.view.scene);
        if let Ok(scene) = &scene {
            progress.aside(|| tell_notices(scene));
        }
        let stage = scene
            .as_ref()
            .map_err(again)
            .and_then(|s| Stage::new(s, execution, args.opaque, args.comparison.techniques.fit));
        for view in pending {
            number += 1;
            progress.name(format!("{number}/{} {}", views.len(), view.inputs.view.name));
            compare(view, stage.as_ref().map_err(again), args, &progress)?;
            progress.end();
        }
    }
    Ok(())
}

/// Compares in one view, and keeps the report, or why there is none.
fn compare(
    view: &Pending,
    stage: Result<&Stage<'_>>,
    args: &args::Sweep,
    progress: &Progress,
) -> Result<()> {
    let Pending { inputs, place } = view;
    let comparison = stage.and_then(|stage| {
        let (view, light) = inputs.view.options(args.size)?;
        Comparison::new(stage, &view, &light, &args.comparison)
    });
    let compared = comparison.as_ref().map_err(again).and_then(|comparison| {
        progress.begin(comparison.rows());
        comparison.trace(progress)
    });
    let name = &inputs.view.name;
    match compared {
        Ok(compared) => {
            if !compared.has_shadows() {
                progress.aside(|| log::warn!("{name}: {NOTHING_TO_SHADOW}"));
            }
            let write = |path: &Path| compared.write(path, &command_line(), progress).map(drop);
            folder::put(place, inputs, None, write)
        }
        Err(e) => {
            let error = views::in_words_of_the_file(&one_line(&e));
            progress.aside(|| note(&failure(name, &error)));
            folder::put(place, inputs, Some(error), |_| Ok(()))
        }
    }
}

/// Copies into the output what the shares have.
fn join(args: &args::Sweep, views: &[View], settings: &SweepSettings) -> Result<SweepFolder> {
    let found = merge::find(&args.output, &args.merge, views, settings)?;
    let folder = SweepFolder::open(&args.output, settings)?;
    check_names(&folder, args, views)?;
    folder.remove_tables()?;
    for (view, found) in views.iter().zip(found) {
        if found.sweep != args.output {
            let source = folder::view_folder(&found.sweep, &view.name);
            folder.place(&view.name)?.replace(|path| merge::copy(&source, path))?;
        }
        if let Err(error) = &found.stored.outcome {
            note(&failure(&view.name, error));
        }
    }
    Ok(folder)
}

fn failure(name: &str, error: &str) -> String {
    format!("umbrage: view `{name}`: {error}")
}

/// SHA-256 of a scene's files, one after the other; `None` where there is none to be read.
fn digest(folder: &Path, scene: &str) -> Option<String> {
    let file = scene_file(folder, scene)?;
    // Of a broken scene the file itself must do.
    let files = umbrage_scene::files(&file).unwrap_or_else(|_| vec![file]);
    let mut sha = Sha256::new();
    for file in files {
        sha.update(std::fs::read(file).ok()?);
    }
    Some(sha.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

/// The same error for another view.
fn again(error: &Error) -> Error {
    anyhow!("{error:#}")
}

fn table(sweep: &Sweep) -> String {
    let mut rows = vec![["geometric mean of", "wrong", "mean error", "views"].map(str::to_owned)];
    rows.extend(sweep.means().into_iter().map(|m| {
        let text = |v: Option<f64>, text: fn(f64) -> String| v.map_or("-".to_owned(), text);
        [
            m.shadows,
            text(m.wrong_fraction, |v| format!("{:.2}%", v * 100.0)),
            text(m.mean_abs_error, |v| format!("{v:.4}")),
            m.views.to_string(),
        ]
    }));
    aligned(&rows)
}
