//! Drives the window by a script.

use super::App;
use super::controls::{Tipped, tipped_id};
use crate::Outcome;
use crate::action::Action;
use crate::script::{Command, Step, Wait};
use crate::stage::Frame;
use egui::{Context, Event, PointerButton, Pos2, RawInput, ViewportCommand, vec2};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Goes through a script, step by step.
pub(crate) struct Driver {
    steps: VecDeque<Step>,
    /// Where pictures go.
    folder: PathBuf,
    /// When the present step began, and the number of frames at that time.
    began: Option<(Instant, u64)>,
    /// Frames of the window since the present step began.
    shown: u64,
    /// Events for the next frames of the window.
    events: VecDeque<Vec<Event>>,
    /// A picture of the window that is on its way.
    shot: Option<Shot>,
    /// Memory in use when it was last noted.
    memory: Option<Memory>,
    /// Whether the present step has begun to open something.
    is_loading: bool,
    /// Frames of the window in which nothing must happen, so that it can settle.
    rest: u32,
}

struct Shot {
    name: String,
    image: Arc<Mutex<Option<Arc<egui::ColorImage>>>>,
}

/// What is in use.
#[derive(Clone, Copy, Debug)]
struct Memory {
    /// Memory of the process, bytes; 0 where the system does not tell.
    resident: u64,
    /// Memory of the device's textures and buffers, and the number of views of textures and of
    /// buffers. wgpu 30 does not count textures.
    device_bytes: u64,
    views: u64,
    buffers: u64,
}

/// Views and buffers of frames that are on their way, of which there are sometimes more than at
/// other times.
const ON_THEIR_WAY: u64 = 8;

/// No step takes longer than this.
const TOO_LONG: Duration = Duration::from_secs(300);

impl Driver {
    pub(crate) fn new(steps: Vec<Step>, folder: PathBuf) -> Self {
        Self {
            steps: steps.into(),
            folder,
            began: None,
            shown: 0,
            events: VecDeque::new(),
            shot: None,
            memory: None,
            is_loading: false,
            rest: 0,
        }
    }

    /// Whether a step can be done, or must be waited for.
    fn is_ready(&self) -> bool {
        self.events.is_empty() && self.rest == 0
    }
}

/// What a step came to.
enum Done {
    Yes,
    NotYet,
    Failed(String),
}

impl App<'_> {
    /// Takes the next steps of the script.
    pub(super) fn drive(&mut self, context: &Context) {
        let Some(mut driver) = self.kept.driver.take() else { return };
        context.request_repaint_after_secs(0.02);
        if let Outcome::Failed(_) = self.kept.outcome {
            context.send_viewport_cmd(ViewportCommand::Close);
            driver.steps.clear();
            driver.rest = u32::MAX;
        }
        // What is done while a scene is being opened would be lost.
        let is_waiting = self
            .opening
            .as_ref()
            .is_some_and(|(.., since)| !driver.is_loading && since.elapsed() < TOO_LONG);
        while driver.is_ready() && !is_waiting {
            let Some(step) = driver.steps.front().cloned() else {
                self.kept.outcome = Outcome::Closed;
                context.send_viewport_cmd(ViewportCommand::Close);
                break;
            };
            let began = *driver.began.get_or_insert((Instant::now(), self.stage.frames()));
            let done = match began.0.elapsed() > TOO_LONG {
                true => Done::Failed("takes too long".into()),
                false => self.step(context, &mut driver, &step.command, began),
            };
            match done {
                Done::NotYet => break,
                Done::Yes => {
                    log::info!("line {}: done in {:.2?}", step.line, began.0.elapsed());
                    driver.steps.pop_front();
                    driver.began = None;
                    driver.shown = 0;
                }
                Done::Failed(problem) => {
                    self.kept.outcome = Outcome::Failed(format!("line {}: {problem}", step.line));
                    context.send_viewport_cmd(ViewportCommand::Close);
                    driver.steps.clear();
                    break;
                }
            }
        }
        self.kept.driver = Some(driver);
    }

    fn step(
        &mut self,
        context: &Context,
        driver: &mut Driver,
        command: &Command,
        (began, frames): (Instant, u64),
    ) -> Done {
        let press = |driver: &mut Driver, modifiers, key| {
            let event =
                |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
            let held = Event::ModifiersChanged(modifiers);
            let released = Event::ModifiersChanged(egui::Modifiers::NONE);
            driver.events.push_back(vec![held, event(true)]);
            driver.events.push_back(vec![event(false), released]);
        };
        let button = |pos: Pos2, pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        };
        match command {
            Command::Do(action) => {
                let before = self.kept.message.as_ref().map(|m| m.since);
                self.act(context, action.clone());
                driver.rest = 2;
                let new = self.kept.message.as_ref().filter(|m| Some(m.since) != before);
                match new.filter(|m| m.is_error) {
                    Some(message) => Done::Failed(message.text.clone()),
                    None => Done::Yes,
                }
            }
            Command::Load(path, succeeds) => self.load(context, driver, path, *succeeds),
            Command::Quit => {
                driver.steps.clear();
                Done::Yes
            }
            Command::Wait(wait) => {
                let is_over = match *wait {
                    Wait::Time(time) => began.elapsed() >= time,
                    Wait::Frames(count) => driver.shown >= count && self.is_up_to_date(),
                    Wait::Turns(count) => {
                        if self.is_up_to_date() {
                            self.act(context, Action::Orbit([1.0, 0.0]));
                        }
                        self.stage.frames() >= frames + count
                    }
                    Wait::Ready => self.is_up_to_date() && began.elapsed().as_millis() > 50,
                    Wait::Truth => {
                        let is_done = |frame: &Arc<Frame>| self.judged.is_done(frame);
                        self.is_up_to_date() && self.frame.as_ref().is_some_and(is_done)
                    }
                    Wait::Jobs => self.job.is_none(),
                };
                if is_over { Done::Yes } else { Done::NotYet }
            }
            Command::Shoot(name) => self.shoot(context, driver, name),
            Command::Size([width, height]) => {
                let size = vec2(*width, *height);
                let is_it = context.input(|i| i.viewport_rect().size()) - size;
                if is_it.abs().max_elem() < 2.0 || began.elapsed() > Duration::from_secs(3) {
                    driver.rest = 3;
                    return Done::Yes;
                }
                context.send_viewport_cmd(ViewportCommand::InnerSize(size));
                Done::NotYet
            }
            Command::Minimise => {
                context.send_viewport_cmd(ViewportCommand::Minimized(true));
                Done::Yes
            }
            Command::Restore => {
                context.send_viewport_cmd(ViewportCommand::Minimized(false));
                driver.rest = 3;
                Done::Yes
            }
            Command::Press(modifiers, key) => {
                press(driver, *modifiers, *key);
                Done::Yes
            }
            Command::Click([x, y]) => {
                let pos = Pos2::new(*x, *y);
                driver.events.push_back(vec![Event::PointerMoved(pos)]);
                driver.events.push_back(vec![button(pos, true)]);
                driver.events.push_back(vec![button(pos, false)]);
                Done::Yes
            }
            Command::Drag([x, y, to_x, to_y]) => {
                const STEPS: u32 = 8;
                let (from, to) = (Pos2::new(*x, *y), Pos2::new(*to_x, *to_y));
                driver.events.push_back(vec![Event::PointerMoved(from)]);
                driver.events.push_back(vec![button(from, true)]);
                for i in 1..=STEPS {
                    let at = from + (to - from) * (i as f32 / STEPS as f32);
                    driver.events.push_back(vec![Event::PointerMoved(at)]);
                }
                driver.events.push_back(vec![button(to, false), Event::PointerGone]);
                Done::Yes
            }
            Command::Type(text) => {
                driver.events.push_back(vec![Event::Text(text.clone())]);
                Done::Yes
            }
            Command::Memory(most_growth) => self.check_memory(driver, *most_growth),
            Command::CheckTooltips => check_tooltips(context),
            Command::Expect(text) => match &self.kept.message {
                Some(message) if message.text.contains(text) => Done::Yes,
                _ if began.elapsed() < Duration::from_secs(20) => Done::NotYet,
                message => {
                    let shown = message.as_ref().map_or("none", |m| m.text.as_str());
                    Done::Failed(format!("expected the message `{text}`, there is `{shown}`"))
                }
            },
            Command::LoseDevice => {
                self.lose_device(context);
                // The window is opened again, with the rest of the script.
                driver.rest = 5;
                Done::Yes
            }
        }
    }

    /// Opens a scene or session, and waits until that has succeeded or failed.
    fn load(
        &mut self,
        context: &Context,
        driver: &mut Driver,
        path: &Path,
        succeeds: bool,
    ) -> Done {
        if !std::mem::replace(&mut driver.is_loading, true) {
            self.kept.message = None;
            self.act(context, Action::Open(path.to_owned()));
            return Done::NotYet;
        }
        if self.opening.is_some() {
            return Done::NotYet;
        }
        driver.is_loading = false;
        let problem = self.kept.message.as_ref().filter(|m| m.is_error).map(|m| m.text.clone());
        match (problem, succeeds) {
            (Some(problem), true) => Done::Failed(problem),
            (None, false) => Done::Failed(format!("{} was opened", path.display())),
            _ => Done::Yes,
        }
    }

    /// Destroys the device, and waits until it tells so: nothing may be painted with it any more.
    fn lose_device(&mut self, context: &Context) {
        const LONGEST: Duration = Duration::from_secs(5);
        let began = Instant::now();
        self.gpu.device().destroy();
        while !self.is_lost(context) && began.elapsed() < LONGEST {
            // An error is what is waited for.
            let _ = self.gpu.device().poll(wgpu::PollType::Poll);
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn shoot(&mut self, context: &Context, driver: &mut Driver, name: &str) -> Done {
        if driver.shot.is_none() && !self.is_up_to_date() {
            return Done::NotYet;
        }
        let Some(shot) = driver.shot.as_ref().filter(|shot| shot.name == name) else {
            let image = Arc::new(Mutex::new(None));
            let taken = Arc::clone(&image);
            let waker = context.clone();
            let callback = egui::ScreenshotCallback::new(move |shot| {
                *taken.lock().unwrap_or_else(PoisonError::into_inner) = Some(shot);
                waker.request_repaint();
            });
            context.send_viewport_cmd(ViewportCommand::Screenshot(callback));
            driver.shot = Some(Shot { name: name.to_owned(), image });
            return Done::NotYet;
        };
        let taken = shot.image.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(taken) = taken else { return Done::NotYet };
        driver.shot = None;
        let path = driver.folder.join(format!("{name}.png"));
        let size = [taken.size[0] as u32, taken.size[1] as u32];
        let pixels = taken.pixels.iter().map(|p| [p.r(), p.g(), p.b()]).collect();
        let written = umbrage_measure::Image::new(size, pixels)
            .and_then(|image| umbrage_measure::write_png(&path, &image));
        match written {
            Ok(()) => Done::Yes,
            Err(e) => Done::Failed(e.to_string()),
        }
    }

    fn check_memory(&mut self, driver: &mut Driver, most_growth: Option<f64>) -> Done {
        let now = Memory::now(&self.gpu);
        log::info!("memory: {now:?}");
        let before = driver.memory.replace(now);
        let (Some(most), Some(before)) = (most_growth, before) else { return Done::Yes };
        let has_grown = |before: u64, now: u64, what: &str| {
            let limit = before as f64 * (1.0 + most);
            (now as f64 > limit).then(|| format!("{what} grew from {before} to {now}"))
        };
        let grown = [
            has_grown(before.resident, now.resident, "memory"),
            has_grown(before.device_bytes, now.device_bytes, "memory of the device"),
            has_grown(before.views + ON_THEIR_WAY, now.views, "the number of views"),
            has_grown(before.buffers + ON_THEIR_WAY, now.buffers, "the number of buffers"),
        ];
        match grown.into_iter().flatten().next() {
            Some(problem) => Done::Failed(problem),
            None => Done::Yes,
        }
    }

    /// Gives the window the events of the script.
    pub(super) fn script_input(&mut self, input: &mut RawInput) {
        let Some(driver) = &mut self.kept.driver else { return };
        driver.rest = driver.rest.saturating_sub(1);
        driver.shown += 1;
        if let Some(events) = driver.events.pop_front() {
            input.events.extend(events);
            if driver.events.is_empty() {
                driver.rest = 3;
            }
        }
    }

    /// Keeps a script going while nothing moves.
    pub(super) fn after_ui(&self, context: &Context) {
        if self.kept.driver.is_some() {
            context.request_repaint();
        }
    }
}

/// Fails if a control of the last frame has no tooltip.
fn check_tooltips(context: &Context) -> Done {
    let tipped = context.data(|data| data.get_temp::<Tipped>(tipped_id())).unwrap_or_default();
    let lacking: Vec<String> = context.viewport(|viewport| {
        let widgets = &viewport.prev_pass.widgets;
        // The edge of a panel shows by the mouse's cursor what it does.
        let is_edge = |w: &egui::WidgetRect| w.rect.size().min_elem() < 8.0;
        let is_control = |w: &&egui::WidgetRect| {
            let can_press = w.sense.senses_click() && w.sense.is_focusable();
            w.enabled && w.visible && can_press && !is_edge(w)
        };
        let mut lacking = Vec::new();
        for (layer, of_layer) in widgets.layers() {
            let areas = tipped.0.iter().filter(|(of, _)| of == layer);
            let areas: Vec<egui::Rect> = areas.map(|(_, area)| area.expand(0.5)).collect();
            let has_none =
                |w: &&egui::WidgetRect| !areas.iter().any(|area| area.contains_rect(w.rect));
            let without = of_layer.iter().filter(is_control).filter(has_none);
            lacking.extend(without.map(|w| format!("{:?} at {:?}", widgets.info(w.id), w.rect)));
        }
        lacking
    });
    match lacking.first() {
        Some(first) => Done::Failed(format!("{} controls without tooltip: {first}", lacking.len())),
        None => Done::Yes,
    }
}

impl Memory {
    fn now(gpu: &umbrage_render::Gpu) -> Self {
        let counters = gpu.device().get_internal_counters().hal;
        let device_bytes =
            counters.buffer_memory.read() as u64 + counters.texture_memory.read() as u64;
        Self {
            resident: resident_bytes().unwrap_or(0),
            device_bytes,
            views: counters.texture_views.read() as u64,
            buffers: counters.buffers.read() as u64,
        }
    }
}

/// Memory of this process that is not swapped out, bytes; only Linux tells.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
