//! The smaller windows over the picture: times, presets, theory, the map, light space and keys.

use super::App;
use super::controls::{Tip, thousands};
use super::input::KEYS;
use super::lines::{BODY, VIEW, lines, map_color, map_name, paint_from_light, paint_in_map};
use super::measured::History;
use super::picture::{drawn, paint};
use crate::action::{Action, Panel};
use crate::stage::{Costs, Job};
use egui::{Color32, ComboBox, Grid, Pos2, Rect, RichText, Sense, Stroke, Ui, Window, vec2};
use egui_plot::{Legend, Line, Plot, PlotPoints, Points, VLine};
use glam::DVec2;
use umbrage::paged::Paging;
use umbrage::{Camera, Light, Plan};
use umbrage_lab::{NamedTechnique, PRESETS};

/// Depths at which the theory panel computes errors.
const DEPTHS: u32 = 128;

impl App<'_> {
    /// Shows the windows that are open.
    pub(super) fn windows(&mut self, context: &egui::Context) {
        for (panel, name, _) in Panel::ALL {
            if panel == Panel::Controls || !self.is_shown(panel) {
                continue;
            }
            let mut is_closed = false;
            let most = context.content_rect().size() - vec2(24.0, 80.0);
            let width = f32::min(440.0, most.x.max(120.0));
            Window::new(name)
                .default_pos(first_place(panel, self.picture_rect, width))
                .id(egui::Id::unique(name))
                .title_bar(false)
                .default_width(width)
                .max_width(most.x.max(120.0))
                .max_height(most.y.max(120.0))
                .constrain(true)
                .show(context, |ui| {
                    is_closed = title(ui, name);
                    match panel {
                        Panel::Controls => {}
                        Panel::Times => self.times(ui),
                        Panel::TryThese => self.try_these(ui),
                        Panel::Theory => self.theory(ui),
                        Panel::Map => self.map(ui),
                        Panel::LightSpace => self.light_space(ui),
                        Panel::Help => help(ui),
                    }
                });
            if is_closed {
                self.show(panel, false);
            }
        }
    }

    /// The costs of the present frame in numbers.
    pub(super) fn costs(&mut self, ui: &mut Ui) {
        let Some(frame) = self.frame.clone() else { return };
        Grid::new("costs").striped(true).num_columns(3).show(ui, |ui| {
            let all: Vec<Option<Costs>> =
                frame.pictures.iter().map(|p| p.drawn.as_ref().ok().map(|d| d.costs)).collect();
            let mut row = |name: &str, tip: &str, value: &dyn Fn(&Costs) -> String| {
                ui.label(name).on_hover_text(tip);
                for costs in &all {
                    ui.monospace(costs.as_ref().map_or("–".into(), value));
                }
                ui.end_row();
            };
            let ms = |ms: Option<f64>| ms.map_or("–".into(), |ms| format!("{ms:.2} ms"));
            row("plan", "Time of planning on the CPU.", &|c| ms(Some(c.plan_ms)));
            row("prepass", "Time to draw the viewer's depths ahead of pages, on the GPU.", &|c| {
                ms(c.prepass_ms)
            });
            row("pages", "Time to find pages, and what casts into new ones, on the GPU.", &|c| {
                ms(c.pages_ms)
            });
            row("depth", "Time to draw casters into the maps, on the GPU.", &|c| ms(c.depth_ms));
            row("filter", "Time to prefilter the maps, on the GPU.", &|c| ms(c.filter_ms));
            row("picture", "Time to draw the picture with lookups, on the GPU.", &|c| {
                ms(c.picture_ms)
            });
            row("lookup", "What lookups add to the picture's time.", &|c| ms(c.lookup_ms));
            row("texels", "Texels of all maps.", &|c| thousands(c.texels));
            row("memory", "What lookups read.", &|c| {
                format!("{:.1} MiB", c.bytes as f64 / 1048576.0)
            });
            row("map draws", "Draw calls into maps, in a frame that drew them anew.", &|c| {
                c.map_draws.to_string()
            });
            row("map triangles", "Triangles drawn into maps, likewise.", &|c| {
                thousands(c.map_triangles)
            });
            row("picture draws", "Draw calls of the picture.", &|c| c.picture_draws.to_string());
            row("picture triangles", "Triangles of the picture.", &|c| {
                thousands(c.picture_triangles)
            });
        });
    }

    /// Times of the last frames, stage upon stage.
    fn times(&mut self, ui: &mut Ui) {
        if self.history.costs.iter().all(|c| c.picture_ms.is_none()) {
            ui.label("This device measures no times of its stages; planning alone is shown.");
        }
        type Stage = (&'static str, Color32, fn(&Costs) -> f64);
        let stages: [Stage; 5] = [
            ("plan", Color32::from_rgb(240, 228, 66), |c| c.plan_ms),
            ("pages", Color32::from_rgb(204, 121, 167), |c| c.pages_ms.unwrap_or(0.0)),
            ("depth", Color32::from_rgb(86, 180, 233), |c| c.depth_ms.unwrap_or(0.0)),
            ("filter", Color32::from_rgb(0, 158, 115), |c| c.filter_ms.unwrap_or(0.0)),
            ("lookup", Color32::from_rgb(213, 94, 0), |c| c.lookup_ms.unwrap_or(0.0)),
        ];
        let mut heights = vec![0.0; self.history.costs.len()];
        let mut plotted = Vec::new();
        for (name, color, of) in stages {
            for (height, costs) in heights.iter_mut().zip(&self.history.costs) {
                *height += of(costs);
            }
            let points: PlotPoints<'_> =
                heights.iter().enumerate().map(|(i, &ms)| [i as f64, ms]).collect();
            plotted.push(Line::new(name, points).color(color));
        }
        Plot::new("times")
            .height(180.0)
            .legend(Legend::default())
            .include_y(0.0)
            .include_x(History::FRAMES as f64)
            .y_axis_label("ms, each upon the last")
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .show(ui, |plot| plotted.into_iter().for_each(|line| plot.line(line)))
            .response
            .tip("The time of the last 240 frames, each stage upon the one before. Click a name to hide it.");
    }

    fn try_these(&mut self, ui: &mut Ui) {
        let mut actions = Vec::new();
        let is_idle = self.job.is_none() && self.info.is_some();
        let button = ui.add_enabled(is_idle, egui::Button::new("measure in this view"));
        if button.tip("Trace the truth and measure all six, beside the frames (P).").clicked() {
            actions.push(Action::TryThese);
        }
        let now = self
            .frame
            .as_ref()
            .map(|frame| (frame.request.camera, frame.light, self.kept.settings.light_size));
        if !self.presets.measured.is_empty() && self.presets.view != now {
            ui.label(RichText::new("measured in another view or light").weak());
        }
        egui::ScrollArea::horizontal().show(ui, |ui| {
            Grid::new("presets").striped(true).num_columns(6).show(ui, |ui| {
                for (title, tip) in [
                    ("", ""),
                    (
                        "wrong",
                        "Share of the pixels that are lit and should be dark, or the reverse.",
                    ),
                    ("mean error", "Mean difference of visibility to the truth."),
                    ("plan", "Time of planning on the CPU."),
                    ("frame", "What maps and lookups add to a frame that draws all maps."),
                    ("memory", "What lookups read."),
                ] {
                    ui.label(RichText::new(title).strong()).on_hover_text(tip);
                }
                ui.end_row();
                for preset in PRESETS {
                    let is_shown = self.kept.settings.techniques[0] == preset.shadows;
                    let tip = format!("{} {}", preset.meaning, preset.shadows);
                    if ui.selectable_label(is_shown, preset.name).tip(&tip).clicked() {
                        actions.push(Action::Preset(preset.name.to_owned()));
                    }
                    match self.presets.of(preset.shadows).map(|m| &m.result) {
                        None => {
                            ui.label("–");
                        }
                        Some(Err(problem)) => {
                            ui.label("not possible here").on_hover_text(problem);
                        }
                        Some(Ok(worth)) => {
                            let percent = |v: Option<f64>| {
                                v.map_or("–".into(), |v| format!("{:.2}%", v * 100.0))
                            };
                            ui.monospace(percent(worth.wrong_fraction));
                            ui.monospace(percent(worth.mean_abs_error));
                            ui.monospace(format!("{:.2} ms", worth.plan_ms));
                            ui.monospace(format!("{:.2} ms", worth.frame_ms));
                            ui.monospace(format!("{:.1} MiB", worth.bytes as f64 / 1048576.0));
                        }
                    }
                    ui.end_row();
                }
            });
        });
        self.act_all(ui.ctx(), actions);
    }

    /// The error along the middle line of sight.
    fn theory(&mut self, ui: &mut Ui) {
        let Some(frame) = self.frame.clone() else { return };
        let Some(drawn) = drawn(&frame, 0) else { return };
        let plan = &drawn.plan;
        let planned_for = frame.request.planned_for.unwrap_or(frame.request.camera);
        ui.label(
            "Texels along the middle line of sight, in pixels per texel: across (s) and along \
                  (t) the warp's axis, and in the worst direction.",
        );
        let curves = errors_along(plan, &planned_for);
        let mouse = self.mouse_depth.filter(|&depth| depth > 0.0);
        Plot::new("theory")
            .height(220.0)
            .legend(Legend::default())
            .x_axis_label("z, metres (powers of ten)")
            .y_axis_label("pixels per texel (powers of ten)")
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .show(ui, |plot| {
                let colors = [
                    ("m_s", Color32::from_rgb(86, 180, 233)),
                    ("m_t", Color32::from_rgb(230, 159, 0)),
                    ("worst", Color32::from_rgb(200, 60, 60)),
                ];
                for (i, (name, color)) in colors.into_iter().enumerate() {
                    // A line ends where no map serves the view.
                    let at = |(z, errors): &(f64, Option<[f64; 3]>)| {
                        [z.log10(), errors.map_or(f64::NAN, |e| e[i].log10())]
                    };
                    let points: PlotPoints<'_> = curves.iter().map(at).collect();
                    plot.line(Line::new(name, points).color(color));
                }
                if let Some(depth) = mouse {
                    plot.vline(
                        VLine::new("mouse", depth.log10()).stroke(Stroke::new(1.0, Color32::GRAY)),
                    );
                    let nearest = curves
                        .iter()
                        .min_by(|a, b| (a.0 - depth).abs().total_cmp(&(b.0 - depth).abs()));
                    if let Some((z, Some(errors))) = nearest {
                        let points = errors.map(|e| [z.log10(), e.log10()]).to_vec();
                        plot.points(
                            Points::new("at the mouse", points).radius(4.0).color(Color32::GRAY),
                        );
                    }
                }
            })
            .response
            .tip(
                "The perspective error E(z) of the present maps; point at the picture to mark a \
                 depth. Click a name to hide its line.",
            );
        let lambdas: Vec<String> = plan
            .maps
            .iter()
            .filter(|map| !map.is_empty())
            .map(|map| map.lambda.map_or("∞ (no warp)".into(), |lambda| format!("{lambda:.3} m")))
            .collect();
        ui.label(format!("λ, by map: {}", lambdas.join(", ")))
            .on_hover_text("Distance from the warp's centre of projection to its near plane.");
        ui.label(format!("storage factor: {:.3}", plan.storage_factor())).on_hover_text(
            "Texels needed per pixel of the picture's height squared for an error of 1 \
             (Lloyd et al. 2006, Eq. 12).",
        );
        if let Some(theta) = plan.lights.first().map(|light| light.theta_rad.to_degrees()) {
            ui.label(format!("θ, the angle between view and light: {theta:.1}°"));
        }
    }

    fn map(&mut self, ui: &mut Ui) {
        let Some(frame) = self.frame.clone() else { return };
        let Some(drawn) = drawn(&frame, 0) else { return };
        if let Some(paging) = &drawn.plan.paging {
            return self.pool(ui, paging);
        }
        let maps = &drawn.plan.maps;
        let mut chosen = self.kept.shown.map.min(maps.len().saturating_sub(1));
        let name = |i: usize| format!("{}: {}", i + 1, map_name(&maps[i]));
        ComboBox::from_id_salt("map")
            .selected_text(if maps.is_empty() { "none".into() } else { name(chosen) })
            .show_ui(ui, |ui| {
                for i in 0..maps.len() {
                    let text = RichText::new(name(i)).color(map_color(i));
                    if ui.selectable_label(i == chosen, text).tip("Show this map.").clicked() {
                        chosen = i;
                    }
                }
            })
            .response
            .tip("Choose a map of the first technique.");
        self.kept.shown.map = chosen;
        let Some(map) = maps.get(chosen).filter(|map| !map.is_empty()) else {
            ui.label("This map is empty: no receiver is seen in its part of the view.");
            return;
        };
        let [width, height] = map.resolution;
        ui.label(format!("{width}×{height} texels; the view is drawn in green"));
        let Some(shown) = self.textures.map() else {
            ui.label("The map holds no depths that could be shown.");
            return;
        };
        let [w, h] = shown.size().map(|n| n as f32);
        let most = (ui.available_width() / w).min(380.0 / h);
        let (rect, response) = ui.allocate_exact_size(vec2(w * most, h * most), Sense::hover());
        response.on_hover_text("Depths as the light sees them: what is nearer to it is lighter.");
        paint(ui.painter(), rect, shown.id);
        let planned_for = frame.request.planned_for.unwrap_or(frame.request.camera);
        paint_in_map(ui.painter(), rect, map, &planned_for);
    }

    /// The texture in which pages lie.
    fn pool(&self, ui: &mut Ui, paging: &Paging) {
        let Some(shown) = self.textures.map() else { return };
        ui.label(match paging.budget {
            Some(places) => {
                format!("{} places for pages of 64×64 texels", thousands(places.into()))
            }
            None => "as many places for pages of 64×64 texels as the view needs".to_owned(),
        });
        let [w, h] = shown.size().map(|n| n as f32);
        let most = (ui.available_width() / w).min(380.0 / h);
        let (rect, response) = ui.allocate_exact_size(vec2(w * most, h * most), Sense::hover());
        response.on_hover_text(
            "The texture of pages: tinted by level, what is nearer to the light is lighter. New \
             pages are lighter, those that are not wanted any more dim, free places dark blue.",
        );
        paint(ui.painter(), rect, shown.id);
    }

    /// View, receivers and warps as the light sees them.
    fn light_space(&mut self, ui: &mut Ui) {
        let Some(frame) = self.frame.clone() else { return };
        let Some(drawn) = drawn(&frame, 0) else { return };
        let camera = frame.request.planned_for.unwrap_or(frame.request.camera);
        let towards = match frame.light {
            Light::Directional { direction } => direction.normalize_or(glam::DVec3::NEG_Y),
            _ => -frame
                .light
                .direction_to_light(camera.eye() + camera.forward() * camera.far() * 0.5),
        };
        let size = vec2(ui.available_width(), 300.0);
        let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
        response.on_hover_text("V, B and W seen along the light; up is the direction of the view.");
        ui.painter().rect_filled(rect, 4.0, Color32::from_gray(30));
        let painter = ui.painter_at(rect);
        paint_from_light(&painter, rect, &lines(&frame, drawn), towards, camera.forward());
        let legend = [
            (VIEW, "V, the view".to_owned()),
            (BODY, "B, the receivers it sees".to_owned()),
            (map_color(0), "W, what each map covers".to_owned()),
        ];
        super::lines::paint_rows(&painter, rect, &legend);
        if frame.request.planned_for.is_none() {
            ui.label("Freeze the plan (F) to see these from outside, in the picture.");
        }
    }

    /// Begins to measure the presets in the present view.
    pub(super) fn measure_presets(&mut self) {
        let Some(frame) = &self.frame else { return };
        let texts = PRESETS.iter().map(|preset| preset.shadows.parse());
        let techniques: Vec<NamedTechnique> = texts.flatten().collect();
        let (camera, light) = (frame.request.camera, frame.light);
        let light_size = self.kept.settings.light_size;
        self.presets.measured.clear();
        self.presets.view = Some((camera, light, light_size));
        let job = Job::Measure { techniques, camera, light, light_size };
        self.begin("measuring", job);
    }
}

/// Where a window of this width is at first: in one of the picture's corners, so that windows which
/// go together lie beside each other.
fn first_place(panel: Panel, picture: Rect, width: f32) -> Pos2 {
    let is_right = matches!(panel, Panel::Times | Panel::Theory | Panel::Map);
    let is_low = matches!(panel, Panel::Map | Panel::LightSpace);
    let x = if is_right { picture.right() - width - 24.0 } else { picture.left() + 8.0 };
    // The picture's caption stays free.
    let y = if is_low { picture.center().y - 40.0 } else { picture.top() + 52.0 };
    Pos2::new(x.max(4.0), y)
}

/// The perspective errors m_s, m_t and the worst along the middle line of sight, by depth; `None`
/// where no map serves the point.
fn errors_along(plan: &Plan, camera: &Camera) -> Vec<(f64, Option<[f64; 3]>)> {
    let middle = DVec2::from(camera.image().map(f64::from)) / 2.0;
    let ray = camera.ray(middle);
    let (near, far) = (camera.near().max(camera.far() * 1e-6), camera.far());
    let depth = |i: u32| near * (far / near).powf(f64::from(i) / f64::from(DEPTHS - 1)) * 0.999_999;
    let errors = |z: f64| {
        let position = camera.eye() + ray.at(z);
        let (map, _) = plan.lookup(0, position).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let error = plan.maps[map].perspective_error(camera, position)?;
        Some([error.s, error.t, error.worst])
    };
    (0..DEPTHS).map(|i| (depth(i), errors(depth(i)))).collect()
}

/// The title of a window, in place of egui's own, whose buttons have no tooltips. Gives whether the
/// window shall close.
fn title(ui: &mut Ui, name: &str) -> bool {
    let is_closed = ui.horizontal(|ui| {
        ui.label(RichText::new(name).strong());
        let right_to_left = egui::Layout::right_to_left(egui::Align::Center);
        let button = ui.with_layout(right_to_left, |ui| ui.small_button("×"));
        button.inner.tip("Close this window (Escape).").clicked()
    });
    ui.separator();
    is_closed.inner
}

fn help(ui: &mut Ui) {
    egui::ScrollArea::vertical().max_height(420.0).show(ui, |ui| {
        Grid::new("keys").striped(true).num_columns(2).show(ui, |ui| {
            for (keys, meaning) in KEYS {
                ui.label(RichText::new(*keys).strong());
                ui.label(*meaning);
                ui.end_row();
            }
        });
    });
}
