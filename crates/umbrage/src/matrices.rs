//! A map's matrices, from a homography of the light plane and a range of depths.

use crate::math::range;
use crate::plan::ShadowMap;
use crate::warp::{LightSpace, Seen};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

/// Scales and shifts a homography's s and t so that the points seen fill [0, 1]², and scales w so
/// that its least value is 1. `None` if w is not positive everywhere, which rounding can cause
/// where distances differ by many orders of magnitude.
pub(crate) fn filling_unit_square(homography: DMat3, seen: &[Seen]) -> Option<DMat3> {
    let [s, t, w] = [0, 1, 2].map(|i| homography.row(i));
    let value = |row: DVec3, p: &Seen| row.dot(p.xz.extend(1.0));
    let (least_w, _) = range(seen.iter().map(|p| value(w, p)));
    let filling = |row: DVec3| {
        let (lo, hi) = range(seen.iter().map(|p| value(row, p) / value(w, p)));
        (row - w * lo) / ((hi - lo).max(1e-12 * hi.abs().max(lo.abs())) * least_w)
    };
    (least_w > 0.0).then(|| DMat3::from_cols(filling(s), filling(t), w / least_w).transpose())
}

/// The light-space y at which depth is 0 and 1 where w = 1, metres (under spot lights in units of
/// light-space y). y is counted from `middle` away from the light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthRange {
    middle: f64,
    nearest: f64,
    span: f64,
}

impl DepthRange {
    /// The range of depths of `radius` to both sides of `middle`.
    pub(crate) fn around(middle: f64, radius: f64) -> Self {
        Self { middle, nearest: -radius, span: 2.0 * radius }
    }

    /// The range of depths from the nearest to the farthest point covered.
    pub(crate) fn of(covered: &[Seen], homography: DMat3, space: &LightSpace) -> Self {
        let w = homography.row(2);
        let (y0, y1) = range(covered.iter().map(|p| p.y));
        // y is counted from the middle of its range (Wimmer et al. 2004, §3.4), so that the
        // perspective tilts depth as little as possible.
        let middle = y0.midpoint(y1);
        let depth = |p: &Seen| (middle - p.y) / w.dot(p.xz.extend(1.0));
        let (nearest, farthest) = range(covered.iter().map(depth));
        // A body that is flat across the light has no range of depths. It gets one wide enough for
        // single precision.
        let [width, height] = [0, 1].map(|axis| {
            let (lo, hi) = range(covered.iter().map(|p| p.xz[axis]));
            hi - lo
        });
        // The change of y that corresponds to a unit of x or z, which is 1/distance for a spot
        // light.
        let unit = if space.apex.is_some() { y1 } else { 1.0 };
        let span = (farthest - nearest).max(1e-3 * width.max(height) * unit);
        Self { middle, nearest: nearest.midpoint(farthest) - span / 2.0, span }
    }
}

/// The transform from local to shadow space, and its inverse. s, t and w are the homography's;
/// depth grows linearly away from the light and is divided by w.
pub(crate) fn matrices(homography: DMat3, depth: DepthRange, space: &LightSpace) -> [DMat4; 2] {
    let DepthRange { middle, nearest, span } = depth;
    // Rows of the numerators over light space's (x, y, z, w).
    let on_plane = |row: DVec3| DVec4::new(row.x, 0.0, row.y, row.z);
    let rows = [0, 1, 2].map(|i| on_plane(homography.row(i)));
    let depth_row = (DVec4::new(0.0, -1.0, 0.0, middle) - rows[2] * nearest) / span;
    let shadow_from_light = DMat4::from_cols(rows[0], rows[1], depth_row, rows[2]).transpose();
    // The inverse is put together from parts: x, z and w from the homography's inverse, and y from
    // these and depth. A general inverse would lose digits where near and far are orders of
    // magnitude apart.
    let inverse = homography.inverse();
    let [x, z, w] = [0, 1, 2].map(|i| inverse.row(i)).map(|r| DVec4::new(r.x, r.y, 0.0, r.z));
    let y = w * middle - DVec4::new(0.0, 0.0, span, nearest);
    let light_from_shadow = DMat4::from_cols(x, y, z, w).transpose();
    [shadow_from_light * space.light_from_local(), space.local_from_light() * light_from_shadow]
}

/// Distance between depth 0 and the receiver nearest the light, in texel widths measured as depth
/// along the beam: twice the reach of a filter to one side. Casters in front of the receivers are
/// clamped to depth 0, and a shadow test must still distinguish them from a receiver less all of
/// its slack.
pub(crate) const MARGIN_TEXELS: f64 = 16.0;

impl ShadowMap {
    /// Moves depth 0 towards the light by this share of the range of depths.
    pub(crate) fn begin_earlier(&mut self, share: f64) {
        let m = &mut self.shadow_from_local;
        let depth = (m.row(2) + m.row(3) * share) / (1.0 + share);
        let rows = [m.row(0), m.row(1), depth, m.row(3)];
        *m = DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
        let inverse = &mut self.local_from_shadow;
        inverse.w_axis -= inverse.z_axis * share;
        inverse.z_axis *= 1.0 + share;
    }
}

/// λ: the distance of the points seen, given by their outline, from the line on which the
/// homography's w vanishes. `None` if w is constant.
pub(crate) fn lambda(homography: DMat3, outline: &[DVec2]) -> Option<f64> {
    let w = homography.row(2);
    let (lo, hi) = range(outline.iter().map(|p| w.dot(p.extend(1.0))));
    (hi > lo * (1.0 + 1e-9)).then(|| lo / w.truncate().length())
}
