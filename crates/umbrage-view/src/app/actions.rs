//! Does what a user or a script asks for.

use super::{App, technique::Draft};
use crate::action::{Action, Copied, Panel, Theme};
use crate::pose::Pose;
use crate::session::to_open;
use crate::settings::{LightSetting, TRUTH};
use crate::stage::Job;
use crate::sun::Sun;
use egui::{Context, ThemePreference};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use umbrage_lab::{NamedTechnique, PRESETS, Session};
use umbrage_scene::Lens;

impl App<'_> {
    pub(super) fn act_all(&mut self, context: &Context, actions: Vec<Action>) {
        actions.into_iter().for_each(|action| self.act(context, action));
    }

    /// Does something, or tells why it cannot be done.
    pub(super) fn act(&mut self, context: &Context, action: Action) {
        if let Err(problem) = self.try_to(context, action) {
            self.complain(problem);
        }
    }

    fn try_to(&mut self, context: &Context, action: Action) -> Result<(), String> {
        let settings = &mut self.kept.settings;
        match action {
            Action::Open(path) => return self.open_path(&path),
            Action::Technique(index, text) => {
                if !(index == 1 && text == TRUTH) {
                    text.parse::<NamedTechnique>().map_err(|e| e.to_string())?;
                }
                if self.drafts[index].text != text && text != TRUTH {
                    self.drafts[index] = Draft::new(&text);
                }
                settings.techniques[index] = text;
            }
            Action::Compare(compare) => settings.compare = compare,
            Action::Wipe(at) => self.kept.shown.wipe = at.clamp(0.0, 1.0),
            Action::Overlay(overlay) => {
                if let Some(reason) = self.info.as_ref().and_then(|info| overlay.refusal(info)) {
                    return Err(reason.into());
                }
                settings.overlay = overlay;
            }
            Action::Fit(fit) => settings.fit = fit,
            Action::Sun { azimuth_deg, elevation_deg } => {
                settings.light = LightSetting::Sun(Sun { azimuth_deg, elevation_deg });
            }
            Action::Hour(hour) => {
                if Sun::at_hour(hour).elevation_deg <= 0.0 {
                    return Err(format!(
                        "at {hour} the sun is below the horizon; take 4.5 to 19.5"
                    ));
                }
                settings.light = LightSetting::Hour(hour);
            }
            Action::Headlight => settings.light = LightSetting::Headlight,
            Action::Light(word) => {
                let info = self.info.as_ref().ok_or("no scene is open")?;
                if !info.lights.iter().any(|(name, _)| *name == word) {
                    let names: Vec<&str> = info.lights.iter().map(|(n, _)| n.as_str()).collect();
                    return Err(format!(
                        "the scene has no light `{word}`; it has {}",
                        listed(&names)
                    ));
                }
                settings.light = LightSetting::Named(word);
            }
            Action::LightSize(size) => settings.light_size = size,
            Action::Camera(word) => {
                let info = self.info.clone().ok_or("no scene is open")?;
                let Some((name, view)) = info.cameras.iter().find(|(name, _)| *name == word) else {
                    let names: Vec<&str> = info.cameras.iter().map(|(n, _)| n.as_str()).collect();
                    return Err(format!(
                        "the scene has no camera `{word}`; it has {}",
                        listed(&names)
                    ));
                };
                settings.look_from(Some(name.clone()), view, &info);
            }
            Action::Stand([eye, target]) => {
                for position in [eye, target] {
                    umbrage_lab::values::position(position)?;
                }
                if eye == target {
                    return Err("the eye must not be at the target".into());
                }
                settings.pose = Pose::new(eye, target, settings.pose.up);
                settings.moved();
            }
            Action::Fov(degrees) => {
                let degrees = umbrage_lab::values::opening(degrees)?;
                settings.lens = Lens::Perspective { fov_y_rad: degrees.to_radians() };
                settings.moved();
            }
            Action::Ortho(height) => {
                let height = umbrage_lab::values::metres(height)?;
                settings.lens = Lens::Orthographic { height };
                settings.moved();
            }
            Action::Reset => {
                let info = self.info.clone().ok_or("no scene is open")?;
                settings.begin_with(&info);
            }
            Action::Orbit(turn) => {
                let [right, up] = turn.map(f64::to_radians);
                settings.pose.orbit(right, up);
                settings.moved();
            }
            Action::Look(turn) => {
                let [right, up] = turn.map(f64::to_radians);
                settings.pose.look(right, up);
                settings.moved();
            }
            Action::Walk(step) => {
                settings.pose.walk(step);
                settings.moved();
            }
            Action::Approach(share) => {
                match &mut settings.lens {
                    Lens::Perspective { .. } => settings.pose.approach(share),
                    // Going nearer would not make anything larger.
                    Lens::Orthographic { height } => {
                        *height = (*height * share).clamp(1e-6, 1e11);
                    }
                }
                settings.moved();
            }
            Action::Fly(is_flying) => settings.is_flying = is_flying,
            Action::Freeze(is_frozen) => {
                let camera = self.frame.as_ref().map(|frame| frame.request.camera);
                settings.frozen = camera.filter(|_| is_frozen);
            }
            Action::CountErrors(counts) => settings.counts_errors = counts,
            Action::Panel(panel, is_shown) => self.show(panel, is_shown),
            Action::Clip(_) | Action::Play(true) | Action::Seek(_) if self.needs_rest => {
                return Err("wait until the running job is done: it needs the scene at rest".into());
            }
            Action::Clip(place) => {
                let clips = self.info.as_ref().map_or(0, |info| info.clips.len());
                if place > clips {
                    return Err(format!("the scene has {clips} animations, no number {place}"));
                }
                settings.clip = place.checked_sub(1);
                settings.time_s = 0.0;
                settings.is_playing &= settings.clip.is_some();
            }
            Action::Play(is_playing) => {
                if is_playing && settings.clip.is_none() {
                    if self.info.as_ref().is_none_or(|info| info.clips.is_empty()) {
                        return Err("the scene has no animations".into());
                    }
                    settings.clip = Some(0);
                }
                settings.is_playing = is_playing;
            }
            Action::Seek(seconds) => settings.time_s = seconds.max(0.0),
            Action::TryThese => {
                self.check_rest()?;
                self.show(Panel::TryThese, true);
                self.measure_presets();
            }
            Action::Preset(name) => {
                let preset = PRESETS.iter().find(|preset| preset.name == name);
                let preset = preset.ok_or_else(|| format!("there is no preset `{name}`"))?;
                return self.try_to(context, Action::Technique(0, preset.shadows.to_owned()));
            }
            Action::Theme(theme) => {
                self.kept.shown.theme = match theme {
                    Theme::Dark => ThemePreference::Dark,
                    Theme::Light => ThemePreference::Light,
                    Theme::System => ThemePreference::System,
                };
                self.apply_look(context);
            }
            Action::Scale(scale) => {
                self.kept.shown.scale = scale.clamp(0.5, 3.0);
                self.apply_look(context);
            }
            Action::Resolution(share) => settings.resolution = share.clamp(0.1, 1.0),
            Action::Save(path) => {
                let frame = self.frame.clone().ok_or("there is no picture yet")?;
                self.begin("saving", Job::Save { frame, picture: 0, path });
            }
            Action::Turntable(count, folder) => return self.turntable(count, folder),
            Action::SaveSession(path) => {
                self.session()?.write(&path).map_err(|e| e.to_string())?;
                self.say(format!("saved {}; open it with umbrage view", path.display()));
            }
            Action::Copy(what) => {
                let technique = self.kept.settings.techniques[0].clone();
                let text = match what {
                    Copied::Specification => technique,
                    Copied::Command => self.session()?.render_command(),
                    Copied::Code => {
                        let technique: NamedTechnique =
                            technique.parse().map_err(|e| format!("{e}"))?;
                        technique.technique().rust_code()
                    }
                };
                context.copy_text(text.clone());
                self.say(format!("copied: {text}"));
            }
        }
        Ok(())
    }

    /// Refuses jobs that draw the scene by themselves while an animation moves it.
    fn check_rest(&self) -> Result<(), String> {
        match self.kept.settings.clip {
            Some(_) => Err("this needs the scene at rest; choose `at rest` first".into()),
            None => Ok(()),
        }
    }

    fn turntable(&mut self, count: u32, folder: PathBuf) -> Result<(), String> {
        self.check_rest()?;
        let info = self.info.clone().ok_or("no scene is open")?;
        let frame = self.frame.clone().ok_or("there is no picture yet")?;
        let settings = &self.kept.settings;
        let cameras = (0..count).map(|i| {
            let mut pose = settings.pose;
            pose.orbit(TAU * f64::from(i) / f64::from(count), 0.0);
            settings.camera_at(&pose, &info, self.image).map_err(|e| e.to_string())
        });
        let cameras = cameras.collect::<Result<Vec<_>, _>>()?;
        let technique = settings.techniques[0].parse().map_err(|e| format!("{e}"))?;
        let job = Job::Turntable { technique, cameras, light: frame.light, folder };
        self.begin("turntable", job);
        Ok(())
    }

    /// What is set, as a session.
    fn session(&self) -> Result<Session, String> {
        let info = self.info.as_ref().ok_or("no scene is open")?;
        self.kept.settings.session(info, self.image)
    }

    /// Opens a scene or a session.
    fn open_path(&mut self, path: &Path) -> Result<(), String> {
        let to_open = to_open(path, &self.kept.settings)?;
        self.open(to_open);
        Ok(())
    }
}

/// Names for a message.
fn listed(names: &[&str]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
