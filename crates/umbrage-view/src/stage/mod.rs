//! The threads beside the window's: each scene has one that loads and draws it, one that traces the
//! truth, and one for jobs that take long. The window's own thread never waits for them.

mod draw;
mod errors;
mod jobs;
mod mailbox;
mod posed;
mod request;
mod scene;
mod truth;

pub(crate) use errors::{Visibility, errors};
pub(crate) use jobs::{Job, Measurement};
pub(crate) use request::{Costs, DrawnPicture, Frame, Overlay, Request, SceneInfo, Shining};
pub(crate) use scene::SceneToOpen;
pub(crate) use truth::SharedTruth;

use mailbox::Mailbox;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use umbrage_render::Gpu;

/// What the threads tell the window.
pub(crate) enum News {
    /// A scene is at this stage of being opened.
    Opening(&'static str),
    /// A scene is open, and frames of it can be drawn.
    Open(Arc<SceneInfo>),
    /// A scene could not be opened.
    Failed(String),
    /// A frame was drawn.
    Frame(Arc<Frame>),
    /// The view rests, and its truth begins to grow.
    Truth(SharedTruth),
    /// The truth grew.
    TruthGrew,
    /// Rows of a picture were read, to be compared with the truth.
    Visibility(Visibility),
    /// The device refused something.
    Refused(String),
    /// A long job is at this stage, with the share that is done.
    Job(String, f32),
    /// A technique was measured, or the planner or the device refused it.
    Measured(Measurement),
    /// A long job is done; the text tells what came of it.
    JobDone(Result<String, String>),
}

/// News of one of the scenes.
struct FromScene {
    scene: u64,
    news: News,
}

/// Sends news to the window, and wakes it.
#[derive(Clone)]
struct Reporter {
    scene: u64,
    sender: Sender<FromScene>,
    context: egui::Context,
}

impl Reporter {
    fn tell(&self, news: News) {
        // If nobody listens, the window is closed.
        let _ = self.sender.send(FromScene { scene: self.scene, news });
        self.context.request_repaint();
    }
}

/// The threads of one scene.
struct SceneThreads {
    number: u64,
    requests: Arc<Mailbox<Request>>,
    jobs: Sender<Job>,
}

impl Drop for SceneThreads {
    fn drop(&mut self) {
        // Its threads end by themselves; a window that goes on does not wait for them.
        self.requests.close();
    }
}

/// The scenes that are open: the one that is shown and, for a while, one that is being opened.
pub(crate) struct Stage {
    gpu: Gpu,
    context: egui::Context,
    sender: Sender<FromScene>,
    receiver: Receiver<FromScene>,
    shown: Option<SceneThreads>,
    coming: Option<SceneThreads>,
    frames: Arc<AtomicU64>,
    scenes: u64,
    /// Threads of all scenes that may still run.
    threads: Vec<JoinHandle<()>>,
}

impl Drop for Stage {
    /// Waits for the threads, for a while. A thread that dropped the device last would unload the
    /// driver while the program ends and the driver tidies up in its main thread, which crashes.
    fn drop(&mut self) {
        const LONGEST: Duration = Duration::from_secs(3);
        self.shown = None;
        self.coming = None;
        let began = Instant::now();
        while self.threads.iter().any(|thread| !thread.is_finished()) {
            if began.elapsed() > LONGEST {
                // The driver stays loaded to the end.
                std::mem::forget(self.gpu.clone());
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Stage {
    pub(crate) fn new(gpu: Gpu, context: egui::Context) -> Self {
        let (sender, receiver) = channel();
        let frames = Arc::new(AtomicU64::new(0));
        Self {
            gpu,
            context,
            sender,
            receiver,
            shown: None,
            coming: None,
            frames,
            scenes: 0,
            threads: Vec::new(),
        }
    }

    /// Begins to open a scene. The one that is shown stays until the new one is open.
    pub(crate) fn open(&mut self, scene: SceneToOpen) {
        self.scenes += 1;
        let reporter = Reporter {
            scene: self.scenes,
            sender: self.sender.clone(),
            context: self.context.clone(),
        };
        let requests = Arc::new(Mailbox::default());
        let (jobs, jobs_to_do) = channel();
        let threads = SceneThreads { number: self.scenes, requests: Arc::clone(&requests), jobs };
        self.coming = Some(threads);
        let (gpu, frames) = (self.gpu.clone(), Arc::clone(&self.frames));
        let run = move || scene::run(&scene, gpu, &reporter, &requests, jobs_to_do, &frames);
        self.threads.retain(|thread| !thread.is_finished());
        match std::thread::Builder::new().name("scene".into()).spawn(run) {
            Ok(thread) => self.threads.push(thread),
            Err(e) => {
                self.coming = None;
                let news = News::Failed(format!("no thread for the scene: {e}"));
                let _ = self.sender.send(FromScene { scene: self.scenes, news });
            }
        }
    }

    /// Whether a scene is being opened.
    pub(crate) fn is_opening(&self) -> bool {
        self.coming.is_some()
    }

    /// Gives up the scene that is being opened.
    pub(crate) fn cancel(&mut self) {
        // Its news are then those of a scene that nobody knows.
        self.scenes += 1;
        self.coming = None;
    }

    /// Asks for a frame of the scene that is shown.
    pub(crate) fn draw(&self, request: Request) {
        if let Some(scene) = &self.shown {
            scene.requests.put(request);
        }
    }

    /// Begins a long job with the scene that is shown.
    pub(crate) fn begin(&self, job: Job) {
        if let Some(scene) = &self.shown {
            // The receiver lives as long as the scene's threads.
            let _ = scene.jobs.send(job);
        }
    }

    /// The next news. Those of scenes that are given up or replaced are left out.
    pub(crate) fn news(&mut self) -> Option<News> {
        loop {
            let FromScene { scene, news } = self.receiver.try_recv().ok()?;
            let is_of = |threads: &Option<SceneThreads>| {
                threads.as_ref().is_some_and(|threads| threads.number == scene)
            };
            match &news {
                News::Open(_) if is_of(&self.coming) => self.shown = self.coming.take(),
                News::Failed(_) if is_of(&self.coming) => self.coming = None,
                News::Failed(_) if scene == self.scenes => {}
                _ if is_of(&self.shown) || is_of(&self.coming) => {}
                _ => continue,
            }
            return Some(news);
        }
    }

    /// Number of frames drawn so far.
    pub(crate) fn frames(&self) -> u64 {
        self.frames.load(Ordering::Relaxed)
    }
}
