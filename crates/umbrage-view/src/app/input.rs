//! Mouse, keys, dropped files, and the passing of time.

use super::App;
use super::controls::{free, sun_action};
use super::picture::share;
use crate::action::{Action, Panel};
use crate::settings::{Compare, OverlayKind};
use crate::sun::Sun;
use egui::{EventFilter, Key, Modifiers, PointerButton, Rect, Response, Ui};
use glam::DVec3;
use umbrage::Light;

/// Angle of a turn for a point that the mouse moves, degrees.
const TURN_DEG: f64 = 0.3;

/// Angle of a turn in a second by a key, degrees.
const KEY_TURN_DEG: f64 = 60.0;

/// Share of the distance to the target that a second of a key moves the viewer by.
const KEY_STEP: f64 = 0.6;

/// How far from the line of a wipe a drag may begin that moves the line, points.
const WIPE_REACH: f32 = 24.0;

/// The key, and what it does, for the list of keys.
pub(super) const KEYS: &[(&str, &str)] = &[
    ("drag", "turn around the target, or turn the head if flying"),
    ("right-drag, shift-drag", "move in the picture's plane"),
    ("Alt-drag, L and drag", "move the sun"),
    ("scroll, pinch", "go nearer or farther"),
    ("W A S D Q E", "walk; with shift faster"),
    ("arrows", "turn, while the picture has the focus (Tab)"),
    ("shift and arrows", "move the sun, likewise"),
    ("1 … 7", "overlays: none, error, texels, partition, difference, clusters, pages"),
    ("O / C", "next overlay / next way to compare"),
    ("X / hold B", "swap the two techniques / the second while flipping"),
    ("V", "orbit or fly"),
    ("F", "freeze the plan, and look at it from outside"),
    ("N", "count errors"),
    ("T / H", "theory / time of day"),
    ("P", "measure the presets"),
    ("space", "play or pause the animation"),
    ("R", "the view and light of the beginning"),
    ("ctrl+S, ctrl+P", "save the session, save the picture"),
    ("Tab, F1, Escape", "controls, these keys, close messages and windows"),
];

impl App<'_> {
    /// The sun that shines, or the one from which a drag begins if there is another light.
    pub(super) fn sun(&self) -> Sun {
        let light = self.frame.as_ref().map(|frame| frame.light);
        let other = || match light {
            Some(Light::Directional { direction }) => Sun::from_direction(direction),
            _ => Sun { azimuth_deg: 135.0, elevation_deg: 45.0 },
        };
        self.kept.settings.sun().unwrap_or_else(other)
    }

    fn turn_sun(&mut self, ui: &egui::Context, by: [f64; 2]) {
        let Sun { azimuth_deg, elevation_deg } = self.sun();
        let azimuth_deg = (azimuth_deg + by[0]).rem_euclid(360.0);
        let elevation_deg = (elevation_deg + by[1]).clamp(0.0, 90.0);
        self.act(ui, sun_action(Sun { azimuth_deg, elevation_deg }));
    }

    /// What the mouse or fingers do on the picture.
    pub(super) fn mouse(&mut self, ui: &Ui, response: &Response, rect: Rect) {
        let context = ui.ctx();
        self.picture_id = Some(response.id);
        if response.clicked() {
            response.request_focus();
        }
        if response.has_focus() {
            let filter = EventFilter {
                horizontal_arrows: true,
                vertical_arrows: true,
                ..EventFilter::default()
            };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
            ui.painter().rect_stroke(
                rect.shrink(1.0),
                0.0,
                egui::Stroke::new(2.0, ui.visuals().selection.stroke.color),
                egui::StrokeKind::Inside,
            );
        }
        self.mouse_depth = response.hover_pos().and_then(|at| self.depth_at(share(rect, at)));
        if response.drag_started() {
            let at = response.interact_pointer_pos().map_or(0.0, |at| share(rect, at)[0]);
            self.is_wiping = self.kept.settings.compare == Compare::Wipe
                && (at - self.kept.shown.wipe).abs() * rect.width() < WIPE_REACH;
        }
        let by = response.drag_delta();
        let (modifiers, is_light_key) = ui.input(|i| (i.modifiers, i.key_down(Key::L)));
        let is_secondary = response.dragged_by(PointerButton::Secondary)
            || response.dragged_by(PointerButton::Middle);
        if by != egui::Vec2::ZERO {
            let [right, down] = [f64::from(by.x), f64::from(by.y)];
            let turn = [right * TURN_DEG, -down * TURN_DEG];
            let at = response.interact_pointer_pos().map_or([0.5, 0.5], |at| share(rect, at));
            if modifiers.alt || is_light_key {
                self.turn_sun(context, turn);
            } else if is_secondary || modifiers.shift {
                let height = f64::from(rect.height().max(1.0));
                let scale = self.kept.settings.pose.distance() / height;
                self.act(context, Action::Walk(DVec3::new(-right, down, 0.0) * scale));
            } else if self.is_wiping {
                self.act(context, Action::Wipe(at[0]));
            } else if self.kept.settings.is_flying {
                self.act(context, Action::Look([-turn[0], -turn[1]]));
            } else {
                self.act(context, Action::Orbit([-turn[0], -turn[1]]));
            }
        }
        if response.hovered() {
            let (scroll, zoom) = ui.input(|i| (i.smooth_scroll_delta(), i.zoom_delta()));
            let nearer = f64::from(scroll.y) * 0.002 + f64::from(zoom.ln());
            if nearer != 0.0 {
                self.go_nearer(context, nearer);
            }
            // Two fingers on a touch pad scroll to the side as well.
            if scroll.x != 0.0 && !self.kept.settings.is_flying {
                self.act(context, Action::Orbit([-f64::from(scroll.x) * TURN_DEG, 0.0]));
            }
        }
    }

    /// Goes nearer to the target or, if flying, forward.
    fn go_nearer(&mut self, context: &egui::Context, by: f64) {
        if self.kept.settings.is_flying {
            let step = self.kept.settings.pose.distance() * by;
            self.act(context, Action::Walk(DVec3::Z * step));
        } else {
            self.act(context, Action::Approach((-by).exp()));
        }
    }

    /// The distance along the view of what a point of the picture shows, as far as the truth is
    /// known.
    fn depth_at(&self, [x, y]: [f32; 2]) -> Option<f64> {
        let x = if self.kept.settings.compare == Compare::Beside { x * 2.0 % 1.0 } else { x };
        let [width, height] = self.frame.as_ref()?.request.camera.image().map(|n| n as f32);
        self.judged.depth((x * width) as u32, (y * height) as u32)
    }

    /// What keys do that no control wants.
    pub(super) fn keys(&mut self, context: &egui::Context, seconds: f64) {
        let is_typing = context.text_edit_focused();
        let (pressed, modifiers) = context.input(|i| {
            // What is held down may have changed by the end of a long frame.
            let pressed = |event: &egui::Event| match event {
                egui::Event::Key { key, pressed: true, modifiers, .. } => Some((*key, *modifiers)),
                _ => None,
            };
            (i.events.iter().filter_map(pressed).collect::<Vec<_>>(), i.modifiers)
        });
        let focus = context.memory(egui::Memory::focused);
        for (key, held) in pressed {
            if let Some(action) = self.shortcut(key, held, is_typing, focus) {
                self.act(context, action);
            }
        }
        if is_typing || modifiers.command {
            return;
        }
        self.walk(context, seconds);
        if !modifiers.alt && context.memory(|m| m.focused().is_some()) {
            self.arrows(context, modifiers, seconds);
        }
    }

    fn shortcut(
        &mut self,
        key: Key,
        modifiers: Modifiers,
        is_typing: bool,
        focus: Option<egui::Id>,
    ) -> Option<Action> {
        match key {
            Key::F1 => return Some(Action::Panel(Panel::Help, !self.is_shown(Panel::Help))),
            Key::S if modifiers.command => {
                return Some(Action::SaveSession(free("umbrage-session", ".json")));
            }
            Key::P if modifiers.command => return Some(Action::Save(free("umbrage-view", ".png"))),
            Key::Escape => {
                let shown = self.kept.message.take().filter(|message| !message.is_over());
                if shown.is_none()
                    && let Some(panel) =
                        self.kept.shown.panels.iter().rev().find(|&&p| p != Panel::Controls)
                {
                    return Some(Action::Panel(*panel, false));
                }
                return None;
            }
            _ if is_typing || modifiers.command || modifiers.ctrl || modifiers.alt => return None,
            _ => {}
        }
        // A button that has the focus is pressed by the same key.
        let is_elsewhere = focus.is_some() && focus != self.picture_id;
        let settings = &self.kept.settings;
        let overlay = |i: usize| Some(Action::Overlay(OverlayKind::ALL[i].0));
        match key {
            Key::Num1 => overlay(0),
            Key::Num2 => overlay(1),
            Key::Num3 => overlay(2),
            Key::Num4 => overlay(3),
            Key::Num5 => overlay(4),
            Key::Num6 => overlay(5),
            Key::Num7 => overlay(6),
            Key::O => {
                let info = self.info.as_ref();
                let is_shown = |kind: &OverlayKind| info.is_none_or(|i| kind.refusal(i).is_none());
                let shown = OverlayKind::ALL.into_iter().filter(|(kind, ..)| is_shown(kind));
                Some(Action::Overlay(next(&shown.collect::<Vec<_>>(), settings.overlay)))
            }
            Key::C => Some(Action::Compare(next(&Compare::ALL, settings.compare))),
            Key::V => Some(Action::Fly(!settings.is_flying)),
            Key::F => Some(Action::Freeze(settings.frozen.is_none())),
            Key::N => Some(Action::CountErrors(!settings.counts_errors)),
            Key::R => Some(Action::Reset),
            Key::P => Some(Action::TryThese),
            Key::T => Some(Action::Panel(Panel::Theory, !self.is_shown(Panel::Theory))),
            Key::H => Some(Action::Hour(15.0)),
            Key::Space if settings.clip.is_some() && !is_elsewhere => {
                Some(Action::Play(!settings.is_playing))
            }
            Key::X if !settings.compares_with_truth() => {
                self.kept.settings.techniques.swap(0, 1);
                self.drafts.swap(0, 1);
                None
            }
            _ => None,
        }
    }

    fn walk(&mut self, context: &egui::Context, seconds: f64) {
        let held = |key: Key| f64::from(u8::from(context.input(|i| i.key_down(key))));
        let step = DVec3::new(
            held(Key::D) - held(Key::A),
            held(Key::E) - held(Key::Q),
            held(Key::W) - held(Key::S),
        );
        if step == DVec3::ZERO || context.input(|i| i.modifiers.any() && !i.modifiers.shift) {
            return;
        }
        let faster = if context.input(|i| i.modifiers.shift) { 4.0 } else { 1.0 };
        let metres = self.kept.settings.pose.distance() * KEY_STEP * faster * seconds;
        self.act(context, Action::Walk(step * metres));
        context.request_repaint();
    }

    fn arrows(&mut self, context: &egui::Context, modifiers: Modifiers, seconds: f64) {
        let held = |key: Key| f64::from(u8::from(context.input(|i| i.key_down(key))));
        let turn = [
            held(Key::ArrowRight) - held(Key::ArrowLeft),
            held(Key::ArrowUp) - held(Key::ArrowDown),
        ];
        let is_on_picture = context.memory(egui::Memory::focused) == self.picture_id;
        if turn == [0.0; 2] || !is_on_picture {
            return;
        }
        let turn = turn.map(|t| t * KEY_TURN_DEG * seconds);
        match (modifiers.shift, self.kept.settings.is_flying) {
            (true, _) => self.turn_sun(context, turn),
            (false, true) => self.act(context, Action::Look(turn)),
            (false, false) => self.act(context, Action::Orbit(turn)),
        }
        context.request_repaint();
    }

    /// Opens what was dropped onto the window.
    pub(super) fn drop_files(&mut self, context: &egui::Context) {
        let dropped = context.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_owned()));
        if let Some(path) = dropped {
            self.act(context, Action::Open(path));
        }
    }

    /// Lets the animation go on.
    pub(super) fn play(&mut self, context: &egui::Context, seconds: f64) {
        let Some(info) = &self.info else { return };
        let settings = &mut self.kept.settings;
        let Some((_, length)) = settings.clip.and_then(|clip| info.clips.get(clip)) else { return };
        if settings.is_playing {
            settings.time_s = (settings.time_s + seconds) % length.max(1e-3);
            context.request_repaint();
        }
    }
}

/// The value after another one in a list of all, from the last to the first.
fn next<T: Copy + PartialEq>(all: &[(T, &str, &str)], present: T) -> T {
    let place = all.iter().position(|(value, ..)| *value == present).map_or(0, |i| i + 1);
    all[place % all.len()].0
}
