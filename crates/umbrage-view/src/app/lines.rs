//! Lines of the planned view V, of body B and of the warps W, and the legends of overlays.

use crate::settings::OverlayKind;
use crate::stage::{DrawnPicture, Frame};
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, vec2};
use glam::{DVec2, DVec3};
use umbrage::paged::texel_width;
use umbrage::{Camera, Plan, ShadowMap};
use umbrage_measure::{
    ErrorScale, FALSE_LIGHT, FALSE_SHADOW, LEVELS, PARTITIONS, Rgb, level_scale,
};

/// Colours of the lines.
pub(super) const VIEW: Color32 = Color32::from_rgb(255, 255, 255);
pub(super) const BODY: Color32 = Color32::from_rgb(90, 220, 120);

/// A line in the world, and what it belongs to.
pub(super) struct Line {
    ends: [DVec3; 2],
    color: Color32,
}

impl Line {
    /// Body B has many edges, which should not hide the others.
    fn stroke(&self) -> Stroke {
        match self.color == BODY {
            true => Stroke::new(1.0, self.color.gamma_multiply(0.6)),
            false => Stroke::new(2.0, self.color),
        }
    }
}

/// The lines of a frame: the frustum V of the camera that maps were planned for, body B, and for
/// each map its warp W, the space that it covers.
pub(super) fn lines(frame: &Frame, drawn: &DrawnPicture) -> Vec<Line> {
    let planned_for = frame.request.planned_for.as_ref().unwrap_or(&frame.request.camera);
    let mut lines: Vec<Line> = Vec::new();
    lines.extend(frame.body.iter().map(|&ends| Line { ends, color: BODY }));
    for (i, map) in drawn.plan.maps.iter().enumerate().filter(|(_, map)| !map.is_empty()) {
        let color = map_color(i);
        lines.extend(warp_edges(map).map(|ends| Line { ends, color }));
    }
    lines.extend(view_edges(planned_for).into_iter().map(|ends| Line { ends, color: VIEW }));
    lines
}

/// The colour of a map.
pub(super) fn map_color(index: usize) -> Color32 {
    color(PARTITIONS[index % PARTITIONS.len()])
}

fn color([r, g, b]: Rgb) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// The edges of a box whose corners are numbered by bits.
const BOX_EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// The edges of a camera's frustum, world space, metres.
pub(super) fn view_edges(camera: &Camera) -> Vec<[DVec3; 2]> {
    let [width, height] = camera.image().map(f64::from);
    let corners: [DVec3; 8] = std::array::from_fn(|i| {
        let pick = |bit: usize, high: f64| if i >> bit & 1 == 1 { high } else { 0.0 };
        let ray = camera.ray(DVec2::new(pick(0, width), pick(1, height)));
        camera.eye() + ray.at(if i >> 2 & 1 == 1 { camera.far() } else { camera.near() })
    });
    BOX_EDGES.map(|ends| ends.map(|i| corners[i])).to_vec()
}

/// The edges of the space that a map covers: a box in shadow space, and in the world a frustum.
pub(super) fn warp_edges(map: &ShadowMap) -> impl Iterator<Item = [DVec3; 2]> {
    let corners: [Option<DVec3>; 8] = std::array::from_fn(|i| {
        let corner = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2 & 1) as f64);
        let h = map.local_from_shadow * corner.extend(1.0);
        let local = h.truncate() / h.w;
        local.is_finite().then(|| local + map.origin)
    });
    BOX_EDGES.into_iter().filter_map(move |[a, b]| Some([corners[a]?, corners[b]?]))
}

/// Draws lines of the world into a picture of a camera.
pub(super) fn paint_in_world(painter: &Painter, rect: Rect, camera: &Camera, lines: &[Line]) {
    for line in lines {
        let Some(ends) = in_picture(camera, line.ends) else { continue };
        let [width, height] = camera.image().map(|n| n as f32);
        let at = |p: DVec2| {
            rect.min + vec2(p.x as f32 / width * rect.width(), p.y as f32 / height * rect.height())
        };
        painter.line_segment(ends.map(at), line.stroke());
    }
}

/// Where a line is in a picture, pixels; `None` if it is behind the viewer.
fn in_picture(camera: &Camera, [mut a, mut b]: [DVec3; 2]) -> Option<[DVec2; 2]> {
    let nearest = camera.near().max(1e-9) * 0.5;
    let [depth_a, depth_b] = [a, b].map(|p| camera.depth(p) - nearest);
    if depth_a <= 0.0 && depth_b <= 0.0 {
        return None;
    }
    let crossing = || a.lerp(b, (depth_a / (depth_a - depth_b)).clamp(0.0, 1.0));
    if depth_a < 0.0 {
        a = crossing();
    } else if depth_b < 0.0 {
        b = crossing();
    }
    // Far outside the picture, single precision would bend the line.
    let is_near = |p: &DVec2| p.abs().max_element() < 1e6;
    Some([camera.pixel(a).filter(is_near)?, camera.pixel(b).filter(is_near)?])
}

/// Draws the lines as the light sees them, within a rectangle. `towards` is the direction in which
/// the light travels, and `up` that which is up in the drawing as far as possible.
pub(super) fn paint_from_light(
    painter: &Painter,
    rect: Rect,
    lines: &[Line],
    towards: DVec3,
    up: DVec3,
) {
    let right =
        towards.cross(up).try_normalize().unwrap_or_else(|| towards.any_orthonormal_vector());
    let up = right.cross(towards);
    let flat = |p: DVec3| DVec2::new(p.dot(right), -p.dot(up));
    let points = || lines.iter().flat_map(|line| line.ends.map(flat));
    let min = points().fold(DVec2::INFINITY, DVec2::min);
    let max = points().fold(DVec2::NEG_INFINITY, DVec2::max);
    if !(min.is_finite() && max.is_finite()) {
        return;
    }
    let size = (max - min).max(DVec2::splat(1e-9));
    let scale = (f64::from(rect.width()) / size.x).min(f64::from(rect.height()) / size.y) * 0.92;
    let middle = (min + max) / 2.0;
    let at = |p: DVec3| {
        let p = (flat(p) - middle) * scale;
        rect.center() + vec2(p.x as f32, p.y as f32)
    };
    for line in lines {
        painter.line_segment(line.ends.map(at), line.stroke());
    }
}

/// Draws a view's frustum as it is projected into a map, over the map's picture.
pub(super) fn paint_in_map(painter: &Painter, rect: Rect, map: &ShadowMap, camera: &Camera) {
    /// Points along an edge: rows of a map need not be even.
    const STEPS: u32 = 32;
    let painter = painter.with_clip_rect(rect);
    for [a, b] in view_edges(camera) {
        let along = (0..=STEPS).map(|i| a.lerp(b, f64::from(i) / f64::from(STEPS)));
        let points: Vec<Option<Pos2>> = along
            .map(|p| {
                let st = map.project(p)?;
                let row = map.rows.row_from_t(st.y);
                let at = vec2(st.x as f32 * rect.width(), row as f32 * rect.height());
                (at.x.abs() < 1e5 && at.y.abs() < 1e5).then(|| rect.min + at)
            })
            .collect();
        for pair in points.windows(2) {
            if let [Some(a), Some(b)] = pair {
                painter.line_segment([*a, *b], Stroke::new(1.5, BODY));
            }
        }
    }
}

/// Draws the legend of an overlay into the lower left corner of a picture.
pub(super) fn paint_legend(painter: &Painter, rect: Rect, overlay: OverlayKind, plan: &Plan) {
    let rows: Vec<(Color32, String)> = match overlay {
        OverlayKind::None => return,
        OverlayKind::Error => return paint_errors(painter, rect),
        OverlayKind::Clusters => return paint_levels(painter, rect),
        OverlayKind::Texels => vec![(color(FALSE_LIGHT), "a line every 5 texels".into())],
        OverlayKind::Partition => {
            let maps = plan.maps.iter().enumerate().filter(|(_, map)| !map.is_empty());
            maps.map(|(i, map)| (map_color(i), map_name(map))).take(12).collect()
        }
        OverlayKind::Pages => levels_of_pages(plan),
        OverlayKind::Difference => vec![
            (color(FALSE_LIGHT), "lit, should be dark".into()),
            (color(FALSE_SHADOW), "dark, should be lit".into()),
        ],
    };
    paint_rows(painter, rect, &rows);
}

/// The colours of the levels of pages, with the widths of their texels.
fn levels_of_pages(plan: &Plan) -> Vec<(Color32, String)> {
    let Some(grid) = plan.paging.as_ref().and_then(|paging| paging.grids.first()) else {
        return vec![(Color32::GRAY, "only paged maps have pages".into())];
    };
    let is_sun = plan.maps.first().is_some_and(|map| map.apex.is_none());
    // Under a lamp, the width a metre away from it.
    let unit = if is_sun { "m" } else { "m per m" };
    let count = PARTITIONS.len() as i32;
    let row = |i: i32| {
        let levels = (grid.first_level..=grid.last_level()).rev();
        let of_color = levels.filter(|level| level.rem_euclid(count) == i);
        let widths: Vec<_> = of_color.map(|level| short(texel_width(level))).collect();
        (map_color(i as usize), format!("texels of {} {unit}", widths.join(", ")))
    };
    (0..count).map(row).collect()
}

/// A number with two digits that tell something.
fn short(x: f64) -> String {
    let decimals = (1.0 - x.log10().floor()).max(0.0) as usize;
    format!("{x:.decimals$}")
}

/// Draws rows of a colour with its meaning into the lower left corner of a rectangle.
pub(super) fn paint_rows(painter: &Painter, rect: Rect, rows: &[(Color32, String)]) {
    const ROW: f32 = 18.0;
    let height = ROW * rows.len() as f32 + 10.0;
    let area =
        Rect::from_min_size(rect.left_bottom() - vec2(-8.0, height + 8.0), vec2(210.0, height));
    painter.rect_filled(area, 4.0, Color32::from_black_alpha(190));
    for (i, (color, meaning)) in rows.iter().enumerate() {
        let at = area.min + vec2(8.0, 5.0 + ROW * i as f32);
        painter.rect_filled(
            Rect::from_min_size(at + vec2(0.0, 3.0), vec2(12.0, 12.0)),
            2.0,
            *color,
        );
        let font = FontId::proportional(13.0);
        painter.text(at + vec2(20.0, 0.0), Align2::LEFT_TOP, meaning, font, Color32::WHITE);
    }
}

/// What a map serves, in words.
pub(super) fn map_name(map: &ShadowMap) -> String {
    let part = &map.part;
    let mut name = String::new();
    if let Some(side) = part.side {
        name += &format!("{side:?} ");
    }
    if let Some(face) = part.face {
        name += &format!("{} face ", format!("{face:?}").to_lowercase());
    }
    let [begin, end] = map.split;
    name + &format!("{begin:.3} to {end:.3} m")
}

/// Draws the scale of pixels per texel.
fn paint_errors(painter: &Painter, rect: Rect) {
    let scale = ErrorScale::default();
    let color = |share: f32| scale.color(scale.max().powf(2.0 * share - 1.0)).unwrap_or_default();
    let labels = [("1/32", 1.0 / 32.0), ("1/8", 0.125), ("1", 1.0), ("8", 8.0), ("32", 32.0)];
    let share = |error: f32| error.ln() / scale.max().ln() * 0.5 + 0.5;
    let labels = labels.map(|(label, error)| (label.to_owned(), share(error)));
    paint_scale(painter, rect, "pixels per texel", color, &labels);
}

/// Draws the colours of levels of detail.
fn paint_levels(painter: &Painter, rect: Rect) {
    let label = |level: usize| (level.to_string(), (level as f32 + 0.5) / LEVELS as f32);
    let labels: Vec<_> = (0..LEVELS).step_by(3).map(label).collect();
    paint_scale(painter, rect, "level of detail, 0 the finest", level_scale, &labels);
}

/// Draws a scale of colours into the lower left corner of a picture: the colour at each share of
/// its length, and labels at some shares.
fn paint_scale(
    painter: &Painter,
    rect: Rect,
    title: &str,
    color_at: impl Fn(f32) -> Rgb,
    labels: &[(String, f32)],
) {
    let width = (rect.width() - 40.0).clamp(80.0, 300.0);
    let area = Rect::from_min_size(rect.left_bottom() + vec2(8.0, -66.0), vec2(width + 24.0, 58.0));
    painter.rect_filled(area, 4.0, Color32::from_black_alpha(190));
    let font = FontId::proportional(13.0);
    let at = area.min + vec2(12.0, 4.0);
    painter.text(at, Align2::LEFT_TOP, title, font.clone(), Color32::WHITE);
    let bar = Rect::from_min_size(area.min + vec2(12.0, 22.0), vec2(width, 12.0));
    let steps = width as usize;
    for i in 0..steps {
        let share = i as f32 / (steps - 1) as f32;
        // Each stripe lies over the rest of the one before, so that its soft edge does not show
        // what is below the scale.
        let stripe = Rect::from_min_max(bar.min + vec2(i as f32, 0.0), bar.max);
        painter.rect_filled(stripe, 0.0, color(color_at(share)));
    }
    for (label, share) in labels {
        let at = Pos2::new(bar.left() + share * bar.width(), bar.bottom() + 2.0);
        painter.text(at, Align2::CENTER_TOP, label, font.clone(), Color32::WHITE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbrage::LookAt;

    fn camera() -> Camera {
        Camera::look_at(LookAt {
            eye: DVec3::ZERO,
            target: DVec3::NEG_Z,
            up: DVec3::Y,
            fov_y_rad: std::f64::consts::FRAC_PI_2,
            near: 1.0,
            far: 10.0,
            image: [200, 100],
        })
        .unwrap()
    }

    #[test]
    fn a_line_is_cut_before_the_viewer() {
        let camera = camera();
        let middle = in_picture(&camera, [DVec3::NEG_Z * 2.0, DVec3::NEG_Z * 5.0]).unwrap();
        assert!(middle.iter().all(|p| p.distance(DVec2::new(100.0, 50.0)) < 1e-9));
        assert!(in_picture(&camera, [DVec3::Z, DVec3::Z * 5.0]).is_none());
        // From behind the viewer to a point before it: the part that is seen is straight.
        let [a, b] =
            in_picture(&camera, [DVec3::new(1.0, 0.0, 3.0), DVec3::new(1.0, 0.0, -4.0)]).unwrap();
        assert!((a.y - 50.0).abs() < 1e-9 && (b.y - 50.0).abs() < 1e-9 && a.x > b.x, "{a} {b}");
    }

    #[test]
    fn a_warp_holds_the_receivers_of_its_map() {
        let camera = camera();
        let light = umbrage::Light::Directional { direction: DVec3::new(0.2, -1.0, 0.3) };
        let mut planner = umbrage::Planner::new();
        let bounds = umbrage::Bounds::default();
        let technique = "lispsm".parse().unwrap();
        let plan = planner.plan(&camera, &[light], &bounds, &technique).unwrap();
        let map = &plan.maps[0];
        assert_eq!(warp_edges(map).count(), 12);
        for end in warp_edges(map).flatten() {
            let p = map.project(end).unwrap();
            assert!(p.cmpge(DVec3::splat(-1e-6)).all() && p.cmple(DVec3::splat(1.0 + 1e-6)).all());
        }
        assert_eq!(view_edges(&camera).len(), 12);
        let far = view_edges(&camera).into_iter().flatten().filter(|p| (p.z + 10.0).abs() < 1e-9);
        assert_eq!(far.count(), 12, "four edges of the far side twice, four to it once");
    }
}
