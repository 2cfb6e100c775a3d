use crate::bounds::{Aabb, Bounds, Plane};
use crate::camera::Camera;
use crate::error::Error;
use crate::focus::{Body, frustum_planes, thickened};
use crate::light::{Light, Projector};
use crate::partition::{self, Along};
use crate::plan::{Part, Plan, PlannedLight};
use crate::resolution::resolutions;
use crate::seen::cells::Cells;
use crate::technique::{Faces, Limits, Technique};
use crate::visibility::{Filter, LightSize};
use crate::warp::theta;
use draft::{Draft, Drafting};
use finish::{FinishRequest, Finishing};
use opening::Opening;
use slices::Slicing;

mod draft;
mod finish;
mod opening;
mod slices;

/// Plans shadow maps. Keep one planner for each view: it reuses its buffers, so that planning
/// allocates no memory once they have grown.
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
    /// Planes around the part of a light's view that a face of the frustum serves.
    cell: Vec<Plane>,
    slicing: Slicing,
    drafting: Drafting,
    finishing: Finishing,
}

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

    /// The texture sizes that the device allows.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Plans the shadow maps of all `lights` for one view. The lights share a budget of texels.
    ///
    /// Where the camera sees no receivers, or none within a light, the maps are empty.
    ///
    /// # Errors
    /// Names the first field of technique, limits, lights or bounds that is out of its range. The
    /// planner can be used again after an error.
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
        self.plan.origin = camera.eye();
        self.plan.pixel_gradient = camera.forward() * camera.pixel_width_per_depth();
        self.plan.filter = technique.filter;
        self.plan.lights.clear();
        self.units.clear();
        self.focus(camera, bounds);
        for (index, light) in lights.iter().enumerate() {
            let light = light.checked()?;
            check_light_size(technique, &light)?;
            let first = self.units.len();
            for (side, projector) in light.projectors() {
                let part = Part { light: index, side, ..Part::default() };
                self.draft_projector(
                    part,
                    &Request { camera, projector: &projector, bounds, technique },
                );
            }
            let theta_rad = self.theta(&light, camera);
            self.plan.lights.push(PlannedLight { maps: first..self.units.len(), theta_rad });
        }
        let Self { limits, plan, drafts, units, sizes, finishing, .. } = self;
        plan.maps.truncate(units.len());
        resolutions(technique, *limits, units, sizes)?;
        let request = FinishRequest { camera, bounds, technique, limits: *limits };
        for ((map, draft), &size) in plan.maps.iter_mut().zip(drafts).zip(&*sizes) {
            finishing.finish(map, draft, size, &request)?;
        }
        Ok(plan)
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
            self.around.extend(sides);
            if receivers.is_empty() {
                view.clear();
            }
            view.clip(&sides);
        }
        let seen_bounds = view.bounds();
        if let Some(tree) = bounds.receiver_parts {
            self.opening.choose(tree, camera, &self.around, seen_bounds, Self::MOST_PARTS);
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
        let Bodies { view, lit, .. } = &mut self.bodies;
        let pyramid = projector.frustum(camera.eye(), view.size());
        if let Some(planes) = &pyramid {
            lit.set_clipped(view, planes);
        }
        let with_near = technique.partition.faces == Faces::SidesAndNear;
        let faces = partition::LitFaces::new(camera, projector, with_near);
        let faces_with_maps = match technique.filter.has_maps() {
            true => technique.partition.face_list(),
            false => &[],
        };
        for &face in faces_with_maps {
            self.cell.clear();
            let has_part = face.is_none_or(|face| faces.cell(face, &mut self.cell));
            let Bodies { view, lit, face: body } = &mut self.bodies;
            let lit = if pyramid.is_some() { &*lit } else { &*view };
            if has_part {
                body.set_clipped(lit, &self.cell);
            } else {
                body.clear();
            }
            self.cell.extend(pyramid.into_iter().flatten());
            let along = face.and_then(|f| faces.side(f)).map_or(Along::View, Along::Side);
            self.draft_slices(Part { face, ..part }, &along, request);
        }
    }

    /// Angle between the view and the light direction, at the middle of what the camera sees in the
    /// light.
    fn theta(&self, light: &Light, camera: &Camera) -> f64 {
        let Bodies { view, lit, .. } = &self.bodies;
        let seen = if matches!(light, Light::Spot(_)) { lit } else { view };
        let middle = (!seen.is_empty()).then(|| seen.bounds().center());
        theta(light, camera, middle.unwrap_or(camera.forward() * camera.near()))
    }
}

/// Checks that a size of the light which the filter needs is given in the unit of this kind of
/// light.
fn check_light_size(technique: &Technique, light: &Light) -> Result<(), Error> {
    let Filter::Pcss { light: size, .. } = technique.filter else { return Ok(()) };
    let problem = match (light, size) {
        (Light::Directional { .. }, LightSize::Metres(_)) => {
            "a sun's size is an angle, as in light=0.53deg"
        }
        (Light::Spot(_) | Light::Point(_), LightSize::Degrees(_)) => {
            "a lamp's size is a length, as in light=0.2m"
        }
        _ => return Ok(()),
    };
    Err(Error::invalid("technique.filter.light", problem))
}
