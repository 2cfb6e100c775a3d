//! The pictures in the middle of the window.

use super::App;
use super::controls::Tip;
use super::lines::{BODY, VIEW, lines, paint_in_world, paint_legend, paint_rows};
use crate::settings::{Compare, OverlayKind};
use crate::stage::DrawnPicture;
use egui::{Color32, FontId, Painter, Pos2, Rect, Sense, Stroke, TextureId, Ui, pos2, vec2};
use umbrage_measure::Tally;

/// One of the pictures that are compared.
struct Shown {
    id: TextureId,
    name: String,
    tally: Option<Tally>,
}

/// Time that each picture is shown when they are flipped, seconds.
const FLIP_S: f64 = 1.0;

impl App<'_> {
    /// Shows the pictures, and takes what the mouse does there.
    pub(super) fn picture(&mut self, ui: &mut Ui) {
        let frame = egui::Frame::new().fill(Color32::from_gray(24));
        egui::CentralPanel::default().frame(frame).show(ui, |ui| {
            let rect = ui.max_rect();
            let response = ui
                .interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag())
                .tip_beside(
                    "Drag to turn, right-drag to move, scroll to go nearer; F1 lists the keys.",
                );
            self.picture_rect = rect;
            self.note_size(ui, rect);
            self.mouse(ui, &response, rect);
            let painter = ui.painter_at(rect);
            match self.kept.settings.compare {
                Compare::Alone => self.one(&painter, rect, 0),
                Compare::Beside => {
                    let half = rect.width() / 2.0;
                    let (left, right) = rect.split_left_right_at_x(rect.left() + half);
                    self.one(&ui.painter_at(left), left, 0);
                    self.one(&ui.painter_at(right), right, 1);
                    painter.vline(
                        rect.left() + half,
                        rect.y_range(),
                        Stroke::new(1.0, Color32::BLACK),
                    );
                }
                Compare::Wipe => {
                    let x = rect.left() + rect.width() * self.kept.shown.wipe;
                    let (left, right) = rect.split_left_right_at_x(x);
                    self.clipped(ui, left, rect, 0);
                    self.clipped(ui, right, rect, 1);
                    painter.vline(x, rect.y_range(), Stroke::new(2.0, Color32::WHITE));
                }
                Compare::Flip => {
                    let is_held = ui.input(|i| i.key_down(egui::Key::B))
                        && !ui.ctx().egui_wants_keyboard_input();
                    let time = ui.input(|i| i.time);
                    let second = is_held || (time / FLIP_S) as u64 % 2 == 1;
                    self.one(&painter, rect, usize::from(second));
                    ui.ctx().request_repaint_after_secs(0.1);
                }
            }
            self.legend(&painter, rect);
            self.state(&painter, rect);
        });
    }

    /// The size of a picture for this rectangle, pixels.
    fn note_size(&mut self, ui: &Ui, rect: Rect) {
        let beside = if self.kept.settings.compare == Compare::Beside { 0.5 } else { 1.0 };
        let scale = ui.ctx().pixels_per_point() * self.kept.settings.resolution;
        let most = self.gpu.device().limits().max_texture_dimension_2d as f32;
        let side = |points: f32| (points * scale).round().clamp(1.0, most) as u32;
        self.image = [side(rect.width() * beside), side(rect.height())];
    }

    /// The first or second picture.
    fn shown(&mut self, context: &egui::Context, index: usize) -> Option<Shown> {
        let settings = &self.kept.settings;
        if index == 1 && settings.compares_with_truth() {
            let texture = self.judged.truth_texture(context)?;
            return Some(Shown { id: texture.id(), name: "ray-traced truth".into(), tally: None });
        }
        let picture = self.frame.as_ref()?.pictures.get(index)?;
        let name = picture.technique.to_string();
        let tally = self.judged.tallies[index];
        if settings.overlay == OverlayKind::Difference {
            let is_soft = picture.technique.is_soft();
            if let Some(texture) = self.judged.difference(context, index, is_soft) {
                return Some(Shown { id: texture.id(), name, tally });
            }
        }
        let id = self.textures.picture(index)?.id;
        Some(Shown { id, name, tally })
    }

    fn one(&mut self, painter: &Painter, rect: Rect, index: usize) {
        let context = painter.ctx().clone();
        let Some(shown) = self.shown(&context, index) else { return };
        paint(painter, rect, shown.id);
        self.caption(painter, rect, &shown);
        self.outside(painter, rect, index);
    }

    /// The part of a picture within `part` of its rectangle.
    fn clipped(&mut self, ui: &Ui, part: Rect, rect: Rect, index: usize) {
        let Some(shown) = self.shown(ui.ctx(), index) else { return };
        let painter = ui.painter_at(part);
        paint(&painter, rect, shown.id);
        self.caption(&painter, part, &shown);
        self.outside(&painter, rect, index);
    }

    /// Names a picture, and tells how wrong it is.
    fn caption(&self, painter: &Painter, rect: Rect, shown: &Shown) {
        let mut text = shown.name.clone();
        let errors = shown.tally.and_then(|t| Some((t.wrong_fraction()?, t.mean_abs_error()?)));
        match (self.judged.state(), errors) {
            (Some((Some(problem), _)), _) => text += &format!("\nno truth: {problem}"),
            (Some((None, [share, _])), None) if share < 1.0 => {
                text += &format!("\n{:.0}% traced", share * 100.0);
            }
            (Some((None, [share, exact])), Some((wrong, mean))) => {
                let [wrong, mean] = [wrong, mean].map(|v| v * 100.0);
                text += &format!("\nwrong {wrong:.2}%, mean error {mean:.2}%");
                if share < 1.0 {
                    text += &format!(" ({:.0}% traced)", share * 100.0);
                } else if exact < 1.0 {
                    text += &format!(" (penumbrae {:.0}% exact)", exact * 100.0);
                }
            }
            _ => {}
        }
        let width = (rect.width() - 24.0).max(0.0);
        let galley = painter.layout(text, FontId::proportional(13.0), Color32::WHITE, width);
        let area = Rect::from_min_size(rect.min + vec2(8.0, 8.0), galley.size() + vec2(12.0, 8.0));
        painter.rect_filled(area, 4.0, Color32::from_black_alpha(170));
        painter.galley(area.min + vec2(6.0, 4.0), galley, Color32::WHITE);
    }

    /// What is seen of a plan that is kept, from outside.
    fn outside(&self, painter: &Painter, rect: Rect, index: usize) {
        let Some(frame) = self.frame.as_ref().filter(|f| f.request.planned_for.is_some()) else {
            return;
        };
        if let Some(drawn) = drawn(frame, index) {
            paint_in_world(painter, rect, &frame.request.camera, &lines(frame, drawn));
        }
    }

    fn legend(&self, painter: &Painter, rect: Rect) {
        let Some(frame) = &self.frame else { return };
        let Some(drawn) = drawn(frame, 0) else { return };
        let overlay = self.kept.settings.overlay;
        paint_legend(painter, rect, overlay, &drawn.plan);
        if frame.request.planned_for.is_some() && overlay == OverlayKind::None {
            let rows = [
                (VIEW, "V: the planned view".to_owned()),
                (BODY, "B: the receivers it sees".to_owned()),
                (super::lines::map_color(0), "W: what each map covers".to_owned()),
            ];
            paint_rows(painter, rect, &rows);
        }
    }

    /// What is going on, in the middle of the picture.
    fn state(&self, painter: &Painter, rect: Rect) {
        let text = match (&self.opening, &self.problem, &self.frame) {
            (Some((to_open, stage, since)), _, frame) => {
                if frame.is_some() && since.elapsed().as_millis() < 200 {
                    return;
                }
                painter.ctx().request_repaint_after_secs(0.25);
                format!(
                    "{}: {stage} ({:.0} s)",
                    to_open.settings.scene,
                    since.elapsed().as_secs_f64()
                )
            }
            (None, Some(problem), _) => problem.clone(),
            (None, None, Some(frame)) if frame.request.planned_for.is_some() => {
                let settings = &self.kept.settings;
                if !settings.compares_with_truth() && settings.overlay != OverlayKind::Difference {
                    return;
                }
                "no truth is traced while the plan is frozen".to_owned()
            }
            (None, None, None) if self.info.is_some() => "drawing".to_owned(),
            (None, None, Some(frame)) if is_unlit(frame) => {
                "the light reaches nothing that is seen".to_owned()
            }
            (None, None, None) => "no scene; drop a .glb file here".to_owned(),
            _ => return,
        };
        let font = FontId::proportional(16.0);
        let galley = painter.layout(text, font, Color32::WHITE, rect.width() - 40.0);
        let area = Rect::from_center_size(rect.center(), galley.size() + vec2(24.0, 16.0));
        painter.rect_filled(area, 6.0, Color32::from_black_alpha(200));
        painter.galley(area.min + vec2(12.0, 8.0), galley, Color32::WHITE);
    }
}

/// Whether a light's maps are all empty.
fn is_unlit(frame: &crate::stage::Frame) -> bool {
    drawn(frame, 0).is_some_and(|drawn| {
        let maps = &drawn.plan.maps;
        !maps.is_empty() && maps.iter().all(umbrage::ShadowMap::is_empty)
    })
}

/// The first or second picture of a frame, if it could be drawn.
pub(super) fn drawn(frame: &crate::stage::Frame, index: usize) -> Option<&DrawnPicture> {
    frame.pictures.get(index).or(frame.pictures.first())?.drawn.as_ref().ok()
}

/// Fills a rectangle with a texture.
pub(super) fn paint(painter: &Painter, rect: Rect, id: TextureId) {
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(id, rect, whole, Color32::WHITE);
}

/// Where in a rectangle a point of the window is, as shares of its sides.
pub(super) fn share(rect: Rect, at: Pos2) -> [f32; 2] {
    let at = (at - rect.min) / rect.size();
    [at.x, at.y]
}
