//! The bars at the top and the bottom, and the panel of controls.

use super::App;
use crate::action::{Action, Copied, Panel, Theme};
use crate::settings::{Compare, LightSetting, OverlayKind, TRUTH};
use crate::sun::Sun;
use egui::{
    CollapsingHeader, ComboBox, DragValue, Id, LayerId, ProgressBar, Rect, Response, RichText,
    ScrollArea, Slider, TextEdit, Ui,
};
use std::path::PathBuf;
use umbrage::visibility::LightSize;
use umbrage_lab::Fit;
use umbrage_scene::Lens;

/// Below this width of the window, points, the controls stand below the picture.
const NARROW: f32 = 640.0;

/// A control's tooltip. Scripts check that each control has one.
pub(super) trait Tip: Sized {
    /// Explains the control, in one sentence, to whoever rests on it.
    fn tip(self, sentence: &str) -> Self;

    /// The same for a large area, on which a tooltip would lie in the way: the sentence stands in
    /// the bar at the bottom.
    fn tip_beside(self, sentence: &'static str) -> Self;
}

impl Tip for Response {
    fn tip(self, sentence: &str) -> Self {
        note_tip(&self);
        self.on_hover_text(sentence)
    }

    fn tip_beside(self, sentence: &'static str) -> Self {
        note_tip(&self);
        if self.hovered() {
            self.ctx.data_mut(|data| data.insert_temp(hint_id(), sentence));
        }
        self
    }
}

/// The areas that have tooltips in this frame, with their layers. That of a slider holds its
/// number, and that of a plot its legend, which can be clicked.
#[derive(Clone, Default)]
pub(super) struct Tipped(pub(super) Vec<(LayerId, Rect)>);

pub(super) fn tipped_id() -> Id {
    Id::unique("controls with tooltips")
}

fn hint_id() -> Id {
    Id::unique("hint")
}

fn note_tip(response: &Response) {
    response.ctx.data_mut(|data| {
        data.get_temp_mut_or_default::<Tipped>(tipped_id())
            .0
            .push((response.layer_id, response.rect));
    });
}

impl App<'_> {
    /// The bars at the top and at the bottom.
    pub(super) fn bars(&mut self, ui: &mut Ui) {
        // A control that loses its tooltip must not be taken for one that has it.
        ui.data_mut(|data| data.remove_temp::<Tipped>(tipped_id()));
        egui::Panel::top("bar").show(ui, |ui| {
            ui.add_space(2.0);
            ui.horizontal_wrapped(|ui| self.top(ui));
            ui.add_space(2.0);
        });
        egui::Panel::bottom("state").show(ui, |ui| self.bottom(ui));
    }

    fn top(&mut self, ui: &mut Ui) {
        let mut actions = Vec::new();
        for (panel, name, tip) in Panel::ALL {
            let is_shown = self.is_shown(panel);
            if ui.selectable_label(is_shown, name).tip(tip).clicked() {
                actions.push(Action::Panel(panel, !is_shown));
            }
        }
        ui.separator();
        let settings = &self.kept.settings;
        let chosen = Compare::ALL.iter().find(|(c, ..)| *c == settings.compare);
        ComboBox::from_id_salt("compare")
            .selected_text(chosen.map_or("", |(_, name, _)| name))
            .width(96.0)
            .show_ui(ui, |ui| {
                for (compare, name, tip) in Compare::ALL {
                    let is_chosen = compare == settings.compare;
                    if ui.selectable_label(is_chosen, name).tip(tip).clicked() {
                        actions.push(Action::Compare(compare));
                    }
                }
            })
            .response
            .tip("Choose how a second technique, or the truth, is compared (C).");
        let chosen = OverlayKind::ALL.iter().find(|(o, ..)| *o == settings.overlay);
        ComboBox::from_id_salt("overlay")
            .selected_text(format!("overlay: {}", chosen.map_or("", |(_, name, _)| name)))
            .width(120.0)
            .show_ui(ui, |ui| {
                for (overlay, name, tip) in OverlayKind::ALL {
                    let refusal = self.info.as_ref().and_then(|info| overlay.refusal(info));
                    let button = egui::Button::selectable(overlay == settings.overlay, name);
                    let row = ui.add_enabled(refusal.is_none(), button);
                    let row = match refusal {
                        Some(reason) => row.on_disabled_hover_text(reason),
                        None => row,
                    };
                    if row.tip(tip).clicked() {
                        actions.push(Action::Overlay(overlay));
                    }
                }
            })
            .response
            .tip("Choose what is shown over the pictures (O).");
        let is_frozen = settings.frozen.is_some();
        if ui
            .selectable_label(is_frozen, "freeze")
            .tip("Keep the maps of this view, and fly around to see them from outside (F).")
            .clicked()
        {
            actions.push(Action::Freeze(!is_frozen));
        }
        ui.separator();
        let theme = match ui.visuals().dark_mode {
            true => ("light", Theme::Light),
            false => ("dark", Theme::Dark),
        };
        if ui.button(theme.0).tip("Change between light and dark colours.").clicked() {
            actions.push(Action::Theme(theme.1));
        }
        let mut scale = self.kept.shown.scale;
        let drag = DragValue::new(&mut scale).range(0.5..=3.0).speed(0.01).suffix("×");
        if ui.add(drag).tip("Make all controls larger or smaller.").changed() {
            actions.push(Action::Scale(scale));
        }
        self.act_all(ui.ctx(), actions);
    }

    fn bottom(&mut self, ui: &mut Ui) {
        let context = ui.ctx().clone();
        let mut is_closed = false;
        // A message must not change the picture's size, which would be drawn and traced anew.
        ui.set_min_height(ui.spacing().interact_size.y);
        ui.horizontal(|ui| {
            if let Some((what, share)) = &self.job {
                ui.add(ProgressBar::new(*share).desired_width(120.0));
                ui.label(what);
                context.request_repaint_after_secs(0.25);
            }
            if let Some(message) = self.kept.message.as_ref().filter(|m| !m.is_over()) {
                let color = match message.is_error {
                    true => ui.visuals().error_fg_color,
                    false => ui.visuals().strong_text_color(),
                };
                is_closed = ui.small_button("×").tip("Take this message away (Escape).").clicked();
                ui.add(egui::Label::new(RichText::new(&message.text).color(color)).truncate());
                context.request_repaint_after_secs(1.0);
                return;
            }
            let hint = context.data_mut(|data| data.remove_temp::<&'static str>(hint_id()));
            ui.label(RichText::new(hint.unwrap_or(self.gpu.info().name.as_str())).weak());
            if let Some(rate) = self.history.rate() {
                ui.label(RichText::new(format!("{rate:.0} frames/s")).weak());
            }
        });
        if is_closed {
            self.kept.message = None;
        }
    }

    /// The panel of controls, beside the picture or, where there is no room, below it.
    pub(super) fn side_panel(&mut self, ui: &mut Ui) {
        if !self.is_shown(Panel::Controls) {
            return;
        }
        let size = ui.max_rect().size();
        let panel = if size.x < NARROW {
            egui::Panel::bottom("controls below").resizable(true).default_size(size.y * 0.42)
        } else {
            egui::Panel::left("controls").resizable(true).default_size(330.0).min_size(220.0)
        };
        panel.show(ui, |ui| {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                section(ui, "Scene", "What is shown.", |ui| self.scene_section(ui));
                section(ui, "Technique", "How its shadows are made.", |ui| self.techniques(ui));
                section(ui, "Light", "What throws shadows.", |ui| self.light_section(ui));
                section(ui, "Camera", "Where the view is from.", |ui| self.camera_section(ui));
                section(ui, "Costs", "What a frame takes.", |ui| self.costs(ui));
                section(ui, "Take home", "Copy or save what you found.", |ui| self.take_home(ui));
            });
        });
    }

    fn scene_section(&mut self, ui: &mut Ui) {
        let mut open = None;
        let shown = self.info.as_ref().map_or("none", |info| info.name.as_str()).to_owned();
        ComboBox::from_id_salt("scenes")
            .selected_text(shown)
            .width(ui.available_width() - 16.0)
            .height(400.0)
            .truncate()
            .show_ui(ui, |ui| {
                for builtin in umbrage_scene::builtins() {
                    let is_shown = builtin.name == self.kept.settings.scene;
                    if ui.selectable_label(is_shown, builtin.name).tip(builtin.about).clicked() {
                        open = Some(builtin.name.to_owned());
                    }
                }
            })
            .response
            .tip("Open one of the built-in scenes.");
        ui.horizontal(|ui| {
            let field = TextEdit::singleline(&mut self.path).hint_text("a .glb or session file");
            let field = field.desired_width(ui.available_width() - 60.0);
            let response =
                ui.add(field).tip("A path of a scene or session, or a built-in scene's name.");
            let is_entered = response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
            if ui.button("open").tip("Open what the field names.").clicked() || is_entered {
                open = Some(self.path.clone());
            }
        });
        if let Some(name) = open {
            self.act(ui.ctx(), Action::Open(name.into()));
        }
        if self.opening.is_some()
            && ui.button("stop opening").tip("Keep the present scene.").clicked()
        {
            self.stage.cancel();
            self.opening = None;
        }
        let Some(info) = self.info.clone() else { return };
        ui.label(format!("{} triangles drawn", thousands(info.triangles)));
        if !info.notices.is_empty() {
            let count = info.notices.len();
            let title = if count == 1 { "1 notice".into() } else { format!("{count} notices") };
            let header = CollapsingHeader::new(title).show(ui, |ui| {
                for notice in &info.notices {
                    ui.label(RichText::new(notice).small());
                }
            });
            header.header_response.tip("What was repaired or left out when the file was read.");
        }
        self.animation(ui, &info.clips);
    }

    fn animation(&mut self, ui: &mut Ui, clips: &[(String, f64)]) {
        if clips.is_empty() {
            return;
        }
        let mut actions = Vec::new();
        let settings = &self.kept.settings;
        let name = settings.clip.and_then(|clip| clips.get(clip)).map_or("at rest", |(n, _)| n);
        ui.horizontal(|ui| {
            ComboBox::from_id_salt("clips")
                .selected_text(name)
                .show_ui(ui, |ui| {
                    let rest = ui.selectable_label(settings.clip.is_none(), "at rest");
                    if rest.tip("Show the scene without animation.").clicked() {
                        actions.push(Action::Clip(0));
                    }
                    for (i, (name, seconds)) in clips.iter().enumerate() {
                        let is_chosen = settings.clip == Some(i);
                        let tip = format!("Play this clip of {seconds:.2} s.");
                        if ui.selectable_label(is_chosen, name).tip(&tip).clicked() {
                            actions.push(Action::Clip(i + 1));
                        }
                    }
                })
                .response
                .tip("Choose one of the file's animations.");
            let is_playing = settings.is_playing;
            let label = if is_playing { "pause" } else { "play" };
            if ui.button(label).tip("Let the animation run, or stop it (space).").clicked() {
                actions.push(Action::Play(!is_playing));
            }
        });
        if let Some((_, seconds)) = settings.clip.and_then(|clip| clips.get(clip)) {
            let mut time = settings.time_s;
            let slider = Slider::new(&mut time, 0.0..=seconds.max(1e-3)).suffix(" s");
            if ui.add(slider).tip("The moment of the animation that is shown.").changed() {
                actions.push(Action::Play(false));
                actions.push(Action::Seek(time));
            }
        }
        self.act_all(ui.ctx(), actions);
    }

    fn techniques(&mut self, ui: &mut Ui) {
        if let Some(text) = self.drafts[0].show(ui, "first") {
            self.act(ui.ctx(), Action::Technique(0, text));
        }
        let mut actions = Vec::new();
        ui.horizontal(|ui| {
            ui.label("fit");
            ComboBox::from_id_salt("fit")
                .selected_text(self.kept.settings.fit.name())
                .show_ui(ui, |ui| {
                    for (fit, tip) in [
                        (Fit::Box, "Fit the maps to the box around the scene."),
                        (Fit::Surfaces, "Fit the maps to some hundred boxes around the surfaces."),
                        (Fit::Seen, "Fit the maps to what the picture shows, tile by tile."),
                    ] {
                        let is_chosen = fit == self.kept.settings.fit;
                        if ui.selectable_label(is_chosen, fit.name()).tip(tip).clicked() {
                            actions.push(Action::Fit(fit));
                        }
                    }
                })
                .response
                .tip("What the maps are fitted to.");
            let mut counts = self.kept.settings.counts_errors;
            let check = ui.checkbox(&mut counts, "count errors");
            if check
                .tip("Trace the truth and count wrong pixels while the view rests (N).")
                .changed()
            {
                actions.push(Action::CountErrors(counts));
            }
        });
        if self.kept.settings.compare.is_of_two() {
            ui.separator();
            let mut with_truth = self.kept.settings.techniques[1] == TRUTH;
            let check = ui.checkbox(&mut with_truth, "compare with ray-traced truth");
            if check.tip("Show the truth in place of a second technique.").changed() {
                let other = match &self.drafts[1].text {
                    _ if with_truth => TRUTH,
                    text if text == TRUTH => "uniform:pcf3@1024",
                    text => text,
                };
                actions.push(Action::Technique(1, other.to_owned()));
            }
            if !with_truth && let Some(text) = self.drafts[1].show(ui, "second") {
                actions.push(Action::Technique(1, text));
            }
        }
        self.act_all(ui.ctx(), actions);
    }

    fn light_section(&mut self, ui: &mut Ui) {
        let Some(info) = self.info.clone() else { return };
        let mut actions = Vec::new();
        let light = self.kept.settings.light.clone();
        let name = match &light {
            LightSetting::Sun(_) => "sun by angles",
            LightSetting::Hour(_) => "sun by the time of day",
            LightSetting::Headlight => "headlight",
            LightSetting::Named(name) => name,
        };
        let sun = self.sun();
        ComboBox::from_id_salt("light")
            .selected_text(name)
            .show_ui(ui, |ui| {
                let angles =
                    ui.selectable_label(matches!(light, LightSetting::Sun(_)), "sun by angles");
                if angles.tip("A sun by azimuth and elevation.").clicked() {
                    actions.push(sun_action(sun));
                }
                let hour = ui.selectable_label(
                    matches!(light, LightSetting::Hour(_)),
                    "sun by the time of day",
                );
                if hour.tip("A sun on the longest day, 45° north.").clicked() {
                    actions.push(Action::Hour(15.0));
                }
                let head = ui.selectable_label(light == LightSetting::Headlight, "headlight");
                if head.tip("Parallel light along the view.").clicked() {
                    actions.push(Action::Headlight);
                }
                for (name, _) in &info.lights {
                    let is_chosen = light == LightSetting::Named(name.clone());
                    if ui.selectable_label(is_chosen, name).tip("A light of the scene.").clicked() {
                        actions.push(Action::Light(name.clone()));
                    }
                }
            })
            .response
            .tip("Choose where the light comes from; Alt and drag moves the sun.");
        match light {
            LightSetting::Sun(Sun { mut azimuth_deg, mut elevation_deg }) => {
                let azimuth =
                    Slider::new(&mut azimuth_deg, 0.0..=360.0).suffix("°").text("azimuth");
                let azimuth =
                    ui.add(azimuth).tip("Where the sun stands, clockwise from north (−z).");
                let elevation =
                    Slider::new(&mut elevation_deg, 0.0..=90.0).suffix("°").text("elevation");
                let elevation = ui.add(elevation).tip("How high the sun stands above the horizon.");
                if azimuth.changed() || elevation.changed() {
                    actions.push(Action::Sun { azimuth_deg, elevation_deg });
                }
            }
            LightSetting::Hour(mut hour) => {
                let slider = Slider::new(&mut hour, 4.5..=19.5).text("hour");
                let slider = slider.custom_parser(hours).custom_formatter(|hours, _| {
                    let minutes = (hours * 60.0).round() as u32;
                    format!("{:02}:{:02}", minutes / 60, minutes % 60)
                });
                if ui.add(slider).tip("The time of day by the sun; 12 is noon.").changed() {
                    actions.push(Action::Hour(hour));
                }
            }
            LightSetting::Headlight | LightSetting::Named(_) => {}
        }
        self.light_size(ui, &mut actions);
        self.act_all(ui.ctx(), actions);
    }

    fn light_size(&self, ui: &mut Ui, actions: &mut Vec<Action>) {
        let size = self.kept.settings.light_size;
        let is_sun = self.frame.as_ref().is_none_or(|f| f.light.position().is_none());
        let mut has_size = size.is_some();
        ui.horizontal(|ui| {
            let check = ui.checkbox(&mut has_size, "has a size");
            if check.tip("Give the light a size, for the truth of soft shadows.").changed() {
                let new = if is_sun { LightSize::Degrees(0.53) } else { LightSize::Metres(0.2) };
                actions.push(Action::LightSize(has_size.then_some(new)));
            }
            let new = match size {
                Some(LightSize::Degrees(mut degrees)) => {
                    let drag =
                        DragValue::new(&mut degrees).range(0.01..=90.0).speed(0.02).suffix("°");
                    let row = ui.add(drag).tip("The angle that the sun's disc takes up.");
                    row.changed().then_some(LightSize::Degrees(degrees))
                }
                Some(LightSize::Metres(mut metres)) => {
                    let drag =
                        DragValue::new(&mut metres).range(0.001..=1e6).speed(0.01).suffix(" m");
                    let row = ui.add(drag).tip("The diameter of the lamp.");
                    row.changed().then_some(LightSize::Metres(metres))
                }
                None => None,
            };
            if new.is_some() {
                actions.push(Action::LightSize(new));
            }
        });
    }

    fn camera_section(&mut self, ui: &mut Ui) {
        let Some(info) = self.info.clone() else { return };
        let mut actions = Vec::new();
        let settings = &self.kept.settings;
        ui.horizontal(|ui| {
            if !info.cameras.is_empty() {
                ComboBox::from_id_salt("cameras")
                    .selected_text(settings.camera.as_deref().unwrap_or("free"))
                    .show_ui(ui, |ui| {
                        for (name, _) in &info.cameras {
                            let is_chosen = settings.camera.as_ref() == Some(name);
                            let row = ui.selectable_label(is_chosen, name);
                            if row.tip("Take this camera of the scene.").clicked() {
                                actions.push(Action::Camera(name.clone()));
                            }
                        }
                    })
                    .response
                    .tip("Choose one of the scene's cameras.");
            }
            let mut is_flying = settings.is_flying;
            if ui
                .selectable_label(!is_flying, "orbit")
                .tip("Dragging moves around the target.")
                .clicked()
            {
                is_flying = false;
            }
            if ui.selectable_label(is_flying, "fly").tip("Dragging turns the head.").clicked() {
                is_flying = true;
            }
            if is_flying != settings.is_flying {
                actions.push(Action::Fly(is_flying));
            }
            if ui
                .button("reset")
                .tip("Go back to the view and light of the beginning (R).")
                .clicked()
            {
                actions.push(Action::Reset);
            }
        });
        match settings.lens {
            Lens::Perspective { fov_y_rad } => {
                let mut degrees = fov_y_rad.to_degrees();
                let slider =
                    Slider::new(&mut degrees, 5.0..=120.0).suffix("°").text("field of view");
                if ui
                    .add(slider)
                    .tip("The angle from the bottom to the top of the picture.")
                    .changed()
                {
                    actions.push(Action::Fov(degrees));
                }
                if ui.button("orthographic").tip("Make distance shrink nothing.").clicked() {
                    let height = 2.0 * settings.pose.distance() * (fov_y_rad / 2.0).tan();
                    actions.push(Action::Ortho(height));
                }
            }
            Lens::Orthographic { mut height } => {
                let speed = height * 0.01;
                let drag = DragValue::new(&mut height).range(1e-6..=1e9).speed(speed);
                if ui
                    .add(drag.suffix(" m high"))
                    .tip("How much the picture shows from bottom to top.")
                    .changed()
                {
                    actions.push(Action::Ortho(height));
                }
                if ui.button("perspective").tip("Make what is far smaller.").clicked() {
                    actions.push(Action::Fov(50.0));
                }
            }
        }
        let mut percent = settings.resolution * 100.0;
        let slider = Slider::new(&mut percent, 10.0..=100.0).suffix("%").text("resolution");
        if ui
            .add(slider)
            .tip("The share of the window's pixels that are drawn; fewer are faster.")
            .changed()
        {
            actions.push(Action::Resolution(percent / 100.0));
        }
        if let Some(frame) = &self.frame {
            let [near, far] = [frame.request.camera.near(), frame.request.camera.far()];
            let [width, height] = self.image;
            ui.label(format!("{width}×{height} pixels, {near:.3} to {far:.1} m"));
        }
        self.act_all(ui.ctx(), actions);
    }

    fn take_home(&mut self, ui: &mut Ui) {
        let mut actions = Vec::new();
        ui.horizontal_wrapped(|ui| {
            for (what, label, tip) in [
                (Copied::Specification, "copy text", "Copy the technique's text."),
                (Copied::Command, "copy command", "Copy the command that renders this view."),
                (Copied::Code, "copy Rust", "Copy the technique as Rust code for your renderer."),
            ] {
                if ui.button(label).tip(tip).clicked() {
                    actions.push(Action::Copy(what));
                }
            }
        });
        ui.horizontal_wrapped(|ui| {
            if ui.button("save picture").tip("Save the first picture as a PNG (ctrl+P).").clicked()
            {
                actions.push(Action::Save(free("umbrage-view", ".png")));
            }
            let turn = ui.button("turntable").tip("Save 36 pictures of a turn around the target.");
            if turn.clicked() {
                actions.push(Action::Turntable(36, free("umbrage-turntable", "")));
            }
            if ui
                .button("save session")
                .tip("Save all that is set, to open it again (ctrl+S).")
                .clicked()
            {
                actions.push(Action::SaveSession(free("umbrage-session", ".json")));
            }
        });
        self.act_all(ui.ctx(), actions);
    }
}

/// The action that sets a sun.
pub(super) fn sun_action(sun: Sun) -> Action {
    Action::Sun { azimuth_deg: sun.azimuth_deg, elevation_deg: sun.elevation_deg }
}

/// The hours of a time such as `16:45` or `16.75`.
fn hours(text: &str) -> Option<f64> {
    match text.trim().split_once(':') {
        Some((hours, minutes)) => {
            let [hours, minutes] = [hours, minutes].map(|part| part.trim().parse::<f64>().ok());
            Some(hours? + minutes? / 60.0)
        }
        None => text.trim().parse().ok(),
    }
}

/// A path in the process's folder at which nothing is yet: `name.png`, `name-2.png` and so on.
pub(super) fn free(name: &str, ending: &str) -> PathBuf {
    let numbered = (2..).map(|i| PathBuf::from(format!("{name}-{i}{ending}")));
    let mut paths = std::iter::once(PathBuf::from(format!("{name}{ending}"))).chain(numbered);
    paths.find(|path| !path.exists()).unwrap_or_default()
}

/// A part of the panel that can be closed.
fn section(ui: &mut Ui, title: &str, tip: &str, contents: impl FnOnce(&mut Ui)) {
    let header =
        CollapsingHeader::new(RichText::new(title).strong()).default_open(true).show(ui, contents);
    header.header_response.tip(tip);
}

/// A number with spaces between groups of three digits.
pub(super) fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}
