use super::data;
use crate::{DepthProjection, Error, Redraw};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Vec4};
use umbrage::{Plane, ShadowMap};

/// A view for which clusters are chosen: a shadow map, or a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusterView {
    pub(crate) rows: [DVec4; 3],
    /// The row of depth, times w, in a picture.
    depth: DVec4,
    /// Width and height, texels or pixels.
    pub(crate) size: DVec2,
    /// Half-spaces around all that counts, in the space of `rows`.
    pub(crate) planes: Vec<Vec4>,
    /// The least w of what counts, 0 if it has none.
    pub(crate) nearest: f64,
    pub(crate) share: f32,
    pub(crate) is_picture: bool,
    /// Of a map whose pages are drawn.
    pub(crate) pages: Option<PagesOfView>,
}

/// What a view is told of the pages of its map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PagesOfView {
    /// The map's index.
    pub(crate) map: u32,
    /// Pages across the map's window.
    pub(crate) side: u32,
    /// The place of the window's first entry among those that tell what is fresh.
    pub(crate) table: u32,
    /// The lower 32 bits of the indices of the window's first page.
    pub(crate) first: [i32; 2],
    /// How far beyond a page its casters count, texels.
    pub(crate) reach: f32,
    /// `STILL` of `pages/data.rs` if those pages count alone in which what stands still is drawn.
    pub(crate) still: u32,
}

impl ClusterView {
    /// A picture. `pixels_from_render` takes points of render space to pixel coordinates from the
    /// upper left corner, times w, in its first two rows, to its depth, times w, in the third, and to w
    /// in the last; w must be positive in the picture, and at least `nearest`. `planes` (render space) are around all that the
    /// picture shows. In the picture, no surface is off by more than `share` pixels.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a value is not finite, if `share` is negative or `size` is 0.
    pub fn picture(
        pixels_from_render: DMat4,
        size: [u32; 2],
        nearest: f64,
        planes: &[Plane],
        share: f32,
    ) -> Result<Self, Error> {
        let invalid = |field, problem| Err(Error::Invalid { field, problem });
        if !(share >= 0.0 && share.is_finite()) {
            return invalid("share", format!("must be finite and at least 0, is {share}"));
        }
        if !pixels_from_render.is_finite() || size.contains(&0) || nearest.is_nan() {
            return invalid(
                "pixels_from_render",
                format!(
                    "must be finite, for at least one pixel, is {pixels_from_render} for {size:?}"
                ),
            );
        }
        Ok(Self {
            rows: [0, 1, 3].map(|i| pixels_from_render.row(i)),
            depth: pixels_from_render.row(2),
            size: DVec2::from(size.map(f64::from)),
            planes: planes.iter().map(|p| p.normal.extend(p.offset).as_vec4()).collect(),
            nearest: nearest.max(0.0),
            share,
            is_picture: true,
            pages: None,
        })
    }

    /// A map, or the part of it that is drawn.
    pub(crate) fn map(redraw: &Redraw<'_>, render_origin: DVec3, share: f32) -> Self {
        let map = redraw.shadow_map;
        Self { share, ..Self::of_map(map, redraw.local_planes(), render_origin) }
    }

    /// A map whose pages are drawn.
    pub(crate) fn of_pages(
        map: &ShadowMap,
        pages: PagesOfView,
        render_origin: DVec3,
        share: f32,
    ) -> Self {
        // Under parallel light the window's four sides, which come first, bound what its pages may
        // show, and each ball is tested against those pages.
        let sides = if map.apex.is_none() { 4 } else { 0 };
        let planes = map.caster_planes.iter().skip(sides);
        let planes = planes.map(|p| p.normal.extend(p.offset).as_vec4());
        Self { share, pages: Some(pages), ..Self::of_map(map, planes, render_origin) }
    }

    /// A map, of which something is drawn within these half-spaces (local space).
    fn of_map(
        map: &ShadowMap,
        local_planes: impl Iterator<Item = Vec4>,
        render_origin: DVec3,
    ) -> Self {
        let local_from_render = render_origin - map.origin;
        let m = map.shadow_from_local * DMat4::from_translation(local_from_render);
        let size = DVec2::from(map.resolution.map(f64::from));
        let w = m.row(3);
        // Under parallel light, w does not depend on the distance from the light. The least w of the
        // map then is that of one of its corners. Casters of a lamp may be arbitrarily near to it.
        let inverse_w = map.local_from_shadow.row(3);
        let nearest = if inverse_w.z == 0.0 {
            let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
            let at = corners.map(|(s, t)| inverse_w.w + inverse_w.x * s + inverse_w.y * t);
            let largest = at.into_iter().fold(0.0, f64::max);
            if largest > 0.0 { 1.0 / largest } else { 0.0 }
        } else {
            0.0
        };
        let planes = local_planes.map(|plane| {
            let offset = f64::from(plane.w) + plane.truncate().as_dvec3().dot(local_from_render);
            plane.truncate().extend(offset as f32)
        });
        Self {
            rows: [m.row(0) * size.x, m.row(1) * size.y, w],
            depth: m.row(2),
            size,
            planes: planes.collect(),
            nearest,
            share: 0.0,
            is_picture: false,
            pages: None,
        }
    }

    /// The row with which points of render space have their distance along the view, metres; `None`
    /// if the view has no such projection.
    pub(crate) fn distance(&self, projection: DepthProjection) -> Option<DVec4> {
        let w = self.rows[2];
        let row = if projection.is_orthographic {
            (w * projection.base - self.depth) / projection.per_nearness
        } else {
            w
        };
        let length = row.truncate().length();
        let has_kind = (w.truncate() == DVec3::ZERO) == projection.is_orthographic;
        (has_kind && length > 0.0 && length.is_finite()).then(|| row / length)
    }

    /// The struct that shaders read. Its planes begin at `first_plane`.
    pub(crate) fn data(&self, first_plane: u32, first_draw: u32) -> data::View {
        let [s, t, w] = self.rows;
        // The numerator of the Jacobian is linear in the texel coordinates, so its largest singular
        // value is largest at a corner.
        let DVec2 { x: width, y: height } = self.size;
        let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
        let densest = corners.map(|(x, y)| {
            let w = w.truncate();
            largest_singular_value(s.truncate() - w * x, t.truncate() - w * y)
        });
        let roles = if self.is_picture { data::SEEN } else { data::CASTS };
        data::View {
            s: s.as_vec4(),
            t: t.as_vec4(),
            w: w.as_vec4(),
            densest: (densest.into_iter().fold(0.0, f64::max) * (1.0 + 1e-6)) as f32,
            // Rounding must not put anything nearer.
            nearest: (self.nearest * (1.0 - 1e-5)) as f32,
            slope: w.truncate().length() as f32,
            share: self.share,
            first_plane,
            plane_count: self.planes.len() as u32,
            first_draw,
            roles,
            is_picture: self.is_picture.into(),
            page_map: self.pages.map_or(0, |pages| pages.map + 1),
            page_side: self.pages.map_or(0, |pages| pages.side),
            page_table: self.pages.map_or(0, |pages| pages.table),
            page_first: self.pages.map_or([0; 2], |pages| pages.first),
            page_reach: self.pages.map_or(0.0, |pages| pages.reach),
            page_still: self.pages.map_or(0, |pages| pages.still),
        }
    }
}

/// The larger singular value of the matrix with two rows.
fn largest_singular_value(a: DVec3, b: DVec3) -> f64 {
    let [aa, bb, ab] = [a.length_squared(), b.length_squared(), a.dot(b)];
    (0.5 * (aa + bb) + (0.5 * (aa - bb)).hypot(ab)).sqrt()
}

/// The largest factor by which a matrix stretches a vector.
pub(crate) fn stretch(m: DMat3) -> f64 {
    // The power method converges to the largest eigenvalue from below; the Frobenius norm bounds it.
    let square = m.transpose() * m;
    let mut bound = square;
    // tr(Aⁿ)^(1/n) falls towards the largest eigenvalue of A, of which it is never less.
    let scale = square.to_cols_array().into_iter().fold(0.0, |a: f64, c| a.max(c.abs()));
    if scale <= 0.0 || !scale.is_finite() {
        return 0.0;
    }
    bound *= 1.0 / scale;
    let mut exponent = 0.0;
    let mut power = 1.0;
    for _ in 0..6 {
        bound *= bound;
        power *= 2.0;
        exponent *= 2.0;
        let trace = bound.x_axis.x + bound.y_axis.y + bound.z_axis.z;
        bound *= 1.0 / trace;
        exponent += trace.ln();
    }
    let trace = bound.x_axis.x + bound.y_axis.y + bound.z_axis.z;
    (scale * ((exponent + trace.ln()) / power).exp()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretch_is_the_largest_singular_value() {
        let turn = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
        let other = DMat3::from_euler(glam::EulerRot::XYZ, -1.3, 0.2, 2.7);
        for scale in [[1.0, 1.0, 1.0], [2.0, 3.0, 0.1], [1e-6, 1e-9, 1e-6], [-4.0, 1e5, 7.0]] {
            let m = turn * DMat3::from_diagonal(DVec3::from(scale)) * other;
            let largest = scale.into_iter().fold(0.0, |a: f64, c| a.max(c.abs()));
            let bound = stretch(m);
            assert!(bound >= largest * (1.0 - 1e-12), "{scale:?}: {bound}");
            assert!(bound <= largest * 1.01, "{scale:?}: {bound}");
        }
        assert_eq!(stretch(DMat3::ZERO), 0.0);
    }
}
