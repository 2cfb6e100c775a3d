//! Drafts: maps without a resolution. Their matrices do not depend on one.

use super::Request;
use crate::aliasing::Local;
use crate::camera::Camera;
use crate::focus::Body;
use crate::matrices::{DepthRange, filling_unit_square, lambda, matrices};
use crate::partition::Along;
use crate::plan::{MapError, Part, Rows, ShadowMap, Slab};
use crate::slab::along_axis;
use crate::stable::{Stable, bounding_sphere};
use crate::technique::{Cover, Objective, Warp};
use crate::warp::{LightSpace, OnePoint, Seen, psm};
use crate::worst::{self, worst_errors};
use glam::{DMat3, DMat4, DVec3};

/// What the planner knows about a map besides the map itself.
#[derive(Clone, Debug, Default)]
pub(super) struct Draft {
    /// The receivers that the map serves.
    pub(super) body: Body,
    /// The placement of a stable map, whose matrices do depend on its resolution.
    pub(super) stable: Option<Stable>,
}

/// Buffers kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Drafting {
    seen: Vec<Seen>,
    /// The points that a map over the whole scene covers, in light space.
    covered: Vec<Seen>,
    worst: worst::Buffers,
}

impl Drafting {
    /// Sets everything of a map that does not depend on its resolution. Returns its largest errors
    /// in s and t if it had one texel, pixels per texel, or 0 if it serves no receivers. If
    /// `is_trial` is set, the map may be slightly worse.
    pub(super) fn draft(
        &mut self,
        map: &mut ShadowMap,
        body: &Body,
        along: &Along,
        warp: Warp,
        is_trial: bool,
        request: &Request<'_>,
    ) -> [f64; 2] {
        let Request { camera, projector, technique, .. } = *request;
        let Some(middle) = body.middle() else { return [0.0; 2] };
        let covers_scene = technique.cover == Cover::Scene;
        let space = &match along {
            _ if covers_scene => LightSpace::fixed(projector, camera),
            Along::View => LightSpace::following_view(projector, camera, middle),
            Along::Side(side) => LightSpace::following_face(projector, camera, side, middle),
        };
        let Self { seen, covered, worst, .. } = self;
        let see = |p: DVec3| Seen::new(p, space, camera);
        seen.clear();
        seen.extend(body.vertices().iter().map(|&v| see(v)));
        if space.apex.is_some() {
            // Under a spot light, errors need not be largest at vertices. These additional points
            // on edges suffice to choose a warp; the errors reported do not depend on them.
            let vertices = body.vertices();
            seen.extend(body.edges().flat_map(|[a, b]| {
                [0.25, 0.5, 0.75].map(|k| see(vertices[a].lerp(vertices[b], k)))
            }));
        }
        let seen = &*seen;
        // A map over the whole scene also covers the points seen, because flat bounds of receivers
        // were thickened a little.
        let covered: &[Seen] = if covers_scene {
            covered.clear();
            covered.extend(request.whole_scene(space).map(see));
            covered.extend_from_slice(seen);
            covered
        } else {
            seen
        };

        let family = OnePoint::around(covered, space);
        let general = match warp {
            Warp::Psm => {
                psm(space, camera, body.vertices()).and_then(|h| filling_unit_square(h, covered))
            }
            _ => None,
        };
        // The errors of a map of one texel determine the resolution.
        map.resolution = [1, 1];
        map.apex = space.apex;
        map.slab = along_axis(space);
        let set = |map: &mut ShadowMap, homography: DMat3| {
            let depth = DepthRange::of(covered, homography, space);
            [map.shadow_from_local, map.local_from_shadow] = matrices(homography, depth, space);
            map.lambda = lambda(homography, seen);
        };
        if let Some(homography) = general {
            set(map, homography);
            return unit_errors(map, body, camera);
        }
        let nu = family.strength(warp, covered, space, camera);
        if warp == Warp::Log && nu > 1e-9 {
            map.rows = Rows::Logarithmic { ratio: 1.0 + nu };
        }
        // Under a spot light `adaptive` chooses a warp from sample points. A comparison of the true
        // errors ensures that it is never worse than `uniform`. For trials this takes too long.
        let is_checked = !is_trial && space.apex.is_some() && nu > 0.0;
        if warp == Warp::Adaptive(Objective::Storage) && is_checked {
            let mut storage = |nu: f64| {
                set(map, family.homography(nu, covered));
                let error = worst_errors(map, body, camera, worst);
                error.max_s * error.max_t
            };
            if storage(0.0) <= storage(nu) {
                set(map, family.homography(0.0, covered));
            }
        } else {
            set(map, family.homography(nu, covered));
        }
        unit_errors(map, body, camera)
    }
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
    let pixel = camera.pixel_width_per_depth();
    body.vertices().iter().filter_map(|&v| Some((v, Local::at(map, v)?.footprint()))).fold(
        [0.0f64; 2],
        |[s, t], (v, footprint)| {
            let width = camera.forward().dot(v) * pixel;
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
