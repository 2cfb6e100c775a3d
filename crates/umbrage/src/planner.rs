use crate::aliasing::Local;
use crate::bounds::{Aabb, Bounds, Plane};
use crate::camera::Camera;
use crate::error::Error;
use crate::focus::ConvexBody;
use crate::light::Light;
use crate::options::{Objective, Options, Warp};
use crate::plan::{MapError, Plan, Rows, ShadowMap};
use crate::resolution::resolution;
use crate::warp::{LightSpace, OnePoint, Seen, psm};
use crate::worst::{self, worst_errors};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

/// Plans shadow maps. Keep one per view: its buffers are reused, so that planning allocates nothing
/// once they have grown.
#[derive(Clone, Debug, Default)]
pub struct Planner {
    plan: Plan,
    body: ConvexBody,
    seen: Vec<Seen>,
    /// What `unfocused` covers: corners of the bounds, as seen from the light.
    covered: Vec<Seen>,
    outline: Vec<DVec2>,
    worst: worst::Scratch,
}

impl Planner {
    /// A planner with empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Plans the shadow maps of one light for one view.
    ///
    /// A camera that sees none of the receivers, or none in the light, gets a plan of empty maps.
    ///
    /// # Errors
    /// Names the first field of light, bounds or options that is out of its range.
    pub fn plan(
        &mut self,
        camera: &Camera,
        light: &Light,
        bounds: &Bounds,
        options: &Options,
    ) -> Result<&Plan, Error> {
        options.check()?;
        bounds.check()?;
        let light = light.checked()?;
        self.focus(camera, &light, bounds);
        let middle = Aabb::around(self.body.vertices().iter().copied()).center();
        let space = match options.warp {
            Warp::Unfocused => LightSpace::fixed(&light, camera),
            _ => LightSpace::following_view(&light, camera, middle),
        };
        let theta_rad = match options.warp {
            Warp::Unfocused if !self.body.is_empty() => {
                LightSpace::following_view(&light, camera, middle).theta_rad
            }
            _ => space.theta_rad,
        };
        self.plan.origin = camera.eye();
        self.plan.theta_rad = if theta_rad.is_finite() { theta_rad } else { 0.0 };
        self.plan.maps.resize_with(1, || ShadowMap::empty(camera));
        let mut map = self.plan.maps.swap_remove(0);
        self.plan_map(&mut map, camera, &space, &light, bounds, options);
        self.plan.maps.push(map);
        Ok(&self.plan)
    }

    /// Sets `body` to what the camera sees of the receivers, in the light.
    fn focus(&mut self, camera: &Camera, light: &Light, bounds: &Bounds) {
        self.body.set_frustum(camera);
        if let Some(receivers) = bounds.receivers {
            self.body.clip_aabb(receivers.relative_to(camera.eye()));
        }
        for plane in light.frustum(camera.eye()).into_iter().flatten() {
            self.body.clip(plane);
        }
    }

    fn plan_map(
        &mut self,
        map: &mut ShadowMap,
        camera: &Camera,
        space: &LightSpace,
        light: &Light,
        bounds: &Bounds,
        options: &Options,
    ) {
        map.clear(camera);
        if self.body.is_empty() {
            return;
        }
        let seen = &mut self.seen;
        seen.clear();
        seen.extend(self.body.vertices().iter().map(|&v| Seen::new(v, space, camera)));
        caster_planes(&mut map.caster_planes, &self.body, seen, space, &mut self.outline);
        if space.apex.is_some() {
            // Under a spot light errors need not be largest at corners. These are points enough to
            // choose a warp by; the errors reported do not depend on them.
            let vertices = self.body.vertices();
            seen.extend(self.body.edges().flat_map(|[a, b]| {
                [0.25, 0.5, 0.75]
                    .map(|k| Seen::new(vertices[a].lerp(vertices[b], k), space, camera))
            }));
        }

        // What the map has to cover is what is seen, but for `unfocused`.
        let covered: &[Seen] = if options.warp == Warp::Unfocused {
            self.covered.clear();
            let cover = |p: DVec3| Seen::new(p, space, camera);
            let scene = bounds.receivers.map(|r| bounds.casters.map_or(r, |c| r.union(c)));
            self.covered.extend(match (light, scene) {
                (Light::Spot(spot), _) => spot.corners(camera.eye()).map(cover),
                (_, Some(scene)) => scene.relative_to(camera.eye()).corners().map(cover),
                (_, None) => bounding_cube(camera, space).map(cover),
            });
            // What is seen as well: its bounds were widened a little if they are flat.
            self.covered.extend_from_slice(&self.seen);
            &self.covered
        } else {
            &self.seen
        };

        let family = OnePoint::around(covered, space);
        let unfitted = match options.warp {
            Warp::Psm => psm(space, camera, self.body.vertices()),
            _ => None,
        };
        let mut finish = |map: &mut ShadowMap, homography: DMat3| {
            [map.shadow_from_local, map.local_from_shadow] = matrices(homography, covered, space);
            map.apex = space.apex;
            map.lambda = lambda(homography, &self.seen);
            map.split = depth_range(&self.seen);
            // Errors at one texel decide the resolution.
            map.resolution = [1, 1];
            let [unit_s, unit_t] = unit_errors(map, &self.body, camera);
            map.resolution = resolution(options, unit_s, unit_t);
            map.error = worst_errors(map, &self.body, camera, &mut self.worst);
            let height = f64::from(camera.image()[1]);
            map.storage_factor =
                map.error.max_s * map.error.max_t * map.texels() as f64 / (height * height);
        };
        if let Some(unfitted) = unfitted {
            finish(map, fit(unfitted, covered));
            return;
        }
        let nu = family.strength(options.warp, covered, space, camera);
        if options.warp == Warp::Log && nu > 1e-9 {
            map.rows = Rows::Logarithmic { ratio: 1.0 + nu };
        }
        finish(map, family.homography(nu, covered));
        // Under a spot light `adaptive` has chosen by samples. The promise not to be worse than
        // `uniform` is kept by looking.
        if options.warp == Warp::Adaptive(Objective::Storage) && space.apex.is_some() && nu > 0.0 {
            let adapted = map.storage_factor;
            finish(map, family.homography(0.0, covered));
            if adapted < map.storage_factor {
                finish(map, family.homography(nu, covered));
            }
        }
    }
}

impl ShadowMap {
    fn empty(camera: &Camera) -> Self {
        Self {
            origin: camera.eye(),
            shadow_from_local: DMat4::IDENTITY,
            local_from_shadow: DMat4::IDENTITY,
            rows: Rows::Even,
            resolution: [0, 0],
            split: [camera.near(), camera.near()],
            lambda: None,
            error: MapError::default(),
            storage_factor: 0.0,
            caster_planes: Vec::new(),
            apex: None,
        }
    }

    /// An empty map that keeps its buffers.
    fn clear(&mut self, camera: &Camera) {
        let mut caster_planes = std::mem::take(&mut self.caster_planes);
        caster_planes.clear();
        *self = Self { caster_planes, ..Self::empty(camera) };
    }
}

/// Scales and moves a homography's s and t so that what is seen fills [0, 1]², and w so that its
/// least value is 1.
fn fit(homography: DMat3, seen: &[Seen]) -> DMat3 {
    let [s, t, w] = [0, 1, 2].map(|i| homography.row(i));
    let range = |row: DVec3| {
        seen.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| {
            let h = p.xz.extend(1.0);
            let v = row.dot(h) / w.dot(h);
            (lo.min(v), hi.max(v))
        })
    };
    let least_w = seen.iter().map(|p| w.dot(p.xz.extend(1.0))).fold(f64::INFINITY, f64::min);
    let fit = |row: DVec3| {
        let (lo, hi) = range(row);
        (row - w * lo) / ((hi - lo).max(1e-12 * hi.abs().max(lo.abs())) * least_w)
    };
    DMat3::from_cols(fit(s), fit(t), w / least_w).transpose()
}

/// The whole transform from local to shadow space: the homography for s, t and w, and a depth that
/// grows linearly away from the light, divided by w, with 0 and 1 at the ends of what is covered. And
/// its inverse.
fn matrices(homography: DMat3, covered: &[Seen], space: &LightSpace) -> [DMat4; 2] {
    let w = homography.row(2);
    let range = |f: &dyn Fn(&Seen) -> f64| {
        covered
            .iter()
            .map(f)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
    };
    let (y0, y1) = range(&|p| p.y);
    // y counts from the middle of its range (Wimmer et al. 2004, §3.4), which keeps the perspective from
    // tilting depth.
    let middle = y0.midpoint(y1);
    let depth = |p: &Seen| (middle - p.y) / w.dot(p.xz.extend(1.0));
    let (nearest, farthest) = range(&depth);
    // A flat body across the light has no range of depth. Give it one that single precision can
    // work with.
    let span =
        (farthest - nearest).max(1e-3 * light_plane_extent(covered) * depth_unit(covered, space));
    let nearest = nearest.midpoint(farthest) - span / 2.0;
    // Numerators over (x, y, z, w) of light space.
    let on_plane = |row: DVec3| DVec4::new(row.x, 0.0, row.y, row.z);
    let rows = [0, 1, 2].map(|i| on_plane(homography.row(i)));
    let depth_row = (DVec4::new(0.0, -1.0, 0.0, middle) - rows[2] * nearest) / span;
    let shadow_from_light = DMat4::from_cols(rows[0], rows[1], depth_row, rows[2]).transpose();
    // Inverted piece by piece, which keeps the digits that a general inverse loses where near and far
    // are orders of magnitude apart: y follows from depth and the rest.
    let inverse = homography.inverse();
    let [x, z, w] = [0, 1, 2].map(|i| inverse.row(i)).map(|r| DVec4::new(r.x, r.y, 0.0, r.z));
    let y = w * middle - DVec4::new(0.0, 0.0, span, nearest);
    let light_from_shadow = DMat4::from_cols(x, y, z, w).transpose();
    [shadow_from_light * space.light_from_local(), space.local_from_light() * light_from_shadow]
}

fn light_plane_extent(covered: &[Seen]) -> f64 {
    let (lo, hi) = covered
        .iter()
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| (lo.min(p.xz), hi.max(p.xz)));
    (hi - lo).max_element()
}

/// What a unit of light-space x is worth in light-space y: y is 1/distance for a spot light.
fn depth_unit(covered: &[Seen], space: &LightSpace) -> f64 {
    match space.apex {
        None => 1.0,
        Some(_) => covered.iter().map(|p| p.y).fold(0.0, f64::max),
    }
}

/// Distance from the line on which a homography's w vanishes to what is seen: λ. `None` if w
/// does not vary.
fn lambda(homography: DMat3, seen: &[Seen]) -> Option<f64> {
    let w = homography.row(2);
    let (lo, hi) = seen.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| {
        let v = w.dot(p.xz.extend(1.0));
        (lo.min(v), hi.max(v))
    });
    (hi > lo * (1.0 + 1e-9)).then(|| lo / w.truncate().length())
}

fn depth_range(seen: &[Seen]) -> [f64; 2] {
    seen.iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], p| [lo.min(p.depth), hi.max(p.depth)])
}

/// Largest m_s and m_t of a map at the body's vertices.
fn unit_errors(map: &ShadowMap, body: &ConvexBody, camera: &Camera) -> [f64; 2] {
    body.vertices().iter().filter_map(|&v| Some((v, Local::at(map, v)?.footprint()))).fold(
        [0.0f64; 2],
        |[s, t], (v, footprint)| {
            let depth = camera.forward().dot(v);
            [s.max(footprint.base() / depth), t.max(footprint.height() / depth)]
        },
    )
}

/// The corners of a cube around the view frustum's bounding sphere, aligned with light space.
fn bounding_cube(camera: &Camera, space: &LightSpace) -> [DVec3; 8] {
    let [near, far] = [camera.near(), camera.far()].map(|d| camera.corners_at(d));
    // On the axis of the frustum, where near and far corners are equally far, or at the far plane.
    let axis = far.iter().sum::<DVec3>() / 4.0 / camera.far();
    let (n2, f2) = (near[0].length_squared(), far[0].length_squared());
    let along = (far[0] - near[0]).dot(axis) * 2.0;
    let depth = ((f2 - n2) / along).min(camera.far());
    let center = axis * depth;
    let radius = near.iter().chain(&far).map(|c| c.distance(center)).fold(0.0, f64::max);
    let axes = [space.x, space.y, space.z].map(|row| row.truncate() * radius);
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        center + axes[0] * sign(0) + axes[1] * sign(1) + axes[2] * sign(2)
    })
}

/// Planes around all that can cast onto `body`: the body swept towards the light. Those of its
/// faces that look away from the light, and one through every edge of its outline seen from the
/// light.
fn caster_planes(
    planes: &mut Vec<Plane>,
    body: &ConvexBody,
    seen: &[Seen],
    space: &LightSpace,
    outline: &mut Vec<DVec2>,
) {
    let size = body.vertices().iter().fold(0.0, |m: f64, v| m.max(v.abs().max_element()));
    // Rounding must never lose a caster.
    let slack = 1e-9 * size;
    let sweeps_inwards = |plane: &Plane| match space.apex {
        None => plane.normal.dot(space.y.truncate()) >= 0.0,
        Some(apex) => plane.distance(apex) >= 0.0,
    };
    let widen = |p: Plane| Plane { offset: p.offset + slack, ..p };
    planes.extend(body.planes().filter(sweeps_inwards).map(widen));
    convex_outline(outline, seen.iter().map(|p| p.xz));
    for (i, &a) in outline.iter().enumerate() {
        let b = outline[(i + 1) % outline.len()];
        // The line through a and b in the light plane, as a covector over (x, z, w) of light space,
        // positive to the left of a → b: inside.
        let line = DVec3::new(a.y - b.y, b.x - a.x, a.x * b.y - b.x * a.y);
        let plane = space.x * line.x + space.z * line.y + space.w * line.z;
        let length = plane.truncate().length();
        if length > 0.0 {
            let plane = plane / length;
            let plane = widen(Plane { normal: plane.truncate(), offset: plane.w });
            // An edge as short as rounding may point anywhere: better no plane than a wrong one.
            if body.vertices().iter().all(|&v| plane.distance(v) >= 0.0) {
                planes.push(plane);
            }
        }
    }
}

/// The convex hull of points in the plane, counter-clockwise (Andrew's monotone chain).
fn convex_outline(hull: &mut Vec<DVec2>, points: impl Iterator<Item = DVec2>) {
    hull.clear();
    hull.extend(points);
    hull.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    hull.dedup();
    if hull.len() < 3 {
        return;
    }
    // The chain is built behind the sorted points, which then go.
    let n = hull.len();
    let mut chain = |indices: &mut dyn Iterator<Item = usize>| {
        let start = hull.len();
        for i in indices {
            let p = hull[i];
            while hull.len() >= start + 2 {
                let [a, b] = [hull[hull.len() - 2], hull[hull.len() - 1]];
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    chain(&mut (0..n));
    chain(&mut (0..n).rev());
    hull.drain(..n);
}
