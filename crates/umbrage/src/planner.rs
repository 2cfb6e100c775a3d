use crate::bounds::{Aabb, Bounds, Plane};
use crate::box_tree::BoxTree;
use crate::camera::Camera;
use crate::error::{Error, check};
use crate::focus::{Body, CellView, frustum_planes, thickened};
use crate::light::{Light, Projector};
use crate::paged::{AgingLights, Paging};
use crate::partition::{self, Along};
use crate::plan::{Fade, Part, Plan, PlannedLight, ShadowMap};
use crate::resolution::resolutions;
use crate::seen::cells::Cells;
use crate::technique::{Faces, Limits, Technique};
use crate::visibility::Filter;
use crate::warp::theta;
use draft::{Draft, Drafting};
use finish::Finishing;
use glam::DVec3;
use opening::Opening;
use slices::Slicing;

mod draft;
mod finish;
mod opening;
mod slices;

/// Plans shadow maps. Keep one planner for each view: it reuses its buffers, so that planning
/// allocates no memory once they have grown. Where nothing but some lights has changed since its
/// last plan, it keeps the maps of the others. A plan depends on its input alone all the same.
///
/// In this example two lights share 2048² texels over four slices each. The plan tells which map
/// serves a point and whether a box may cast into that map, and an atlas tells where the maps lie:
///
/// ```
/// # use umbrage::*;
/// # use glam::dvec3;
/// # let camera = Camera::look_at(LookAt {
/// #     eye: dvec3(0.0, 2.0, 0.0),
/// #     target: dvec3(0.0, 1.0, -9.0),
/// #     up: dvec3(0.0, 1.0, 0.0),
/// #     fov_y_rad: 1.0,
/// #     near: 0.1,
/// #     far: 200.0,
/// #     image: [1280, 720],
/// # })?;
/// # let torch = SpotLight {
/// #     position: dvec3(4.0, 5.0, -9.0),
/// #     direction: dvec3(-0.5, -1.0, -0.3),
/// #     half_angle_rad: 0.6,
/// #     near: 0.1,
/// #     range: 30.0,
/// # };
/// let lights = [Light::Directional { direction: dvec3(0.3, -1.0, 0.2) }, Light::Spot(torch)];
/// let bounds = Bounds::of_scene(Aabb::new(dvec3(-50.0, 0.0, -90.0), dvec3(50.0, 9.0, 10.0)));
/// let partition = Partition { splits: Splits::Fitted, overlap: 0.1, ..Partition::slices(4) };
/// let size = Size::Budget(2048 * 2048);
/// let technique = Technique { partition, size, ..Technique::default() };
/// let mut planner = Planner::new();
/// let plan = planner.plan(&camera, &lights, &bounds, &technique)?;
/// let (map, share) = plan.lookup(0, dvec3(1.0, 0.0, -9.0)).next().expect("a map of the sun's");
/// let tree = Aabb::new(dvec3(0.0, 0.0, -10.0), dvec3(2.0, 7.0, -8.0));
/// assert!(plan.maps[map].may_cast(tree) && share > 0.0);
/// let atlas = Atlas::packed(plan, 8192)?;
/// assert_eq!(atlas.places.len(), 8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Planner {
    limits: Limits,
    /// The share of the view's far distance over which shadows fade out; 0 for no fade.
    fade: f64,
    /// `None` for [`MOST_PARTS`](Self::MOST_PARTS).
    most_parts: Option<usize>,
    plan: Plan,
    drafts: Vec<Draft>,
    /// Each map's largest errors in s and t if it had one texel, pixels per texel; 0 for maps
    /// without receivers.
    units: Vec<[f64; 2]>,
    sizes: Vec<[u32; 2]>,
    bodies: Bodies,
    opening: Opening,
    cells: Cells,
    /// Planes around everything that the camera sees.
    around: Vec<Plane>,
    /// Planes around a pyramid of light; none under parallel light.
    pyramid: Vec<Plane>,
    /// Planes around the part of a light's view that a face of the frustum serves.
    cell: Vec<Plane>,
    slicing: Slicing,
    drafting: Drafting,
    finishing: Finishing,
    last: Last,
}

/// The size of a box of receivers, as a share of that of the view frustum, below which the box is
/// cut by the frustum and not the frustum by the box.
const SMALL: f64 = 0.01;

/// Bodies of receivers, each cut out of the one before.
#[derive(Clone, Debug, Default)]
struct Bodies {
    /// The receivers that the camera sees.
    view: Body,
    /// Those within one pyramid of light; not used under parallel light.
    lit: Body,
    /// Those that a face of the frustum serves.
    face: Body,
}

/// What the last plan was made for, so that the next one keeps the maps of lights that are as they
/// were.
#[derive(Clone, Debug, Default)]
struct Last {
    /// `None` if there is nothing to keep.
    view: Option<View>,
    lights: Vec<Light>,
    units: Vec<[f64; 2]>,
    sizes: Vec<[u32; 2]>,
}

/// The input of a plan but for the lights.
#[derive(Clone, Debug, PartialEq)]
struct View {
    camera: Camera,
    receivers: Option<Aabb>,
    receiver_parts: Option<u64>,
    casters: Option<Aabb>,
    technique: Technique,
}

impl View {
    /// `None` if the view is fitted to what was seen, which is different in each frame.
    fn of(camera: &Camera, bounds: &Bounds<'_>, technique: &Technique) -> Option<Self> {
        let Bounds { receivers, receiver_parts, seen, casters } = *bounds;
        let receiver_parts = receiver_parts.map(BoxTree::fingerprint);
        let (camera, technique) = (*camera, *technique);
        seen.is_none().then_some(Self { camera, receivers, receiver_parts, casters, technique })
    }
}

/// Checked input for the maps of all lights.
#[derive(Clone, Copy)]
struct Frame<'a> {
    camera: &'a Camera,
    bounds: &'a Bounds<'a>,
    technique: &'a Technique,
    limits: Limits,
}

/// Sets the value of an index, which is at most the number of values.
fn set<T>(values: &mut Vec<T>, index: usize, value: T) {
    match values.get_mut(index) {
        Some(old) => *old = value,
        None => values.push(value),
    }
}

/// Checked input for the maps of one projector.
struct Request<'a> {
    camera: &'a Camera,
    projector: &'a Projector,
    bounds: &'a Bounds<'a>,
    technique: &'a Technique,
}

impl Planner {
    /// The largest number of parts that the receivers of a view are divided into. Boxes of a
    /// [`BoxTree`](crate::BoxTree) beyond this number are served in groups, each by the box around
    /// it.
    pub const MOST_PARTS: usize = 32;

    /// A planner with empty buffers and default [`Limits`], which every WebGPU device supports.
    pub fn new() -> Self {
        Self::default()
    }

    /// A planner with empty buffers for a device with these limits.
    pub fn with_limits(limits: Limits) -> Self {
        Self { limits, ..Self::default() }
    }

    /// A share of the far distance for [`set_fade`](Self::set_fade) that hides the end of shadows
    /// and costs few of them.
    pub const FADE: f64 = 0.1;

    /// Makes shadows fade out before the far plane of the view, over the last `share` of the far
    /// distance. Use it where the camera that is planned for ends nearer than the one that draws
    /// the picture, so that shadows end at a distance at which surfaces are still seen. 0, the
    /// default, stands for no fade. Lookups take the fade from the plan ([`Plan::fade`]).
    ///
    /// # Errors
    /// If `share` is not in 0 ..= 1.
    pub fn set_fade(&mut self, share: f64) -> Result<(), Error> {
        check((0.0..=1.0).contains(&share), "fade", || format!("must be 0 to 1, is {share}"))?;
        self.fade = share;
        Ok(())
    }

    /// Divides receivers into at most `parts` parts, in place of [`MOST_PARTS`](Self::MOST_PARTS).
    /// Fewer parts are planned faster, and leave more empty space in the maps.
    ///
    /// # Errors
    /// If `parts` is not in 1 ..= [`MOST_PARTS`](Self::MOST_PARTS).
    pub fn set_most_parts(&mut self, parts: usize) -> Result<(), Error> {
        check((1..=Self::MOST_PARTS).contains(&parts), "most_parts", || {
            format!("must be 1 to {}, is {parts}", Self::MOST_PARTS)
        })?;
        self.most_parts = Some(parts);
        self.forget();
        Ok(())
    }

    /// Forgets the last plan, so that the next one keeps nothing of it. The plan is the same; this
    /// is for measuring what a plan costs when everything has changed.
    pub fn forget(&mut self) {
        self.last.view = None;
    }

    /// The edges of body B of the last plan (Wimmer et al. 2004, §3.3): what its camera sees of the
    /// receivers, as convex cells, whichever light shines there. Pairs of points in world space,
    /// metres. For pictures that show what maps were fitted to.
    pub fn seen_edges(&self) -> impl Iterator<Item = [DVec3; 2]> {
        let view = &self.bodies.view;
        let to_world = |vertex: usize| view.vertices()[vertex] + self.plan.origin;
        view.cells().flat_map(CellView::edges).map(move |ends| ends.map(to_world))
    }

    /// The texture sizes that the device allows.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Plans the shadow maps of all `lights` for one view. The lights share a budget of texels.
    ///
    /// Where the camera sees no receivers, or none within a light, the maps are empty.
    ///
    /// # Errors
    /// Names the first field of technique, limits, lights or bounds that is out of its range.
    /// [`Error::NotFinite`] if a number of the plan would not be finite, although all fields are in
    /// their ranges. The planner can be used again after an error.
    pub fn plan(
        &mut self,
        camera: &Camera,
        lights: &[Light],
        bounds: &Bounds<'_>,
        technique: &Technique,
    ) -> Result<&Plan, Error> {
        technique.check()?;
        self.limits.check(technique)?;
        bounds.check()?;
        if let Some(error) = technique.paged_error() {
            return self.plan_pages(camera, lights, technique, error);
        }
        self.plan.paging = None;
        // If this plan fails, the next one keeps nothing.
        let last_view = self.last.view.take();
        let view = View::of(camera, bounds, technique);
        let keeps = view.is_some() && last_view == view;
        if !keeps {
            self.set_view(camera, technique);
            self.last.lights.clear();
            self.focus(camera, bounds);
        }
        self.set_fade_of(camera);
        let frame = Frame { camera, bounds, technique, limits: self.limits };
        std::mem::swap(&mut self.units, &mut self.last.units);
        std::mem::swap(&mut self.sizes, &mut self.last.sizes);
        self.units.clear();
        for (index, light) in lights.iter().enumerate() {
            let light = light.checked()?;
            check_light_size(technique, &light)?;
            self.plan_light(index, light, &frame);
        }
        self.last.lights.truncate(lights.len());
        let Self { plan, drafts, units, sizes, finishing, last, .. } = self;
        plan.lights.truncate(lights.len());
        plan.maps.resize_with(units.len(), ShadowMap::default);
        resolutions(technique, frame.limits, units, sizes)?;
        for (i, (map, draft)) in plan.maps.iter_mut().zip(drafts).enumerate() {
            if !(draft.is_kept && last.sizes[i] == sizes[i]) {
                map.copy_from(&draft.map);
                finishing.finish(map, draft, sizes[i], &frame)?;
                map.check_finite(i)?;
            }
            draft.is_kept = true;
        }
        last.view = view;
        Ok(plan)
    }

    /// Plans for lights some of which may be looked up where they were a while ago. As
    /// [`plan`](Self::plan) otherwise. Techniques without pages have all lights where they are.
    ///
    /// # Errors
    /// As for [`plan`](Self::plan).
    pub fn plan_aging(
        &mut self,
        camera: &Camera,
        lights: &AgingLights,
        bounds: &Bounds<'_>,
        technique: &Technique,
    ) -> Result<&Plan, Error> {
        let has_pages = technique.paged_error().is_some();
        let planned = if has_pages { lights.planned() } else { lights.now() };
        self.plan(camera, planned, bounds, technique)?;
        if let Some(paging) = &mut self.plan.paging {
            paging.coming = lights.coming();
        }
        Ok(&self.plan)
    }

    /// Plans the windows of paged maps.
    fn plan_pages(
        &mut self,
        camera: &Camera,
        lights: &[Light],
        technique: &Technique,
        error: f64,
    ) -> Result<&Plan, Error> {
        self.forget();
        self.bodies.view.clear();
        self.last.lights.clear();
        for light in lights {
            let light = light.checked()?;
            check_light_size(technique, &light)?;
            self.last.lights.push(light);
        }
        self.set_view(camera, technique);
        self.set_fade_of(camera);
        Paging::plan(&mut self.plan, camera, &self.last.lights, technique, error)?;
        Ok(&self.plan)
    }

    /// Sets what a plan has of its view.
    fn set_view(&mut self, camera: &Camera, technique: &Technique) {
        self.plan.origin = camera.eye();
        self.plan.pixel_gradient = camera.pixel_gradient();
        self.plan.viewer = camera.viewer();
        self.plan.filter = technique.filter;
    }

    fn set_fade_of(&mut self, camera: &Camera) {
        self.plan.fade = (self.fade > 0.0).then(|| Fade {
            end: Plane { normal: -camera.forward(), offset: camera.far() },
            // The near plane of an orthographic view may lie behind the eye.
            length: self.fade * (camera.far() - camera.near().min(0.0)),
        });
    }

    /// Drafts the maps of one light, or keeps those of the last plan if nothing has changed.
    fn plan_light(&mut self, index: usize, light: Light, frame: &Frame<'_>) {
        let Frame { camera, bounds, technique, .. } = *frame;
        let first = self.units.len();
        let same = self.last.lights.get(index).is_some_and(|last| *last == light);
        if let (true, Some(planned)) = (same, self.plan.lights.get(index)) {
            if planned.maps.start == first {
                self.units.extend_from_slice(&self.last.units[planned.maps.clone()]);
                return;
            }
        }
        for &side in light.sides() {
            let part = Part { light: index, side, ..Part::default() };
            let projector = &light.projector(side);
            self.draft_projector(part, &Request { camera, projector, bounds, technique });
        }
        let theta_rad = self.theta(&light, camera);
        let planned = PlannedLight { maps: first..self.units.len(), theta_rad };
        set(&mut self.plan.lights, index, planned);
        set(&mut self.last.lights, index, light);
    }

    /// Finds the body of the receivers that the camera sees.
    fn focus(&mut self, camera: &Camera, bounds: &Bounds<'_>) {
        // `lit` is not in use yet; it holds one box at a time.
        let Bodies { view, lit: part, .. } = &mut self.bodies;
        let local = |aabb: Aabb| aabb.relative_to(camera.eye());
        view.set_frustum(camera);
        self.around.clear();
        self.around.extend(frustum_planes(camera));
        if let Some(receivers) = bounds.receivers {
            let sides = view.sides(local(receivers));
            // Vertices cut out of a body lose as many digits as its size takes up, so the smaller
            // of frustum and box is cut.
            let aabb = thickened(local(receivers), view.size()).intersection(view.bounds());
            let reach = aabb.min.abs().max(aabb.max.abs()).max_element();
            if aabb.is_empty() {
                view.clear();
            } else if reach < SMALL * view.size() {
                view.clear();
                view.push_box(aabb);
                view.clip(&self.around);
            } else {
                view.clip(&sides);
            }
            self.around.extend(sides);
        }
        let seen_bounds = view.bounds();
        if let Some(tree) = bounds.receiver_parts {
            let most = self.most_parts.unwrap_or(Self::MOST_PARTS);
            self.opening.choose(tree, camera, &self.around, seen_bounds, most);
        }
        let one_box = bounds.receivers.as_slice();
        let boxes = if bounds.receiver_parts.is_some() { self.opening.boxes() } else { one_box };
        let cells = bounds.seen.and_then(|seen| self.cells.find(seen, camera, boxes));
        let boxes = match (&cells, bounds.seen) {
            (Some(_), Some(seen)) => seen.moving,
            _ if bounds.receiver_parts.is_some() => boxes,
            _ => return,
        };
        let size = view.size();
        view.clear();
        let mut add = |part: &mut Body, is_inside: &dyn Fn(&Plane) -> bool| {
            self.cell.clear();
            self.cell.extend(self.around.iter().filter(|p| !is_inside(p)));
            view.append_clipped(part, &self.cell);
        };
        for corners in cells.into_iter().flatten() {
            let is_hidden = |p: &Plane| corners.iter().all(|&c| p.distance(c) < 0.0);
            if !self.around.iter().any(is_hidden) {
                part.clear();
                part.push_hexahedron(corners);
                add(part, &|p| corners.iter().all(|&c| p.distance(c) >= 0.0));
            }
        }
        for &aabb in boxes {
            // Vertices cut out of a vast box would lose as many digits as the box's size takes up,
            // so the box is first intersected with what is seen.
            let aabb = thickened(local(aabb).intersection(seen_bounds), size);
            if !aabb.is_empty() && self.around.iter().all(|p| p.may_touch(aabb)) {
                part.clear();
                part.push_box(aabb);
                add(part, &|p| p.contains(aabb));
            }
        }
    }

    /// Appends the maps of one projector, without their resolutions and what depends on these.
    fn draft_projector(&mut self, part: Part, request: &Request<'_>) {
        let Request { camera, projector, technique, .. } = *request;
        let Self { bodies: Bodies { view, lit, .. }, pyramid, .. } = self;
        projector.frustum(pyramid, camera.eye(), view.size());
        let is_pyramid = !pyramid.is_empty();
        if is_pyramid {
            lit.set_clipped(view, pyramid);
        }
        let with_near = technique.partition.faces == Faces::SidesAndNear;
        // All pixels of an orthographic view have the same width, so its faces need no maps of
        // their own. The first one serves the whole view.
        let faces = (!camera.is_orthographic())
            .then(|| partition::LitFaces::new(camera, projector, with_near));
        let faces_with_maps = match technique.filter.has_maps() {
            true => technique.partition.face_list(),
            false => &[],
        };
        for (index, &face) in faces_with_maps.iter().enumerate() {
            self.cell.clear();
            let has_part = match (&faces, face) {
                (Some(faces), Some(face)) => faces.cell(face, &mut self.cell),
                (Some(_), None) => true,
                (None, _) => index == 0,
            };
            let Bodies { view, lit, face: body } = &mut self.bodies;
            let lit = if is_pyramid { &*lit } else { &*view };
            if has_part {
                body.set_clipped(lit, &self.cell);
            } else {
                body.clear();
            }
            self.cell.extend_from_slice(&self.pyramid);
            let side = faces.zip(face).and_then(|(faces, face)| faces.side(face));
            let along = side.map_or(Along::View, Along::Side);
            self.draft_slices(Part { face, ..part }, &along, request);
        }
    }

    /// Angle between the view and the light direction, at the middle of what the camera sees in the
    /// light.
    fn theta(&self, light: &Light, camera: &Camera) -> f64 {
        let Bodies { view, lit, .. } = &self.bodies;
        let is_one_pyramid = !self.pyramid.is_empty() && light.sides().len() == 1;
        let seen = if is_one_pyramid { lit } else { view };
        let middle = (!seen.is_empty()).then(|| seen.bounds().center());
        theta(light, camera, middle.unwrap_or(camera.forward() * camera.near()))
    }
}

/// Checks that a size of the light which the filter needs is given in the unit of this kind of
/// light.
fn check_light_size(technique: &Technique, light: &Light) -> Result<(), Error> {
    let Filter::Pcss { light: size, .. } = technique.filter else { return Ok(()) };
    size.check_for(light).map_err(|problem| Error::invalid("technique.filter.light", problem))
}
