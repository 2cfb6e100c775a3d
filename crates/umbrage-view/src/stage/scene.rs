//! The thread that opens a scene and then draws it.

use super::draw::Artist;
use super::jobs::{Job, do_jobs};
use super::mailbox::{Mail, Mailbox};
use super::posed::boxes_in_motion;
use super::request::{Request, SceneInfo};
use super::truth::{TruthJob, trace_jobs};
use super::{News, Reporter};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc::Receiver;
use std::time::Duration;
use umbrage_lab::{
    Detail, DetailOptions, Executors, Fit, LightOptions, PreparedScene, SceneOptions, ViewOptions,
    choose_light, choose_view, open_scene,
};
use umbrage_render::Gpu;

/// A scene to open, and the view and light to begin with.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneToOpen {
    /// A path, or the name of a built-in scene.
    pub(crate) name: String,
    pub(crate) changes: SceneOptions,
    /// A word that chooses the animation to begin with.
    pub(crate) clip: Option<String>,
    /// Whether alpha masks are ignored.
    pub(crate) opaque: bool,
    pub(crate) view: ViewOptions,
    pub(crate) light: LightOptions,
}

/// After this time without a new request a view rests. Then what takes longer than a frame is
/// done: truth and errors.
const REST: Duration = Duration::from_millis(150);

/// Opens a scene and draws what is requested, until there are no requests any more.
pub(super) fn run(
    scene: &SceneToOpen,
    gpu: Gpu,
    reporter: &Reporter,
    requests: &Mailbox<Request>,
    jobs: Receiver<Job>,
    frames: &AtomicU64,
) {
    let drawn = catch_unwind(AssertUnwindSafe(|| {
        open_and_draw(scene, gpu, reporter, requests, jobs, frames)
    }));
    match drawn {
        Ok(Ok(())) => {}
        Ok(Err(problem)) => reporter.tell(News::Failed(problem)),
        Err(_) => reporter.tell(News::Failed(format!("{}: the program failed", scene.name))),
    }
}

/// Closes a mailbox when it is dropped.
struct Closing<'a, T>(&'a Mailbox<T>);

impl<T> Drop for Closing<'_, T> {
    fn drop(&mut self) {
        self.0.close();
    }
}

fn open_and_draw(
    to_open: &SceneToOpen,
    gpu: Gpu,
    reporter: &Reporter,
    requests: &Mailbox<Request>,
    jobs: Receiver<Job>,
    frames: &AtomicU64,
) -> Result<(), String> {
    let stage = |name| match requests.is_pending() {
        // Nothing is requested of a scene that is not open, so its window has given it up.
        true => Err(String::new()),
        false => {
            reporter.tell(News::Opening(name));
            Ok(())
        }
    };
    stage("reading")?;
    let SceneToOpen { name, changes, clip, opaque, view, light } = to_open;
    let scene = open_scene(Path::new(""), name, changes).map_err(|e| e.to_string())?;
    let choices = scene.animation_choices();
    let find = |word: &String| {
        choices.find(word).ok_or_else(|| format!("the scene has no animation `{word}`"))
    };
    let clip = clip.as_ref().map(find).transpose()?;
    stage("preparing")?;
    let executors = Executors::with_gpu(gpu);
    // Scenes that move have no levels of detail.
    let detail = match scene.animation_choices().is_empty() {
        true => DetailOptions::Auto,
        false => DetailOptions::Full,
    };
    let detail = Detail::new(&scene, &executors, &detail, &()).map_err(|e| e.to_string())?;
    let prepared = PreparedScene::new(&scene, &executors, *opaque, Fit::Surfaces, &detail)
        .map_err(|e| e.to_string())?;
    stage("choosing a view")?;
    let chosen = choose_view(view, prepared.defaults()).map_err(|e| e.to_string())?;
    let chosen_light = choose_light(light, prepared.defaults()).map_err(|e| e.to_string())?;
    let cameras = SceneInfo::words(&scene.camera_choices()).into_iter();
    let lights = SceneInfo::words(&scene.light_choices()).into_iter();
    let in_motion = boxes_in_motion(&scene);
    let mut boxes = prepared.render().tracer().boxes(umbrage_lab::SURFACE_BOXES);
    boxes.extend_from_slice(&in_motion);
    let clips = SceneInfo::words(&scene.animation_choices()).into_iter();
    let clips = clips.zip(scene.animations.clips().iter().map(|clip| clip.duration_s));
    let notices = scene.all_notices().into_iter().map(|n| n.0);
    let info = SceneInfo {
        name: name.clone(),
        cameras: cameras.zip(scene.cameras.iter().cloned()).collect(),
        lights: lights.zip(scene.lights.iter().map(|l| l.light)).collect(),
        clips: clips.collect(),
        notices: notices.chain(chosen.notices).collect(),
        bounds: in_motion.into_iter().fold(scene.bounds(), umbrage::Aabb::union),
        boxes,
        view: chosen.view,
        view_name: chosen.name,
        light: chosen_light.light,
        light_name: chosen_light.name,
        clip,
        triangles: scene.drawn_triangles(),
        has_clusters: prepared.render().on_gpu().is_some_and(|(_, scene)| scene.has_clusters()),
    };
    let mut artist = Artist::new(&prepared, reporter, frames).ok_or("there is no GPU")?;
    reporter.tell(News::Open(Arc::new(info)));
    let truths = Mailbox::<TruthJob>::default();
    std::thread::scope(|scope| {
        let tracer = prepared.render().tracer();
        // However this ends, the thread that waits for truths to trace ends, too.
        let closing = Closing(&truths);
        scope.spawn(|| trace_jobs(tracer, &truths, frames, || reporter.tell(News::TruthGrew)));
        let prepared = &prepared;
        scope.spawn(move || do_jobs(prepared, &jobs, requests, reporter));
        let mut rests = true;
        loop {
            match requests.take((!rests).then_some(REST)) {
                Mail::New(request) => {
                    artist.draw(request);
                    rests = false;
                }
                Mail::None => {
                    artist.rest(&truths, &|| requests.is_pending());
                    rests = true;
                }
                Mail::Closed => break,
            }
        }
        drop(closing);
    });
    Ok(())
}
