use crate::bounds::{Aabb, Bounds, Plane};
use crate::camera::Camera;
use crate::error::Error;
use crate::focus::Body;
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
use slices::Slicing;

mod draft;
mod finish;
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
    /// Those within one projector's light.
    lit: Body,
    /// Those that a face of the frustum serves.
    face: Body,
    /// One box of receivers, before it joins the others.
    part: Body,
}

/// Checked input for the maps of one projector.
struct Request<'a> {
    camera: &'a Camera,
    projector: &'a Projector,
    bounds: &'a Bounds<'a>,
    technique: &'a Technique,
}

impl Planner {
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
        // `lit` is not in use yet; it holds the whole view while `view` is put together from boxes.
        let Bodies { view, lit: whole, part, .. } = &mut self.bodies;
        let local = |aabb: Aabb| aabb.relative_to(camera.eye());
        view.set_frustum(camera);
        self.around.clear();
        self.around.extend(view.planes());
        if let Some(receivers) = bounds.receivers {
            self.around.extend(view.sides(local(receivers)));
            view.clip_aabb(local(receivers));
        }
        let one_box = bounds.receivers.as_slice();
        let boxes = if bounds.receiver_parts.is_empty() { one_box } else { bounds.receiver_parts };
        let cells = bounds.seen.and_then(|seen| self.cells.find(seen, camera, boxes));
        let parts = match (&cells, bounds.seen) {
            (Some(_), Some(seen)) => seen.moving,
            _ => bounds.receiver_parts,
        };
        if cells.is_some() || !parts.is_empty() {
            whole.copy_from(view);
            view.clear();
            for corners in cells.into_iter().flatten() {
                let is_hidden = |p: &Plane| corners.iter().all(|&c| p.distance(c) < 0.0);
                if !self.around.iter().any(is_hidden) {
                    part.set_hexahedron(corners);
                    self.around.iter().for_each(|&p| part.clip(p));
                    view.append(part);
                }
            }
            let seen = Aabb::around(whole.vertices().iter().copied());
            for &aabb in parts {
                // Vertices cut out of a vast box would lose as many digits as the box's size takes
                // up, so the box is first intersected with what is seen.
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

    /// Appends the maps of one projector, without their resolutions and what depends on these.
    fn draft_projector(&mut self, part: Part, request: &Request<'_>) {
        let Request { camera, projector, technique, .. } = *request;
        let Bodies { view, lit, .. } = &mut self.bodies;
        let pyramid = projector.frustum(camera.eye(), view.size());
        lit.copy_from(view);
        pyramid.into_iter().flatten().for_each(|plane| lit.clip(plane));
        let with_near = technique.partition.faces == Faces::SidesAndNear;
        let faces = partition::LitFaces::new(camera, projector, with_near);
        for &face in technique.partition.face_list() {
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

    /// Angle between the view and the light direction, at the middle of what the camera sees in the
    /// light.
    fn theta(&self, light: &Light, camera: &Camera) -> f64 {
        let Bodies { view, lit, .. } = &self.bodies;
        let seen = if matches!(light, Light::Point(_)) { view } else { lit };
        theta(light, camera, seen.middle().unwrap_or(camera.forward() * camera.near()))
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
