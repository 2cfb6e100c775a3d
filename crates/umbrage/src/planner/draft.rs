//! Drafts: maps without a resolution. Their matrices do not depend on one.

use super::Request;
use crate::aliasing::Local;
use crate::bounds::Aabb;
use crate::camera::Camera;
use crate::casters::{convex_outline, outer_points};
use crate::focus::{Body, CellView};
use crate::math::range;
use crate::matrices::{DepthRange, filling_unit_square, lambda, matrices};
use crate::partition::Along;
use crate::plan::{MapError, Part, Rows, ShadowMap, Slab};
use crate::slab::along_axis;
use crate::stable::{Stable, bounding_sphere};
use crate::technique::{Cover, Objective, Warp};
use crate::warp::{LightSpace, OnePoint, Precision, Search, Seen, Shape, View, psm};
use crate::worst::{self, worst_in_s_and_t};
use glam::{DMat3, DMat4, DVec2, DVec3};

/// What the planner knows about a map besides the map itself.
#[derive(Clone, Debug, Default)]
pub(super) struct Draft {
    /// The map, with everything that does not depend on its resolution.
    pub(super) map: ShadowMap,
    /// Whether the draft is that of the last plan.
    pub(super) is_kept: bool,
    /// The receivers that the map serves.
    pub(super) body: Body,
    /// The body's bounding box; not set if the body is empty.
    pub(super) bounds: Aabb,
    /// The body's vertices in light space, in the same order.
    pub(super) seen: Vec<Seen>,
    /// Indices of the vertices on the body's outline as the light sees it, counter-clockwise.
    pub(super) outline: Vec<u32>,
    /// The map's shape on the light plane, if it is a one-point map with even rows under parallel
    /// light. Its errors follow from the shape and the points seen.
    pub(super) shape: Option<Shape>,
    /// Upper bounds of the map's largest errors in s and t if it had one texel, where the choice of
    /// its warp required them.
    pub(super) largest_errors: Option<[f64; 2]>,
    /// The placement of a stable map, whose matrices do depend on its resolution.
    pub(super) stable: Option<Stable>,
}

/// Buffers kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Drafting {
    /// The points that a map covers, in light space, where these are more than the body's vertices.
    covered: Vec<Seen>,
    /// Light-space x and z of the outline of the points covered.
    outline: Vec<DVec2>,
    hull: Vec<u32>,
    search: Search,
    worst: worst::Buffers,
}

/// A part of the view on the light plane, and the warp chosen for it.
struct Chosen {
    space: LightSpace,
    family: OnePoint,
    nu: f64,
}

/// The largest number of cells in a body whose edges are sampled under a lamp.
const FEW_CELLS: usize = 4;

impl Draft {
    /// Sets what the light sees of the body.
    pub(super) fn see(&mut self, space: &LightSpace, camera: &Camera, precision: Precision) {
        self.seen.clear();
        self.seen.extend(self.body.vertices().iter().map(|&v| Seen::new(v, space, camera)));
        match precision {
            Precision::Final => convex_outline(&mut self.outline, &self.seen),
            // More points than those on the outline are right as well.
            Precision::Trial => outer_points(&mut self.outline, &self.seen),
        }
    }

    /// The least and the largest w of a one-point map over the points seen.
    pub(super) fn range_of_w(&self, shape: &Shape) -> [f64; 2] {
        range(self.outline.iter().map(|&i| shape.w(self.seen[i as usize].xz.y))).into()
    }
}

impl Drafting {
    /// Sets everything of a map that does not depend on its resolution. Returns its largest errors
    /// in s and t if it had one texel, pixels per texel, or 0 if it serves no receivers.
    pub(super) fn draft(
        &mut self,
        draft: &mut Draft,
        along: &Along,
        warp: Warp,
        request: &Request<'_>,
    ) -> [f64; 2] {
        let Some(Chosen { space, family, nu }) =
            self.choose(draft, along, warp, Precision::Final, request)
        else {
            return [0.0; 2];
        };
        let camera = request.camera;
        let Self { covered, outline, worst, .. } = self;
        let Draft { map, body, seen, shape, largest_errors, .. } = draft;
        // The errors of a map of one texel determine the resolution.
        map.resolution = [1, 1];
        map.apex = space.apex;
        map.slab = along_axis(&space);
        let set = |map: &mut ShadowMap, homography: DMat3| {
            let depth = DepthRange::of(covered, homography, &space);
            [map.shadow_from_local, map.local_from_shadow] = matrices(homography, depth, &space);
            map.lambda = lambda(homography, outline);
        };
        if warp == Warp::Psm {
            let general = psm(&space, camera, body.vertices());
            if let Some(homography) = general.and_then(|h| filling_unit_square(h, covered)) {
                set(map, homography);
                return unit_errors(map, body, camera);
            }
        }
        if warp == Warp::Log && nu > 1e-9 {
            map.rows = Rows::Logarithmic { ratio: 1.0 + nu };
        }
        let chosen = family.shape(nu, outline);
        set(map, chosen.homography());
        if space.apex.is_none() && map.rows == Rows::Even {
            *shape = Some(chosen);
            return shape_errors(&chosen, seen, camera);
        }
        // Under a spot light `adaptive` chooses a warp from sample points. A comparison of the true
        // errors ensures that it is never worse than `uniform`. They are kept, so that the errors
        // reported compare in the same way.
        if warp == Warp::Adaptive(Objective::Storage) && nu > 0.0 {
            let warped = worst_in_s_and_t(map, body, camera, worst);
            set(map, family.shape(0.0, outline).homography());
            let even = worst_in_s_and_t(map, body, camera, worst);
            let is_better = warped[0] * warped[1] < even[0] * even[1];
            if is_better {
                set(map, chosen.homography());
            }
            *largest_errors = Some(if is_better { warped } else { even });
        }
        unit_errors(map, body, camera)
    }

    /// The number of texels, up to a factor common to all slices of a part, that a map of the
    /// draft's body needs for a given error. It costs less than [`draft`](Self::draft).
    pub(super) fn storage(
        &mut self,
        draft: &mut Draft,
        along: &Along,
        warp: Warp,
        request: &Request<'_>,
    ) -> f64 {
        let Some(Chosen { family, nu, .. }) =
            self.choose(draft, along, warp, Precision::Trial, request)
        else {
            return 0.0;
        };
        let [s, t] = shape_errors(&family.shape(nu, &self.outline), &draft.seen, request.camera);
        s * t
    }

    /// Looks at a body from the light and chooses the strength of its warp; `None` if the body is
    /// empty.
    fn choose(
        &mut self,
        draft: &mut Draft,
        along: &Along,
        warp: Warp,
        precision: Precision,
        request: &Request<'_>,
    ) -> Option<Chosen> {
        let Request { camera, projector, technique, .. } = *request;
        if draft.body.is_empty() {
            draft.seen.clear();
            draft.outline.clear();
            return None;
        }
        let covers_scene = technique.cover == Cover::Scene;
        draft.bounds = draft.body.bounds();
        let middle = draft.bounds.center();
        let space = match along {
            _ if covers_scene => LightSpace::fixed(projector, camera),
            Along::View => LightSpace::following_view(projector, camera, middle),
            Along::Side(side) => LightSpace::following_face(projector, camera, side, middle),
        };
        draft.see(&space, camera, precision);
        let Self { covered, outline, hull, search, .. } = self;
        let see = |p: DVec3| Seen::new(p, &space, camera);
        covered.clear();
        covered.extend_from_slice(&draft.seen);
        outline.clear();
        if covers_scene {
            // A map over the whole scene also covers the points seen, because flat bounds of
            // receivers were thickened a little.
            covered.extend(request.whole_scene(&space).map(see));
            convex_outline(hull, covered);
            outline.extend(hull.iter().map(|&i| covered[i as usize].xz));
        } else {
            outline.extend(draft.outline.iter().map(|&i| draft.seen[i as usize].xz));
            if space.apex.is_some() && draft.body.cells().count() <= FEW_CELLS {
                // Under a spot light, errors need not be largest at vertices. These additional
                // points on edges suffice to choose a warp; the errors reported do not depend on
                // them. Where there are many cells, their vertices lie close enough.
                let vertices = draft.body.vertices();
                let edges = draft.body.cells().flat_map(CellView::edges);
                covered.extend(edges.flat_map(|[a, b]| {
                    [0.25, 0.5, 0.75].map(|k| see(vertices[a].lerp(vertices[b], k)))
                }));
            }
        }
        let view = View { seen: covered, outline };
        let family = OnePoint::around(&view, &space);
        let nu = family.strength(warp, &view, &space, camera, (search, precision));
        Some(Chosen { space, family, nu })
    }
}

/// Largest m_s and m_t of a one-point map of one texel over the points seen.
pub(super) fn shape_errors(shape: &Shape, seen: &[Seen], camera: &Camera) -> [f64; 2] {
    let (mut s, mut t) = (0f64, 0f64);
    for p in seen {
        let w = shape.w(p.xz.y);
        (s, t) = (s.max(p.base * w), t.max(p.height * w * w));
    }
    let texel = shape.texel_over_w(1.0, 0.0, [1.0; 2]);
    let pixel = camera.pixel_width_per_scale();
    [s * texel.base / pixel, t * texel.height / pixel]
}

impl Request<'_> {
    /// Corners of the whole scene's bounds, in local space.
    fn whole_scene(&self, space: &LightSpace) -> [DVec3; 8] {
        let eye = self.camera.eye();
        let scene = self.bounds.receivers.map(|r| self.bounds.casters.map_or(r, |c| r.union(c)));
        match (self.projector.corners(eye), scene) {
            (Some(corners), _) => corners,
            (_, Some(scene)) => scene.relative_to(eye).corners(),
            (_, None) => bounding_cube(self.camera, space),
        }
    }
}

/// An empty map.
impl Default for ShadowMap {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            shadow_from_local: DMat4::IDENTITY,
            local_from_shadow: DMat4::IDENTITY,
            rows: Rows::Even,
            resolution: [0, 0],
            part: Part::default(),
            split: [0.0, 0.0],
            cell: Vec::new(),
            fade_from: None,
            lambda: None,
            error: MapError::default(),
            storage_factor: 0.0,
            caster_planes: Vec::new(),
            apex: None,
            slab: Slab::default(),
        }
    }
}

impl ShadowMap {
    /// Replaces the map by a copy of another. (`Clone::clone_from` would not keep the buffers.)
    pub(super) fn copy_from(&mut self, other: &Self) {
        let [mut cell, mut caster_planes] =
            [&mut self.cell, &mut self.caster_planes].map(std::mem::take);
        cell.clone_from(&other.cell);
        caster_planes.clone_from(&other.caster_planes);
        *self = Self { cell, caster_planes, ..*other };
    }

    /// Makes the map empty, but keeps its buffers.
    pub(super) fn clear(&mut self, camera: &Camera) {
        let [mut cell, mut caster_planes] =
            [&mut self.cell, &mut self.caster_planes].map(std::mem::take);
        cell.clear();
        caster_planes.clear();
        *self = Self { origin: camera.eye(), cell, caster_planes, ..Self::default() };
    }
}

/// Largest m_s and m_t of a map over the body's vertices.
fn unit_errors(map: &ShadowMap, body: &Body, camera: &Camera) -> [f64; 2] {
    let pixel = camera.pixel_width_per_scale();
    body.vertices().iter().filter_map(|&v| Some((v, Local::at(map, v)?.footprint()))).fold(
        [0.0f64; 2],
        |[s, t], (v, footprint)| {
            let width = camera.scale_of(v) * pixel;
            [s.max(footprint.base() / width), t.max(footprint.height() / width)]
        },
    )
}

/// The corners of a cube around the view frustum's bounding sphere, with sides along light space's
/// axes.
fn bounding_cube(camera: &Camera, space: &LightSpace) -> [DVec3; 8] {
    let (center, radius) = bounding_sphere(camera, [camera.near(), camera.far()]);
    let axes = [space.x, space.y, space.z].map(|row| row.truncate() * radius);
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        center + axes[0] * sign(0) + axes[1] * sign(1) + axes[2] * sign(2)
    })
}
