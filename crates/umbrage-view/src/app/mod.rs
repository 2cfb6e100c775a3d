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
use crate::session::ToOpen;
use crate::settings::{LightSetting, Settings};
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
    /// Why there is no frame of the present settings.
    problem: Option<String>,
    judged: Judged,
    history: History,
    presets: Presets,
    /// The scene that is being opened: its settings, the stage it is at, and since when.
    opening: Option<(ToOpen, &'static str, Instant)>,
    /// The long job that runs, with the share that is done.
    job: Option<(String, f32)>,
    /// The technique texts as they are being edited.
    drafts: [technique::Draft; 2],
    /// The picture's area, as egui knows it.
    picture_id: Option<egui::Id>,
    picture_rect: egui::Rect,
    /// The point under the mouse: its distance along the view, metres.
    mouse_depth: Option<f64>,
    /// Size of the picture's area, pixels.
    image: [u32; 2],
    last_tick: Instant,
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
            judged: Judged::default(),
            history: History::default(),
            presets: Presets::default(),
            opening: None,
            job: None,
            drafts,
            picture_id: None,
            picture_rect: egui::Rect::ZERO,
            mouse_depth: None,
            image: [1, 1],
            last_tick: Instant::now(),
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
                    self.opening = None;
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
                    match done {
                        Ok(done) => self.say(done),
                        Err(problem) => self.complain(problem),
                    }
                }
            }
        }
    }

    fn refused(&mut self, problem: String) {
        if self.kept.driver.is_some() {
            self.kept.outcome = Outcome::Failed(problem.clone());
        }
        self.complain(problem);
    }

    fn opened(&mut self, info: Arc<SceneInfo>) {
        let Some((ToOpen { mut settings, view, clip, has_view, .. }, ..)) = self.opening.take()
        else {
            return;
        };
        if !has_view {
            let is_headlight = settings.light == LightSetting::Headlight;
            settings.begin_with(&info);
            settings.near = view.near.or(settings.near);
            settings.far = view.far.or(settings.far);
            if is_headlight {
                settings.light = LightSetting::Headlight;
            }
        }
        if let Some((word, time_s)) = clip {
            settings.clip = info.clips.iter().position(|(known, _)| *known == word);
            settings.time_s = time_s;
        }
        self.path.clone_from(&settings.scene);
        self.drafts = [0, 1].map(|i| technique::Draft::new(&settings.techniques[i]));
        self.kept.settings = settings;
        let unsaid = info.notices.len();
        if unsaid > 0 {
            let more =
                if unsaid > 1 { format!(" (and {} more)", unsaid - 1) } else { String::new() };
            self.say(format!("{}{more}", info.notices[0]));
        }
        self.info = Some(info);
        self.frame = None;
        self.asked = None;
        self.job = None;
        self.judged = Judged::default();
        self.presets = Presets::default();
        self.history = History::default();
    }

    fn take_frame(&mut self, frame: Arc<Frame>) {
        self.textures.show(&frame);
        self.history.add(&frame);
        let failed = frame.pictures.iter().find_map(|p| p.drawn.as_ref().err().map(|e| (p, e)));
        self.problem = failed.map(|(picture, problem)| format!("{}: {problem}", picture.technique));
        self.judged.frame_changed(frame.number);
        self.frame = Some(frame);
    }

    /// Asks for a frame if the last one is not what the settings say.
    fn ask(&mut self) {
        let Some(info) = &self.info else { return };
        let map = self.is_shown(Panel::Map).then_some(self.kept.shown.map);
        match self.kept.settings.request(info, self.image, map) {
            Ok(request) => {
                if self.asked.as_ref() != Some(&request) {
                    self.stage.draw(request.clone());
                    self.asked = Some(request);
                    self.problem = None;
                }
            }
            Err(problem) => self.problem = Some(problem),
        }
    }

    /// Whether the picture shows what is asked for, or cannot.
    fn is_up_to_date(&self) -> bool {
        let shows = self.frame.as_ref().is_some_and(|f| Some(&f.request) == self.asked.as_ref());
        self.opening.is_none() && (shows || self.info.is_none() || self.problem.is_some())
    }

    /// The seconds since the last frame of the window.
    fn tick(&mut self) -> f64 {
        let now = Instant::now();
        let seconds = now.duration_since(self.last_tick).min(Duration::from_millis(250));
        self.last_tick = now;
        seconds.as_secs_f64()
    }

    /// Looks after the device. Gives whether the window must be opened again.
    fn is_lost(&mut self, context: &egui::Context) -> bool {
        let Some(problem) = self.gpu.lost() else { return false };
        if self.kept.outcome != Outcome::DeviceLost {
            self.kept.outcome = Outcome::DeviceLost;
            let words = problem.split_whitespace().collect::<Vec<_>>().join(" ");
            self.complain(format!("the GPU was lost ({words}) and has been opened again"));
            let settings = self.kept.settings.clone();
            let has_view = self.info.is_some();
            let again = ToOpen { has_view, ..ToOpen::scene(&settings.scene, &settings) };
            let opening = self.opening.take().map(|(to_open, ..)| to_open);
            self.kept.to_open = Some(opening.unwrap_or(ToOpen { settings, ..again }));
            context.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        true
    }
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
        if self.is_lost(context) {
            return;
        }
        self.take_news();
        self.judged.count(&self.frame);
        self.drive(context);
    }

    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        if self.kept.outcome == Outcome::DeviceLost {
            return;
        }
        let seconds = self.tick();
        self.play(ui.ctx(), seconds);
        self.drop_files(ui.ctx());
        self.keys(ui.ctx(), seconds);
        self.bars(ui);
        self.side_panel(ui);
        self.picture(ui);
        self.windows(ui.ctx());
        self.ask();
        self.after_ui(ui.ctx());
        if self.gpu.lost().is_some() {
            // egui panics if it is to upload shapes to a device that is lost.
            ui.ctx().graphics_mut(|layers| *layers = Default::default());
        }
    }

    fn raw_input_hook(&mut self, _: &egui::Context, input: &mut egui::RawInput) {
        self.script_input(input);
    }
}
