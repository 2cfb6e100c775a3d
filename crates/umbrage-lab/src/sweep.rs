//! Comparisons in many views, in shares if there are many, with means over all.

mod folder;
mod merge;
mod views;

use crate::comparison::{Comparison, ComparisonOptions};
use crate::error::{Error, Field};
use crate::executors::{Backend, Executors};
use crate::folder::ReportFolder;
use crate::prepared::PreparedScene;
use crate::progress::Progress;
use crate::receivers::Fit;
use crate::scene::{digest, open_scene};
use crate::strip::NOTHING_TO_SHADOW;
use folder::{Inputs, SweepFolder, VERSION};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use umbrage_measure::{Sweep, SweepPage, SweepSettings, SweptView, write_sweep};
use views::SweepView;

/// What to compare in which views.
#[derive(Clone, Debug)]
pub struct SweepOptions {
    /// A JSON list of views: objects with `name` and `scene`, and what they ask for by the fields'
    /// names.
    pub views: PathBuf,
    /// Folder for the results; a sweep that was begun there goes on.
    pub output: PathBuf,
    /// Folder that the scenes' paths start from; `None`: the folder of `views`.
    pub scenes: Option<PathBuf>,
    /// What to compare, and how finely.
    pub comparison: ComparisonOptions,
    /// The largest error, pixels per texel, that those techniques were given which do not say how
    /// many texels they have; results tell it.
    pub max_error: Option<f64>,
    /// What the maps are fitted to.
    pub fit: Fit,
    /// What renders them.
    pub backend: Backend,
    /// Alpha-masked materials cast and show as solid.
    pub opaque: bool,
    /// Size of the pictures, pixels, where a view has none of its own.
    pub size: [u32; 2],
    /// What makes the results again, for people to copy.
    pub command: String,
    /// What to call fields that are not a view's own where it is told why a view failed.
    pub words: fn(Field) -> String,
}

/// One of equal shares of a sweep's views, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Which one, from 1.
    pub index: u32,
    /// Of how many.
    pub count: u32,
}

/// A view that is still to be compared.
struct Pending {
    inputs: Inputs,
    place: ReportFolder,
}

/// Compares what is missing of the views or of a share of them, a part of the job each; then writes
/// tables and the page of all. What failed is told in the sweep, and tried again next time.
///
/// # Errors
/// A file that holds no views, a folder that holds something else or another sweep, a GPU that is
/// asked for and not there, and what cannot be written.
pub fn sweep(
    options: &SweepOptions,
    share: Option<Share>,
    progress: &dyn Progress,
) -> Result<Sweep, Error> {
    let Begun { mut views, executors, settings } = begin(options)?;
    let folder = SweepFolder::open(&options.output, &settings)?;
    check_names(&folder, options, &views, progress)?;
    if let Some(Share { index, count }) = share {
        let first =
            |share: u32| (views.len() as u64 * u64::from(share) / u64::from(count)) as usize;
        views = views[first(index - 1)..first(index)].to_vec();
    }
    compare_missing(options, &executors, &folder, &views, &settings, progress)?;
    finish(options, share, &folder, views, settings)
}

/// Takes what there is from the folders of shares, and computes nothing; then writes tables and the
/// page of all views.
///
/// # Errors
/// As for [`sweep()`]; shares of another sweep, that lack views, or that contradict one another.
pub fn join_shares(
    options: &SweepOptions,
    shares: &[PathBuf],
    progress: &dyn Progress,
) -> Result<Sweep, Error> {
    let Begun { views, settings, .. } = begin(options)?;
    let found = merge::find(&options.output, shares, &views, &settings)?;
    let folder = SweepFolder::open(&options.output, &settings)?;
    check_names(&folder, options, &views, progress)?;
    folder.remove_tables()?;
    for (view, found) in views.iter().zip(found) {
        if found.sweep != options.output {
            let source = folder::view_folder(&found.sweep, &view.name);
            folder.place(&view.name)?.replace(|path| merge::copy(&source, path))?;
        }
        if let Err(error) = &found.stored.outcome {
            progress.failed(&view.name, error);
        }
    }
    finish(options, None, &folder, views, settings)
}

/// What every sweep begins with.
struct Begun {
    views: Vec<SweepView>,
    executors: Executors,
    settings: SweepSettings,
}

fn begin(options: &SweepOptions) -> Result<Begun, Error> {
    let views = views::read(&options.views)?;
    if let Some(scenes) = &options.scenes
        && !scenes.is_dir()
    {
        let problem = format!("{} is not a folder", scenes.display());
        return Err(Error::field(Field::Scenes, problem));
    }
    let comparison = &options.comparison;
    let executors = Executors::open(options.backend, &comparison.techniques)?;
    let settings = SweepSettings {
        shadows: comparison.techniques.iter().map(ToString::to_string).collect(),
        max_error: options.max_error,
        size: options.size,
        samples: comparison.samples,
        opaque: options.opaque,
        fit: options.fit.name().into(),
        backend: executors.name().into(),
    };
    Ok(Begun { views, executors, settings })
}

/// Gathers the views' results, and writes tables and page.
fn finish(
    options: &SweepOptions,
    share: Option<Share>,
    folder: &SweepFolder,
    views: Vec<SweepView>,
    settings: SweepSettings,
) -> Result<Sweep, Error> {
    let outcome = |view: SweepView| {
        let stored = folder.stored(&view.name).ok_or_else(|| {
            let problem = format!("the result of `{}` was removed meanwhile", view.name);
            Error::field(Field::Output, problem)
        })?;
        Ok(SweptView {
            folder: folder::relative_view_folder(&view.name),
            outcome: stored.outcome,
            name: view.name,
            scene: view.scene,
        })
    };
    let sweep = Sweep {
        name: options.views.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        share: share.map(|s| format!("{}/{}", s.index, s.count)),
        settings,
        views: views.into_iter().map(outcome).collect::<Result<_, Error>>()?,
    };
    let page = SweepPage { sweep: &sweep, command: Some(&options.command) };
    write_sweep(&options.output, &page)?;
    Ok(sweep)
}

/// That the folder is not one of other views altogether; says which of its views are no longer
/// wanted.
fn check_names(
    folder: &SweepFolder,
    options: &SweepOptions,
    views: &[SweepView],
    progress: &dyn Progress,
) -> Result<(), Error> {
    let present = folder.names()?;
    let (known, others): (Vec<&String>, Vec<&String>) =
        present.iter().partition(|name| views.iter().any(|v| v.name == **name));
    let (output, file) = (options.output.display(), options.views.display());
    if !others.is_empty() && known.is_empty() {
        let problem = format!(
            "{output} holds another sweep: none of its views is in {file}; take another folder"
        );
        return Err(Error::field(Field::Output, problem));
    }
    for name in others {
        progress.note(&format!("{output} has a view `{name}`, which is not in {file}: left alone"));
    }
    Ok(())
}

/// Compares the views that the folder has no result of, one that failed being none.
fn compare_missing(
    options: &SweepOptions,
    executors: &Executors,
    folder: &SweepFolder,
    views: &[SweepView],
    settings: &SweepSettings,
    progress: &dyn Progress,
) -> Result<(), Error> {
    let scenes = options.scenes.as_deref().or(options.views.parent()).unwrap_or(Path::new(""));
    let pending = pending(scenes, folder, views, settings)?;
    if pending.is_empty() {
        return Ok(());
    }
    let done = views.len() - pending.len();
    if done > 0 {
        progress.note(&format!("{done} of {} views are done already", views.len()));
    }
    folder.remove_tables()?;
    if let Some(choice) = executors.choice() {
        progress.backend(choice);
    }
    progress.parts(pending.len() as u64);
    let told = |error: Error| in_words_of_the_file(&error, options.words);
    let mut number = done;
    for pending in pending.chunk_by(|a, b| a.inputs.view.scene == b.inputs.view.scene) {
        let name = &pending[0].inputs.view.scene;
        let scene = open_scene(scenes, name).map_err(told);
        if let Ok(scene) = &scene {
            progress.scene(name, scene);
        }
        let prepared = scene.as_ref().map_err(Clone::clone).and_then(|scene| {
            PreparedScene::new(scene, executors, options.opaque, options.fit).map_err(told)
        });
        for view in pending {
            number += 1;
            progress.part(&format!("{number}/{} {}", views.len(), view.inputs.view.name));
            compare(view, prepared.as_ref().map_err(String::as_str), options, progress)?;
            progress.end_part();
        }
    }
    Ok(())
}

/// The views that the folder has no result of, and where their results go.
fn pending(
    scenes: &Path,
    folder: &SweepFolder,
    views: &[SweepView],
    settings: &SweepSettings,
) -> Result<Vec<Pending>, Error> {
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
    Ok(pending)
}

/// Compares in one view, and keeps the report, or why there is none.
fn compare(
    view: &Pending,
    prepared: Result<&PreparedScene<'_>, &str>,
    options: &SweepOptions,
    progress: &dyn Progress,
) -> Result<(), Error> {
    let Pending { inputs, place } = view;
    let told = |error: Error| in_words_of_the_file(&error, options.words);
    let comparison = prepared.map_err(str::to_owned).and_then(|prepared| {
        let (view, light) = inputs.view.options(options.size).map_err(told)?;
        Comparison::new(prepared, &view, &light, &options.comparison).map_err(told)
    });
    let compared = comparison.as_ref().map_err(Clone::clone).and_then(|comparison| {
        progress.rows(comparison.rows());
        comparison.trace(progress).map_err(told)
    });
    let name = &inputs.view.name;
    match compared {
        Ok(compared) => {
            if !compared.has_shadows() {
                progress.warn(&format!("{name}: {NOTHING_TO_SHADOW}"));
            }
            let write = |path: &Path| compared.write(path, &options.command, progress).map(drop);
            folder::put(place, inputs, None, write)
        }
        Err(error) => {
            progress.failed(name, &error);
            folder::put(place, inputs, Some(error), |_| Ok(()))
        }
    }
}

/// Why a view failed, in the words of the file that has it.
fn in_words_of_the_file(error: &Error, words: fn(Field) -> String) -> String {
    error.in_words(&|field| match field.is_of_view() {
        true => field.name().to_owned(),
        false => words(field),
    })
}
