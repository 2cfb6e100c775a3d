use crate::aliasing::Local;
use crate::bounds::{Aabb, Bounds, Plane};
use crate::camera::Camera;
use crate::casters::caster_planes;
use crate::error::Error;
use crate::fit::{DepthRange, MARGIN_TEXELS, fit, lambda, matrices};
use crate::focus::Body;
use crate::light::{Lamp, Light};
use crate::math::range;
use crate::options::{Faces, Objective, Options, Size, Warp};
use crate::partition::{self, Along};
use crate::plan::{Face, MapError, Part, Plan, PlannedLight, Rows, ShadowMap, Slab};
use crate::resolution::{enlarged, resolutions};
use crate::slab::{all_distances, along_axis, distances, slab};
use crate::stable::{Still, bounding_sphere};
use crate::warp::{LightSpace, OnePoint, Seen, psm, theta};
use crate::worst::{self, worst_errors};
use glam::{DMat3, DMat4, DVec2, DVec3};

/// Plans shadow maps. Keep one per view: its buffers are reused, so that planning allocates nothing
/// once they have grown.
///
/// Two lights share 2048² texels over four slices each; which maps answer for a point, whether a box may
/// cast into one, and where they lie in an atlas:
///
/// ```
/// # use umbrage::*;
/// # use glam::dvec3;
/// # let camera = Camera::look_at(LookAt { eye: dvec3(0.0, 2.0, 0.0), target: dvec3(0.0, 1.0, -9.0), up: dvec3(0.0, 1.0, 0.0),
/// #     fov_y_rad: 1.0, near: 0.1, far: 200.0, image: [1280, 720] })?;
/// # let torch = SpotLight { position: dvec3(4.0, 5.0, -9.0), direction: dvec3(-0.5, -1.0, -0.3), half_angle_rad: 0.6, near: 0.1, range: 30.0 };
/// let lights = [Light::Directional { direction: dvec3(0.3, -1.0, 0.2) }, Light::Spot(torch)];
/// let bounds = Bounds::of_scene(Aabb::new(dvec3(-50.0, 0.0, -90.0), dvec3(50.0, 9.0, 10.0)));
/// let partition = Partition { splits: Splits::Fitted, overlap: 0.1, ..Partition::slices(4) };
/// let options = Options { partition, size: Size::Budget(2048 * 2048), ..Options::default() };
/// let mut planner = Planner::new();
/// let plan = planner.plan(&camera, &lights, &bounds, &options)?;
/// let (map, share) = plan.lookup(0, dvec3(1.0, 0.0, -9.0)).next().expect("a map of the sun's");
/// let tree = Aabb::new(dvec3(0.0, 0.0, -10.0), dvec3(2.0, 7.0, -8.0));
/// assert!(plan.maps[map].may_cast(tree) && share > 0.0);
/// let atlas = Atlas::packed(plan, 2, 8192)?;
/// assert_eq!(atlas.places.len(), 8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Planner {
    plan: Plan,
    drafts: Vec<Draft>,
    /// Largest errors of each map at one texel, pixels per texel; 0 if it has nothing to serve.
    units: Vec<[f64; 2]>,
    sizes: Vec<[u32; 2]>,
    bodies: Bodies,
    /// Planes around all that the camera sees.
    around: Vec<Plane>,
    /// Planes around the part of a light's view that a face is for.
    cell: Vec<Plane>,
    /// A map that is only tried.
    trial: ShadowMap,
    scratch: Scratch,
}

/// What a map has besides itself while it is planned.
#[derive(Clone, Debug, Default)]
struct Draft {
    /// What the map serves.
    body: Body,
    /// Where the map stands, if that depends on its resolution.
    still: Option<Still>,
}

/// What is seen, cut smaller step by step.
#[derive(Clone, Debug, Default)]
struct Bodies {
    /// By the camera, of the receivers.
    view: Body,
    /// In a light.
    lit: Body,
    /// In the part of a face.
    face: Body,
    /// In a slice that is only tried.
    slice: Body,
}

impl Planner {
    /// A planner with empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Plans the shadow maps of all `lights` for one view. A budget of texels is shared among them.
    ///
    /// A camera that sees none of the receivers, or none in a light, gets empty maps.
    ///
    /// # Errors
    /// Names the first field of lights, bounds or options that is out of its range. The planner can
    /// still be used.
    pub fn plan(
        &mut self,
        camera: &Camera,
        lights: &[Light],
        bounds: &Bounds<'_>,
        options: &Options,
    ) -> Result<&Plan, Error> {
        options.check()?;
        bounds.check()?;
        self.plan.origin = camera.eye();
        self.plan.lights.clear();
        self.units.clear();
        self.focus(camera, bounds);
        for (index, light) in lights.iter().enumerate() {
            let light = light.checked()?;
            let first = self.units.len();
            for (side, lamp) in light.lamps() {
                let part = Part { light: index, side, ..Part::default() };
                self.draft_lamp(part, &Request { camera, lamp: &lamp, bounds, options });
            }
            let theta_rad = self.theta(&light, camera);
            self.plan.lights.push(PlannedLight { maps: first..self.units.len(), theta_rad });
        }
        let Self { plan, drafts, units, sizes, scratch, .. } = self;
        plan.maps.truncate(units.len());
        resolutions(options, units, sizes)?;
        for ((map, draft), &size) in plan.maps.iter_mut().zip(drafts).zip(&*sizes) {
            scratch.finish(map, draft, size, camera, bounds, options)?;
        }
        Ok(plan)
    }

    /// Finds what the camera sees of the receivers.
    fn focus(&mut self, camera: &Camera, bounds: &Bounds<'_>) {
        let Bodies { view, lit: whole, slice: part, .. } = &mut self.bodies;
        let local = |aabb: Aabb| aabb.relative_to(camera.eye());
        view.set_frustum(camera);
        self.around.clear();
        self.around.extend(view.planes());
        if let Some(receivers) = bounds.receivers {
            self.around.extend(view.sides(local(receivers)));
            view.clip_aabb(local(receivers));
        }
        if !bounds.receiver_parts.is_empty() {
            whole.copy_from(view);
            view.clear();
            let seen = Aabb::around(whole.vertices().iter().copied());
            for &aabb in bounds.receiver_parts {
                // What is cut out of a vast box would have lost the digits that the box takes.
                let aabb = local(aabb).intersection(seen);
                let sides = whole.sides(aabb);
                let may_be_seen = |p: &Plane| p.may_touch(aabb);
                if !aabb.is_empty() && self.around.iter().all(may_be_seen) {
                    part.set_box(sides);
                    self.around.iter().for_each(|&p| part.clip(p));
                    view.append(part);
                }
            }
        }
    }

    /// Appends the maps of one lamp, all but their resolutions and what follows from them.
    fn draft_lamp(&mut self, part: Part, request: &Request<'_>) {
        let Request { camera, lamp, options, .. } = *request;
        let Bodies { view, lit, .. } = &mut self.bodies;
        let pyramid = lamp.frustum(camera.eye(), view.size());
        lit.copy_from(view);
        pyramid.into_iter().flatten().for_each(|plane| lit.clip(plane));
        let with_near = options.partition.faces == Faces::SidesAndNear;
        let faces = partition::Faces::new(camera, lamp, with_near);
        for &face in options.partition.face_list() {
            self.cell.clear();
            let has_part = face.is_none_or(|face| faces.cell(face, &mut self.cell));
            let Bodies { lit, face: body, .. } = &mut self.bodies;
            body.copy_from(lit);
            self.cell.iter().for_each(|&plane| body.clip(plane));
            if !has_part {
                body.clear();
            }
            self.cell.extend(pyramid.into_iter().flatten());
            let along = face.and_then(|f| faces.side(f)).map_or(Along::View, Along::Side);
            self.draft_slices(Part { face, ..part }, &along, request);
        }
    }

    /// Appends the maps of all slices of a face's part.
    fn draft_slices(&mut self, part: Part, along: &Along, request: &Request<'_>) {
        let Request { camera, options, .. } = *request;
        let Bodies { face: body, slice, .. } = &mut self.bodies;
        let (mut partition, mut warp) = (options.partition, options.warp);
        if part.face == Some(Face::Near) {
            // All its pixels are of one size.
            partition.slices = 1;
            if !matches!(warp, Warp::Unfocused | Warp::Adaptive(_)) {
                warp = Warp::Uniform;
            }
        }
        let [n, f] = if warp == Warp::Stable || body.is_empty() {
            [camera.near(), camera.far()]
        } else {
            let depths = body.vertices().iter().map(|&v| along.depth_of(v, camera));
            range(depths.map(|d| d.clamp(camera.near(), camera.far()))).into()
        };
        let ends = partition::split(&partition, [n, f], |from, to| {
            slice.copy_from(body);
            let begin = (from > n).then(|| along.plane_at(from, camera)).flatten();
            let end = (to < f).then(|| along.plane_at(to, camera)).flatten();
            begin.into_iter().chain(end.map(Plane::flipped)).for_each(|p| slice.clip(p));
            self.trial.clear(camera);
            let [s, t] = self.scratch.draft(&mut self.trial, slice, along, warp, true, request);
            s * t
        });
        for i in 0..partition.slices as usize {
            let index = self.units.len();
            if self.plan.maps.len() == index {
                self.plan.maps.push(ShadowMap::default());
            }
            if self.drafts.len() == index {
                self.drafts.push(Draft::default());
            }
            let (map, draft) = (&mut self.plan.maps[index], &mut self.drafts[index]);
            map.clear(camera);
            map.part = Part { slice: i, ..part };
            let split = [ends[i], ends[i + 1]];
            map.split = split;
            let is_last = i + 1 == partition.slices as usize;
            let overlap = if is_last { 0.0 } else { partition.overlap };
            let reach = split[1] + overlap * (split[1] - split[0]).max(0.0);
            let before = |depth| along.plane_at(depth, camera).map(Plane::flipped);
            // The first slice begins and the last one ends where what is served does.
            let end = before(reach).filter(|_| !is_last);
            let begin = along.plane_at(split[0], camera).filter(|_| i > 0);
            draft.body.copy_from(body);
            begin.into_iter().chain(end).for_each(|p| draft.body.clip(p));
            map.fade_from = before(split[1]).filter(|_| overlap > 0.0);
            map.cell.extend(end.into_iter().chain(begin));
            map.cell.extend_from_slice(&self.cell);
            map.cell.push(Plane { normal: -camera.forward(), offset: camera.far() });
            draft.still = (warp == Warp::Stable).then(|| {
                let range = [split[0], reach].map(|d| d.clamp(camera.near(), camera.far()));
                Still::around(request.lamp, camera, range)
            });
            let unit = match &draft.still {
                None => self.scratch.draft(map, &draft.body, along, warp, false, request),
                // Beyond the view nothing is ever served.
                Some(_) if split[0] >= camera.far() || reach <= camera.near() => [0.0; 2],
                Some(still) => still.unit_errors(),
            };
            self.units.push(unit);
            let around = self.around.iter().chain(&map.cell).copied();
            let space = LightSpace::fixed(request.lamp, camera);
            let outline = &mut self.scratch.outline;
            caster_planes(&mut map.caster_planes, around, &draft.body, &space, outline);
        }
    }

    /// Angle between the view and a light's way at the middle of what is seen in it.
    fn theta(&self, light: &Light, camera: &Camera) -> f64 {
        let Bodies { view, lit, .. } = &self.bodies;
        let seen = if matches!(light, Light::Point(_)) { view } else { lit };
        theta(light, camera, seen.middle().unwrap_or(camera.forward() * camera.near()))
    }
}

/// Checked input.
struct Request<'a> {
    camera: &'a Camera,
    lamp: &'a Lamp,
    bounds: &'a Bounds<'a>,
    options: &'a Options,
}

impl Request<'_> {
    /// Corners of all that `unfocused` covers, in local space.
    fn whole_scene(&self, space: &LightSpace) -> [DVec3; 8] {
        let eye = self.camera.eye();
        let scene = self.bounds.receivers.map(|r| self.bounds.casters.map_or(r, |c| r.union(c)));
        match (self.lamp.corners(eye), scene) {
            (Some(corners), _) => corners,
            (_, Some(scene)) => scene.relative_to(eye).corners(),
            (_, None) => bounding_cube(self.camera, space),
        }
    }
}

/// Casters that lie farther before the receivers than this many of their ranges of depth are flattened in any case: the receivers' own depths need the digits.
const MOST_CASTER_DEPTHS: f64 = 1000.0;

/// Casters so many times nearer to a lamp than where the receivers' depths begin are flattened in any case: before a lamp there is no end to depth.
const CLOSEST_TO_LAMP: f64 = 16.0;

/// Buffers kept from frame to frame.
#[derive(Clone, Debug, Default)]
struct Scratch {
    seen: Vec<Seen>,
    /// What `unfocused` covers, as seen from the light.
    covered: Vec<Seen>,
    outline: Vec<DVec2>,
    worst: worst::Scratch,
    casters: Body,
    /// (s, t, depth) of a body's corners.
    corners: Vec<DVec3>,
}

/// How wide a texel is, and how much that is in depth, laid along the beam.
struct Texel {
    metres: f64,
    depth: f64,
}

impl Scratch {
    /// Sets all of a map that does not depend on its resolution, and gives its largest errors in s and t
    /// at one texel, pixels per texel; 0 without anything to serve. A map that is only tried may be a
    /// little worse.
    fn draft(
        &mut self,
        map: &mut ShadowMap,
        body: &Body,
        along: &Along,
        warp: Warp,
        is_trial: bool,
        request: &Request<'_>,
    ) -> [f64; 2] {
        let Request { camera, lamp, .. } = *request;
        let Some(middle) = body.middle() else { return [0.0; 2] };
        let space = &match along {
            _ if warp == Warp::Unfocused => LightSpace::fixed(lamp, camera),
            Along::View => LightSpace::following_view(lamp, camera, middle),
            Along::Side(side) => LightSpace::following_face(lamp, camera, side, middle),
        };
        let Self { seen, covered, worst, .. } = self;
        let see = |p: DVec3| Seen::new(p, space, camera);
        seen.clear();
        seen.extend(body.vertices().iter().map(|&v| see(v)));
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
        let covered: &[Seen] = if warp == Warp::Unfocused {
            covered.clear();
            covered.extend(request.whole_scene(space).map(see));
            covered.extend_from_slice(seen);
            covered
        } else {
            seen
        };

        let family = OnePoint::around(covered, space);
        let fitted = match warp {
            Warp::Psm => psm(space, camera, body.vertices()).and_then(|h| fit(h, covered)),
            _ => None,
        };
        // Errors at one texel decide the resolution.
        map.resolution = [1, 1];
        map.apex = space.apex;
        map.slab = along_axis(space);
        let set = |map: &mut ShadowMap, homography: DMat3| {
            let depth = DepthRange::of(covered, homography, space);
            [map.shadow_from_local, map.local_from_shadow] = matrices(homography, depth, space);
            map.lambda = lambda(homography, seen);
        };
        if let Some(fitted) = fitted {
            set(map, fitted);
            return unit_errors(map, body, camera);
        }
        let nu = family.strength(warp, covered, space, camera);
        if warp == Warp::Log && nu > 1e-9 {
            map.rows = Rows::Logarithmic { ratio: 1.0 + nu };
        }
        // Under a spot light `adaptive` has chosen by samples. The promise not to be worse than
        // `uniform` is kept by looking, which takes too long for slices that are only tried.
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

    /// The largest texel at the body's corners, which are kept.
    fn texels(&mut self, map: &ShadowMap, body: &Body) -> Texel {
        self.corners.clear();
        let mut largest = Texel { metres: 0.0, depth: 0.0 };
        for local in body.vertices().iter().filter_map(|&v| Local::at(map, v)) {
            let metres = local.footprint().longest();
            largest.metres = largest.metres.max(metres);
            largest.depth = largest.depth.max(metres * local.depth_per_metre);
            self.corners.push(local.shadow);
        }
        largest
    }

    /// How far before depth 0 the first of what can cast into a map lies, in depth, ≥ 0.
    fn nearest_caster(&mut self, map: &ShadowMap, draft: &Draft, casters: Aabb) -> f64 {
        let body = &mut self.casters;
        body.set_box(draft.body.sides(casters.relative_to(map.origin)));
        // What a still map holds must not depend on the view.
        if draft.still.is_none() {
            map.caster_planes.iter().for_each(|&p| body.clip(p));
        }
        let depth = |&v: &DVec3| {
            let h = map.shadow_from_local * v.extend(1.0);
            if h.w > 0.0 { h.z / h.w } else { f64::NEG_INFINITY }
        };
        let (nearest, _) = range(body.vertices().iter().map(depth));
        if body.is_empty() {
            return 0.0;
        }
        let [begin, step] = map.beam_scale(DVec2::splat(0.5));
        // Distances from a lamp go with one over the fourth coordinate.
        let most = if step == 0.0 {
            MOST_CASTER_DEPTHS
        } else {
            ((CLOSEST_TO_LAMP - 1.0) * begin / -step).clamp(0.0, MOST_CASTER_DEPTHS)
        };
        (-nearest).clamp(0.0, most)
    }

    /// Gives a map its resolution and all that follows from it.
    fn finish(
        &mut self,
        map: &mut ShadowMap,
        draft: &Draft,
        size: [u32; 2],
        camera: &Camera,
        bounds: &Bounds<'_>,
        options: &Options,
    ) -> Result<(), Error> {
        if draft.body.is_empty() {
            map.resolution = [0, 0];
            return Ok(());
        }
        let mut set = |map: &mut ShadowMap, size: [u32; 2]| {
            map.resolution = size;
            if let Some(still) = &draft.still {
                still.place(map);
            }
            map.error = worst_errors(map, &draft.body, camera, &mut self.worst);
        };
        set(map, size);
        if let Size::MaxError(wanted) = options.size {
            // Sizes come from errors in s and t at the body's corners. The worst direction may be another.
            // Rounding alone is no reason: a stable map's size would change with the view.
            while map.error.max > wanted * (1.0 + 1e-9) {
                let larger = enlarged(options, map.resolution, map.error.max / wanted)?;
                set(map, larger);
            }
        }
        let texel = self.texels(map, &draft.body);
        let reach = f64::from(options.reach_texels) * texel.metres;
        map.caster_planes.iter_mut().for_each(|p| p.offset += reach);
        // A still map has its own margin.
        let margin = if draft.still.is_none() { MARGIN_TEXELS * texel.depth } else { 0.0 };
        let earlier = match bounds.casters.filter(|_| options.keeps_casters) {
            Some(casters) => margin.max(self.nearest_caster(map, draft, casters)),
            None => margin,
        };
        map.begin_earlier(earlier);
        // A map that stands still, or covers all of the scene, stays as it is whatever is seen of it.
        let is_fixed = draft.still.is_some() || options.warp == Warp::Unfocused;
        map.slab = match map.apex {
            Some(apex) if is_fixed => all_distances(map, apex),
            Some(apex) => distances(map, apex, &draft.body, texel.metres),
            None if is_fixed => Slab::default(),
            None => {
                let scale = 1.0 / (1.0 + earlier);
                self.corners.iter_mut().for_each(|c| c.z = (c.z + earlier) * scale);
                slab(&self.corners, texel.depth * scale)
            }
        };
        let height = f64::from(camera.image()[1]);
        map.storage_factor =
            map.error.max_s * map.error.max_t * map.texels() as f64 / (height * height);
        Ok(())
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
            pixel_gradient: DVec3::ZERO,
            slab: Slab::default(),
        }
    }
}

impl ShadowMap {
    /// An empty map that keeps its buffers.
    fn clear(&mut self, camera: &Camera) {
        let [mut cell, mut caster_planes] =
            [&mut self.cell, &mut self.caster_planes].map(std::mem::take);
        cell.clear();
        caster_planes.clear();
        let pixel_gradient = camera.forward() * camera.pixel_width_per_depth();
        let origin = camera.eye();
        *self = Self { origin, cell, caster_planes, pixel_gradient, ..Self::default() };
    }
}

/// Largest m_s and m_t of a map at the body's vertices.
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

/// The corners of a cube around the view frustum's bounding sphere, aligned with light space.
fn bounding_cube(camera: &Camera, space: &LightSpace) -> [DVec3; 8] {
    let (center, radius) = bounding_sphere(camera, [camera.near(), camera.far()]);
    let axes = [space.x, space.y, space.z].map(|row| row.truncate() * radius);
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        center + axes[0] * sign(0) + axes[1] * sign(1) + axes[2] * sign(2)
    })
}
