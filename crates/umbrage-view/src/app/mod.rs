//! The window's contents, on the window's own thread. It never waits: what takes long is done by
//! the [stage](crate::stage)'s threads.

mod actions;
mod controls;
mod input;
mod lines;
mod measured;
mod picture;
mod script;
mod technique;
mod textures;
mod windows;

use crate::Outcome;
use crate::action::Panel;
use crate::session::{Kind, ToOpen};
use crate::settings::{LightSetting, OverlayKind, Settings};
use crate::stage::{Frame, Job, News, Request, SceneInfo, SceneToOpen, Stage};
use egui::Ui;
use measured::{History, Judged, Presets};
pub(crate) use script::Driver;
use std::sync::Arc;
use std::time::{Duration, Instant};
use textures::Textures;
use umbrage_render::Gpu;

/// A message to the user.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    pub(crate) text: String,
    pub(crate) is_error: bool,
    since: Instant,
}

/// What outlives the loss of a device, after which the window is opened again.
pub(crate) struct Kept {
    pub(crate) settings: Settings,
    pub(crate) shown: Shown,
    pub(crate) message: Option<Message>,
    pub(crate) driver: Option<Driver>,
    /// What the window's life came to.
    pub(crate) outcome: Outcome,
    /// When the window was asked for, until it is open.
    pub(crate) began: Option<Instant>,
    /// What to open at the beginning.
    pub(crate) to_open: Option<ToOpen>,
}

/// Which parts of the window are shown, and how.
#[derive(Clone, Debug)]
pub(crate) struct Shown {
    panels: Vec<Panel>,
    theme: egui::ThemePreference,
    /// Factor by which controls are larger than usual.
    scale: f32,
    /// Where the line of a wipe is, as a share of the picture's width.
    wipe: f32,
    /// Index of the map that is shown.
    map: usize,
}

impl Default for Shown {
    fn default() -> Self {
        Self {
            panels: vec![Panel::Controls],
            theme: egui::ThemePreference::System,
            scale: 1.0,
            wipe: 0.5,
            map: 0,
        }
    }
}

/// The window.
pub(crate) struct App<'k> {
    kept: &'k mut Kept,
    gpu: Gpu,
    stage: Stage,
    textures: Textures,
    info: Option<Arc<SceneInfo>>,
    /// The newest frame, and the request that was sent last.
    frame: Option<Arc<Frame>>,
    asked: Option<Request>,
    /// What is wrong with the present settings or with their frame.
    problem: Option<String>,
    /// Whether no frame can be asked for with the present settings.
    is_impossible: bool,
    judged: Judged,
    history: History,
    presets: Presets,
    /// The scene that is being opened: its settings, the stage it is at, and since when.
    opening: Option<(ToOpen, &'static str, Instant)>,
    /// The long job that runs, with the share that is done.
    job: Option<(String, f32)>,
    /// Whether the job that runs needs the scene at rest.
    needs_rest: bool,
    /// The technique texts as they are being edited.
    drafts: [technique::Draft; 2],
    /// The picture's area, as egui knows it.
    picture_id: Option<egui::Id>,
    picture_rect: egui::Rect,
    /// Whether the present drag moves the line of a wipe.
    is_wiping: bool,
    /// The point under the mouse: its distance along the view, metres.
    mouse_depth: Option<f64>,
    /// Size of the picture's area, pixels.
    image: [u32; 2],
    /// When the window was asked for, until its first picture is drawn.
    first_picture: Option<Instant>,
    /// The text in the field for a scene's name or path.
    path: String,
}

impl<'k> App<'k> {
    pub(crate) fn new(
        kept: &'k mut Kept,
        context: &egui::Context,
        state: egui_wgpu::RenderState,
    ) -> Result<Self, String> {
        let (device, queue) = (state.device.clone(), state.queue.clone());
        let gpu = Gpu::from_device(&state.adapter, device, queue).map_err(|e| e.to_string())?;
        let stage = Stage::new(gpu.clone(), context.clone());
        let drafts = [0, 1].map(|i| technique::Draft::new(&kept.settings.techniques[i]));
        let path = kept.settings.scene.clone();
        let mut app = Self {
            kept,
            gpu,
            stage,
            textures: Textures::new(state),
            info: None,
            frame: None,
            asked: None,
            problem: None,
            is_impossible: false,
            judged: Judged::default(),
            history: History::default(),
            presets: Presets::default(),
            opening: None,
            job: None,
            needs_rest: false,
            drafts,
            picture_id: None,
            picture_rect: egui::Rect::ZERO,
            is_wiping: false,
            mouse_depth: None,
            image: [1, 1],
            first_picture: None,
            path,
        };
        app.apply_look(context);
        if let Some(to_open) = app.kept.to_open.take() {
            app.open(to_open);
        }
        Ok(app)
    }

    /// Makes the context's colours and sizes those that are chosen.
    fn apply_look(&self, context: &egui::Context) {
        context.set_theme(self.kept.shown.theme);
        context.set_zoom_factor(self.kept.shown.scale);
    }

    fn is_shown(&self, panel: Panel) -> bool {
        self.kept.shown.panels.contains(&panel)
    }

    fn show(&mut self, panel: Panel, is_shown: bool) {
        self.kept.shown.panels.retain(|&p| p != panel);
        if is_shown {
            self.kept.shown.panels.push(panel);
        }
    }

    fn say(&mut self, text: impl Into<String>) {
        self.kept.message = Some(Message::new(text, false));
    }

    fn complain(&mut self, text: impl Into<String>) {
        let text = text.into();
        log::warn!("{text}");
        self.kept.message = Some(Message::new(text, true));
    }

    /// Begins to open a scene. The settings become the window's once it is open.
    fn open(&mut self, to_open: ToOpen) {
        self.stage.open(SceneToOpen {
            name: to_open.settings.scene.clone(),
            changes: to_open.settings.changes.clone(),
            clip: to_open.clip.as_ref().map(|(word, _)| word.clone()),
            opaque: to_open.settings.opaque,
            view: to_open.view.clone(),
            light: to_open.light.clone(),
        });
        self.opening = Some((to_open, "reading", Instant::now()));
    }

    fn begin(&mut self, what: &str, job: Job) {
        if self.job.is_some() {
            return self.complain("one thing at a time: wait until the running job is done");
        }
        self.job = Some((what.to_owned(), 0.0));
        self.needs_rest = matches!(job, Job::Measure { .. } | Job::Turntable { .. });
        self.stage.begin(job);
    }

    /// Takes what the stage has to tell.
    fn take_news(&mut self) {
        while let Some(news) = self.stage.news() {
            match news {
                News::Opening(stage) => {
                    if let Some((_, at, _)) = &mut self.opening {
                        *at = stage;
                    }
                }
                News::Open(info) => self.opened(info),
                News::Failed(problem) => {
                    if !self.stage.is_opening() {
                        self.opening = None;
                    }
                    self.complain(problem);
                }
                News::Frame(frame) => self.take_frame(frame),
                News::Truth(truth) => self.judged.begin(truth),
                News::TruthGrew => self.judged.is_stale = true,
                News::Visibility(visibility) => self.judged.add(visibility),
                News::Refused(problem) => self.refused(problem),
                News::Job(what, share) => self.job = Some((what, share)),
                News::Measured(measurement) => self.presets.add(measurement),
                News::JobDone(done) => {
                    self.job = None;
                    self.needs_rest = false;
                    match done {
                        Ok(done) => self.say(done),
                        Err(problem) => self.complain(problem),
                    }
                }
            }
        }
    }

    fn refused(&mut self, problem: String) {
        // What a lost device refuses is told when its loss is.
        if self.gpu.lost().is_some() {
            return;
        }
        if self.kept.driver.is_some() {
            self.kept.outcome = Outcome::Failed(problem.clone());
        }
        self.complain(problem);
    }

    fn opened(&mut self, info: Arc<SceneInfo>) {
        let Some((to_open, ..)) = self.opening.take() else { return };
        let ToOpen { mut settings, view, clip, kind, .. } = to_open;
        if kind == Kind::Scene {
            settings = ToOpen::scene(&settings.scene, &self.kept.settings).settings;
        }
        if kind != Kind::Again {
            let is_headlight = settings.light == LightSetting::Headlight;
            settings.begin_with(&info);
            settings.near = view.near.or(settings.near);
            settings.far = view.far.or(settings.far);
            if kind == Kind::Session && is_headlight {
                settings.light = LightSetting::Headlight;
            }
        }
        if let Some((_, time_s)) = clip {
            settings.clip = info.clip;
            settings.time_s = time_s;
        }
        if settings.overlay.refusal(&info).is_some() {
            settings.overlay = OverlayKind::None;
        }
        self.path.clone_from(&settings.scene);
        self.drafts = [0, 1].map(|i| technique::Draft::new(&settings.techniques[i]));
        self.kept.settings = settings;
        // What was said was about another scene, unless it is the loss of a device.
        self.kept.message.take_if(|_| kind != Kind::Again);
        let unsaid = info.notices.len();
        if unsaid > 0 {
            let more =
                if unsaid > 1 { format!(" (and {} more)", unsaid - 1) } else { String::new() };
            self.say(format!("{}{more}", info.notices[0]));
        }
        self.info = Some(info);
        self.textures.clear();
        self.frame = None;
        self.asked = None;
        self.job = None;
        self.needs_rest = false;
        self.judged = Judged::default();
        self.presets = Presets::default();
        self.history = History::default();
    }

    fn take_frame(&mut self, frame: Arc<Frame>) {
        if let Some(began) = self.first_picture.take() {
            log::info!("the first picture is drawn after {:.2?}", began.elapsed());
        }
        self.textures.show(&frame);
        self.history.add(&frame);
        self.judged.frame_changed(frame.number);
        self.frame = Some(frame);
    }

    /// Asks for a frame if the last one is not what the settings say.
    fn ask(&mut self) {
        let Some(info) = &self.info else { return };
        let map = self.is_shown(Panel::Map).then_some(self.kept.shown.map);
        let is_outside = self.kept.settings.frozen.is_some();
        let wants_body = is_outside || self.is_shown(Panel::LightSpace);
        let request = self.kept.settings.request(info, self.image, map, wants_body);
        self.is_impossible = request.is_err();
        match request {
            Ok(request) => {
                if self.asked.as_ref() != Some(&request) {
                    self.stage.draw(request.clone());
                    self.asked = Some(request);
                }
                self.problem = self.frame.as_deref().and_then(problem_of);
            }
            Err(problem) => self.problem = Some(problem),
        }
    }

    /// Whether the picture shows what is asked for, or cannot.
    fn is_up_to_date(&self) -> bool {
        let shows = self.frame.as_ref().is_some_and(|f| Some(&f.request) == self.asked.as_ref());
        self.opening.is_none() && (shows || self.info.is_none() || self.is_impossible)
    }

    /// Looks after the device. Gives whether the window must be opened again.
    fn is_lost(&mut self, context: &egui::Context) -> bool {
        // Whether the device is lost may only show when it is asked. Errors show in the next check.
        let _ = self.gpu.device().poll(wgpu::PollType::Poll);
        let Some(problem) = self.gpu.lost() else { return false };
        if self.kept.outcome != Outcome::DeviceLost {
            self.kept.outcome = Outcome::DeviceLost;
            let why = problem.split_whitespace().collect::<Vec<_>>().join(" ");
            let why = if why.is_empty() { why } else { format!(" ({why})") };
            self.complain(format!("the GPU was lost{why} and has been opened again"));
            let settings = self.kept.settings.clone();
            let again = ToOpen::scene(&settings.scene, &settings);
            let kind = if self.info.is_some() { Kind::Again } else { Kind::Scene };
            let opening = self.opening.take().map(|(to_open, ..)| to_open);
            self.kept.to_open = Some(opening.unwrap_or(ToOpen { settings, kind, ..again }));
            context.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        true
    }
}

/// Why one of a frame's pictures could not be drawn.
fn problem_of(frame: &Frame) -> Option<String> {
    let failed = frame.pictures.iter().find_map(|p| p.drawn.as_ref().err().map(|e| (p, e)));
    failed.map(|(picture, problem)| format!("{}: {problem}", picture.technique))
}

impl Message {
    pub(crate) fn new(text: impl Into<String>, is_error: bool) -> Self {
        Self { text: text.into(), is_error, since: Instant::now() }
    }

    /// How long a message that is no error stays.
    const STAYS: Duration = Duration::from_secs(8);

    fn is_over(&self) -> bool {
        !self.is_error && self.since.elapsed() > Self::STAYS
    }
}

impl eframe::App for App<'_> {
    fn logic(&mut self, context: &egui::Context, _: &mut eframe::Frame) {
        if !self.is_lost(context) {
            self.take_news();
            if let Some(later) = self.judged.count(&self.frame) {
                context.request_repaint_after(later);
            }
            self.drive(context);
        }
    }

    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        if self.is_lost(ui.ctx()) {
            return;
        }
        if let Some(began) = self.kept.began.take() {
            log::info!("the window is open after {:.2?}", began.elapsed());
            self.first_picture = Some(began);
        }
        // After a rest, the time since the last frame says nothing about this one.
        let seconds = f64::from(ui.input(|i| i.stable_dt).min(0.1));
        self.play(ui.ctx(), seconds);
        self.drop_files(ui.ctx());
        self.keys(ui.ctx(), seconds);
        self.bars(ui);
        self.side_panel(ui);
        self.picture(ui);
        self.windows(ui.ctx());
        self.ask();
        self.after_ui(ui.ctx());
        if self.is_lost(ui.ctx()) {
            // egui panics when it paints anything with a lost device.
            ui.ctx().graphics_mut(|graphics| *graphics = Default::default());
        }
    }

    fn raw_input_hook(&mut self, _: &egui::Context, input: &mut egui::RawInput) {
        self.script_input(input);
    }
}
