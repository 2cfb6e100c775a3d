//! Sweeps: comparisons in many views, which can be split into shares, with means over all views.

mod folder;
mod merge;
mod views;

use crate::comparison::{Comparison, ComparisonOptions};
use crate::detail::{Detail, DetailOptions};
use crate::error::{Error, Field};
use crate::executors::{Backend, Executors};
use crate::folder::ReportFolder;
use crate::prepared::PreparedScene;
use crate::progress::Progress;
use crate::receivers::Fit;
use crate::scene::{SceneOptions, digest, open_scene};
use crate::strip::NOTHING_TO_SHADOW;
use folder::{Inputs, SweepFolder, VERSION};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use umbrage_measure::{Sweep, SweepPage, SweepSettings, SweptView, write_sweep};
use views::SweepView;

/// The views of a sweep, what is compared in them, and where the results go.
#[derive(Clone, Debug)]
pub struct SweepOptions {
    /// Path of a JSON file that lists the views. Each view is an object with `name`, `scene` and
    /// any other fields of a view, by their [names](Field::name).
    pub views: PathBuf,
    /// Folder for the results. If it already holds a sweep with the same settings, that one goes
    /// on.
    pub output: PathBuf,
    /// Folder that the scenes' paths are relative to; `None` stands for the folder of `views`.
    pub scenes: Option<PathBuf>,
    /// The techniques to compare, and the number of rays.
    pub comparison: ComparisonOptions,
    /// Largest error, pixels per texel, that was set for the techniques whose text gives no size
    /// ([`limit_error`](crate::NamedTechnique::limit_error)). It is recorded with the results.
    pub max_error: Option<f64>,
    /// What the shadow maps are fitted to.
    pub fit: Fit,
    /// The backend that renders the shadow maps.
    pub backend: Backend,
    /// How much of the scenes a GPU draws.
    pub detail: DetailOptions,
    /// Whether alpha masks are ignored, so that masked materials show and cast as solid.
    pub opaque: bool,
    /// How the scenes are changed.
    pub scene: SceneOptions,
    /// Size of the pictures, pixels, for views that give no size of their own.
    pub size: [u32; 2],
    /// Command that makes the results again. The page shows it for readers to copy.
    pub command: String,
    /// Returns the caller's words for a field, for messages about failed views. The fields of a
    /// view keep their [names](Field::name).
    pub words: fn(Field) -> String,
}

/// One of the shares that a sweep's views are split into, in their order and in equal numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Number of this share, from 1.
    pub index: u32,
    /// Number of shares.
    pub count: u32,
}

/// A view that is still to be compared, and the folder for its report.
struct Pending {
    inputs: Inputs,
    place: ReportFolder,
}

/// Compares the techniques in those views of the sweep, or of a share of it, that have no valid
/// report yet. Each view is a part of the job. Then writes the tables and the page. A view that
/// fails is recorded with the reason, and tried again next time.
///
/// # Errors
/// An error if the views cannot be read, if `scenes` is not a folder, if the output folder is in
/// use or holds something else or another sweep, if the GPU that was asked for is missing or cannot
/// render a technique, or if a file cannot be written.
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

/// Joins the shares of a sweep: takes the results of the views from the folders of the shares and
/// computes nothing. Then writes the tables and the page for all views.
///
/// # Errors
/// The errors of [`sweep()`]. Also an error if a share belongs to another sweep, if a view has no
/// result, or if the shares contradict one another.
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

/// The views, executors and settings that every sweep begins with.
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
        light_size: comparison.light_size.map(|size| size.to_string()),
        opaque: options.opaque,
        full_detail: options.detail == DetailOptions::Full,
        animation: options.scene.animation.clone(),
        time_s: options.scene.animation.as_ref().map(|_| options.scene.time_s),
        without: options.scene.without.clone(),
        ground: options.scene.ground,
        fit: options.fit.name().into(),
        backend: executors.name().into(),
    };
    Ok(Begun { views, executors, settings })
}

/// Gathers the results of the views, and writes the tables and the page.
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

/// Checks that the folder does not only hold views that are missing from the file. Notes each view
/// of the folder that the file no longer lists.
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

/// Compares the techniques in the views without a valid report. A failed view counts as such.
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
    progress.backend(executors.choice());
    progress.parts(pending.len() as u64);
    let told = |error: Error| in_words_of_the_file(&error, options.words);
    let mut number = done;
    for pending in pending.chunk_by(|a, b| a.inputs.view.scene == b.inputs.view.scene) {
        let name = &pending[0].inputs.view.scene;
        let scene = open_scene(scenes, name, &options.scene).map_err(told);
        if let Ok(scene) = &scene {
            progress.scene(name, scene);
        }
        let prepared = scene.as_ref().map_err(Clone::clone).and_then(|scene| {
            let detail = Detail::new(scene, executors, &options.detail, progress).map_err(told)?;
            PreparedScene::new(scene, executors, options.opaque, options.fit, &detail).map_err(told)
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

/// Returns the views that have no valid report in the folder, and where their reports go.
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

/// Compares the techniques in one view, and stores the report or the reason for a failure.
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
        progress.chosen(comparison.chosen_view(), comparison.chosen_light());
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

/// Returns the reason for a view's failure, with the fields named as in the file of views.
fn in_words_of_the_file(error: &Error, words: fn(Field) -> String) -> String {
    error.in_words(&|field| match field.is_of_view() {
        true => field.name().to_owned(),
        false => words(field),
    })
}
