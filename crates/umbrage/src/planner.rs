use crate::aliasing::Local;
use crate::bounds::{Aabb, Bounds};
use crate::camera::Camera;
use crate::casters::caster_planes;
use crate::error::Error;
use crate::fit::{fit, lambda, matrices};
use crate::focus::ConvexBody;
use crate::light::{Lamp, Light};
use crate::math::range;
use crate::options::{Objective, Options, Warp};
use crate::plan::{MapError, Plan, Rows, ShadowMap};
use crate::resolution::resolution;
use crate::warp::{LightSpace, OnePoint, Seen, psm};
use crate::worst::{self, worst_errors};
use glam::{DMat3, DMat4, DVec2, DVec3};

/// Plans shadow maps. Keep one per view: its buffers are reused, so that planning allocates nothing
/// once they have grown.
#[derive(Clone, Debug, Default)]
pub struct Planner {
    plan: Plan,
    body: ConvexBody,
    scratch: Scratch,
}

impl Planner {
    /// A planner with empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Plans the shadow maps of all `lights` for one view. They share the texels by their error.
    ///
    /// A camera that sees none of the receivers, or none in a light, gets empty maps.
    ///
    /// # Errors
    /// Names the first field of light, bounds or options that is out of its range.
    pub fn plan(
        &mut self,
        camera: &Camera,
        lights: &[Light],
        bounds: &Bounds,
        options: &Options,
    ) -> Result<&Plan, Error> {
        options.check()?;
        bounds.check()?;
        let light = lights[0].checked()?;
        let (_, lamp) = light.lamps().next().unwrap();
        let request = Request { camera, light: &lamp, bounds, options };
        let Self { plan, body, scratch } = self;
        request.focus(body);
        plan.origin = camera.eye();
        plan.maps.resize_with(1, || ShadowMap::empty(camera));
        let map = &mut plan.maps[0];
        map.clear(camera);
        let middle = if body.is_empty() {
            camera.forward() * camera.near()
        } else {
            Aabb::around(body.vertices().iter().copied()).center()
        };
        let space = LightSpace::following_view(request.light, camera, middle);
        plan.lights.clear();
        plan.lights.push(crate::plan::PlannedLight { maps: 0..1, theta_rad: space.theta_rad });
        if !body.is_empty() {
            scratch.plan_map(map, body, &space, &request);
        }
        Ok(&self.plan)
    }
}

/// Checked input.
struct Request<'a> {
    camera: &'a Camera,
    light: &'a Lamp,
    bounds: &'a Bounds,
    options: &'a Options,
}

impl Request<'_> {
    /// Sets `body` to what the camera sees of the receivers, in the light.
    fn focus(&self, body: &mut ConvexBody) {
        body.set_frustum(self.camera);
        if let Some(receivers) = self.bounds.receivers {
            body.clip_aabb(receivers.relative_to(self.camera.eye()));
        }
        for plane in self.light.frustum(self.camera.eye()).into_iter().flatten() {
            body.clip(plane);
        }
    }

    /// Corners of all that `unfocused` covers, in local space.
    fn whole_scene(&self, space: &LightSpace) -> [DVec3; 8] {
        let eye = self.camera.eye();
        let scene = self.bounds.receivers.map(|r| self.bounds.casters.map_or(r, |c| r.union(c)));
        match (self.light.corners(eye), scene) {
            (Some(corners), _) => corners,
            (_, Some(scene)) => scene.relative_to(eye).corners(),
            (_, None) => bounding_cube(self.camera, space),
        }
    }
}

/// Buffers kept from frame to frame.
#[derive(Clone, Debug, Default)]
struct Scratch {
    seen: Vec<Seen>,
    /// What `unfocused` covers, as seen from the light.
    covered: Vec<Seen>,
    outline: Vec<DVec2>,
    worst: worst::Scratch,
}

impl Scratch {
    fn plan_map(
        &mut self,
        map: &mut ShadowMap,
        body: &ConvexBody,
        following_view: &LightSpace,
        request: &Request<'_>,
    ) {
        let Request { camera, light, options, .. } = *request;
        let is_unfocused = options.warp == Warp::Unfocused;
        let space = &if is_unfocused { LightSpace::fixed(light, camera) } else { *following_view };
        let Self { seen, covered, outline, worst } = self;
        let see = |p: DVec3| Seen::new(p, space, camera);
        seen.clear();
        seen.extend(body.vertices().iter().map(|&v| see(v)));
        caster_planes(&mut map.caster_planes, body, seen, space, outline);
        if space.apex.is_some() {
            // Under a spot light errors need not be largest at corners. These are points enough to
            // choose a warp by; the errors reported do not depend on them.
            let vertices = body.vertices();
            seen.extend(body.edges().flat_map(|[a, b]| {
                [0.25, 0.5, 0.75].map(|k| see(vertices[a].lerp(vertices[b], k)))
            }));
        }
        let seen = &*seen;
        // What the map has to cover is what is seen, but for `unfocused`. What is seen is covered
        // there too: its bounds were widened a little if they are flat.
        let covered: &[Seen] = if is_unfocused {
            covered.clear();
            covered.extend(request.whole_scene(space).map(see));
            covered.extend_from_slice(seen);
            covered
        } else {
            seen
        };

        let family = OnePoint::around(covered, space);
        let unfitted = match options.warp {
            Warp::Psm => psm(space, camera, body.vertices()),
            _ => None,
        };
        let mut finish = |map: &mut ShadowMap, homography: DMat3| {
            [map.shadow_from_local, map.local_from_shadow] = matrices(homography, covered, space);
            map.apex = space.apex;
            map.lambda = lambda(homography, seen);
            map.split = range(seen.iter().map(|p| p.depth)).into();
            let [near, far] = map.split;
            map.cell = vec![
                crate::Plane::through(camera.forward() * far, -camera.forward()),
                crate::Plane::through(camera.forward() * near, camera.forward()),
            ];
            // Errors at one texel decide the resolution.
            map.resolution = [1, 1];
            let [unit_s, unit_t] = unit_errors(map, body, camera);
            map.resolution = resolution(options, unit_s, unit_t);
            map.error = worst_errors(map, body, camera, worst);
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
        // Under a spot light `adaptive` has chosen by samples. The promise not to be worse than
        // `uniform` is kept by looking.
        let may_be_worse =
            options.warp == Warp::Adaptive(Objective::Storage) && space.apex.is_some() && nu > 0.0;
        let uniform = may_be_worse.then(|| {
            finish(map, family.homography(0.0, covered));
            map.storage_factor
        });
        finish(map, family.homography(nu, covered));
        if uniform.is_some_and(|uniform| map.storage_factor >= uniform) {
            finish(map, family.homography(0.0, covered));
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
            part: crate::plan::Part::default(),
            split: [camera.near(), camera.near()],
            cell: Vec::new(),
            fade_from: None,
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
