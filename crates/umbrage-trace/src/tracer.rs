mod beam;

use crate::boxes::{Boxes, Node};
use crate::check::check_mesh;
use crate::placement::{Placement, stretch};
use crate::plane::{TrianglePlane, normal_of};
use crate::triangle::{ShearedRay, TriangleHit};
use crate::{Error, Ray};
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use umbrage::Aabb;
use umbrage_scene::{Alpha, Material, Mesh, Role, Scene, Texture};

pub(crate) use beam::{Beam, End};

/// One triangle of one instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PrimitiveRef {
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index into [`Mesh::triangles`].
    pub triangle: u32,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Parameter of the hit along the ray: its distance in lengths of the ray's direction.
    pub t: f64,
    /// The triangle that was hit.
    pub primitive: PrimitiveRef,
    /// Weights of the triangle's three corners, each in [0, 1]; they sum to 1.
    pub barycentrics: [f64; 3],
}

/// A point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The triangle that the point lies on.
    pub primitive: PrimitiveRef,
    /// World space, metres. The position is computed from the triangle's corners, not along the
    /// ray.
    pub position: DVec3,
    /// Upper bound of the error of `position`, metres: every step from the triangle's corners to it
    /// rounds.
    pub position_error: f64,
    /// The triangle's normal, unit length, world space, turned towards the side that is seen.
    pub geometric_normal: DVec3,
    /// The normals of the corners, interpolated; unit length, world space, turned to the side of
    /// `geometric_normal`.
    pub shading_normal: DVec3,
    /// Texture coordinates; zero if the mesh has none.
    pub uv: Vec2,
    /// Base colour: linear red, green, blue.
    pub base_color: Vec3,
}

/// A box that [`Tracer::boxes`] may replace by the boxes of its contents.
#[derive(Clone, Copy)]
struct Opened {
    aabb: Aabb,
    what: What,
}

/// The contents of a box.
#[derive(Clone, Copy)]
enum What {
    Instances(Node),
    /// A node of an instance's triangles.
    Triangles(u32, Node),
    Triangle,
}

impl Opened {
    /// Half the surface area of the box, square metres. Area and not volume measures how large a
    /// box is, because flat boxes have no volume.
    fn surface(&self) -> f64 {
        let size = self.aabb.size();
        size.dot(DVec3::new(size.y, size.z, size.x))
    }
}

impl Ord for Opened {
    fn cmp(&self, other: &Self) -> Ordering {
        self.surface().total_cmp(&other.surface())
    }
}

impl PartialOrd for Opened {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Opened {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Opened {}

/// A scene prepared for ray tracing.
///
/// There are two levels of hierarchy: one over the triangles of each mesh, in mesh space, and one
/// over the instances. A mesh that is drawn a hundred times thus takes the memory of one. Triangles
/// are tested in double precision, in mesh space, by a watertight test: no ray passes between
/// neighbours (`ShearedRay`). The boxes are in single precision and are padded for all rounding
/// (`Boxes`). No hit is ever lost, as long as rays start within some 10⁷ scene sizes of the scene.
///
/// All triangles are visible and cast shadows from both sides, unless the scene gives their
/// instance another [role](Scene::roles). Where an alpha mask removes a surface, rays pass.
/// Triangles without area are ignored.
pub struct Tracer<'a> {
    scene: &'a Scene,
    /// One for each mesh.
    meshes: Vec<MeshBoxes<'a>>,
    /// One for each instance.
    placements: Vec<Placement>,
    instances: Boxes,
    /// The instances that maps are fitted to; `None` if these are all.
    receivers: Option<Boxes>,
    bounds: Aabb,
    opaque: bool,
}

struct MeshBoxes<'a> {
    boxes: Boxes,
    mask: Option<Mask<'a>>,
}

/// An alpha mask: where `factor` times the alpha of the texture and of the vertices is below
/// `cutoff`, there is no surface.
struct Mask<'a> {
    cutoff: f32,
    factor: f32,
    texture: Option<&'a Texture>,
}

/// The ends of a ray that surfaces do not hide: see [`Tracer::occluded_from`] and
/// [`Tracer::hidden_from_lamp`].
#[derive(Clone, Copy, Default)]
struct Ends<'a> {
    departure: Option<&'a Surface>,
    lamp: Option<DVec3>,
}

/// Which instances a ray may meet.
pub(crate) type Wanted = fn(Role) -> bool;
pub(crate) const IS_SEEN: Wanted = |role| role.is_seen;
pub(crate) const CASTS: Wanted = |role| role.casts;

impl Surface {
    fn ray(&self, direction: DVec3) -> Ray {
        Ray { origin: self.position, direction }
    }
}

impl<'a> Tracer<'a> {
    /// Builds the hierarchies, those of different meshes on different threads. This takes a quarter
    /// of a second per million stored triangles on one thread.
    ///
    /// # Errors
    /// [`Error::Scene`] if the scene has an index out of range, coordinates that are not finite or
    /// beyond 10¹² metres, or a transform that cannot be inverted.
    pub fn new(scene: &'a Scene) -> Result<Self, Error> {
        for (i, mesh) in scene.meshes.iter().enumerate() {
            check_mesh(mesh, i, scene)?;
        }
        let placements = scene
            .instances
            .iter()
            .enumerate()
            .map(|(i, _)| Placement::new(scene, i))
            .collect::<Result<Vec<_>, _>>()?;

        let mesh_bounds: Vec<Aabb> = scene.meshes.par_iter().map(Mesh::bounds).collect();
        let placed = placements.iter().map(|p| p.bounds(mesh_bounds[p.mesh]));
        let placed: Vec<Aabb> = placed.collect();
        let bounds = placed.iter().fold(Aabb::EMPTY, |all, &b| all.union(b));
        let is_within =
            |b: &Aabb| b.is_empty() || b.min.abs().max(b.max.abs()).cmple(DVec3::splat(1e12)).all();
        if let Some(i) = placed.iter().position(|b| !is_within(b)) {
            let problem = "must lie within 1e12 metres of the origin";
            return Err(Error::scene(format!("instances[{i}]"), problem));
        }

        // Taking a ray to mesh space has an error of a few roundings of the distance from which the
        // ray comes. The slack bounds this error by 32 roundings of the scene's size.
        let size = if bounds.is_empty() { 0.0 } else { bounds.size().length() };
        let mut slack = vec![0.0f64; scene.meshes.len()];
        for p in &placements {
            let shrink = stretch(p.mesh_from_world);
            slack[p.mesh] = slack[p.mesh].max(shrink * size * 2f64.powi(-48));
        }
        let meshes = scene.meshes.par_iter().zip(slack);
        let meshes = meshes.map(|(mesh, slack)| MeshBoxes::build(mesh, slack, scene)).collect();
        let farthest =
            if bounds.is_empty() { DVec3::ZERO } else { bounds.min.abs().max(bounds.max.abs()) };
        let mut boxes: Vec<(u32, Aabb)> =
            (0..).zip(placed).filter(|(_, b)| !b.is_empty()).collect();
        let slack = farthest.length() * 2f64.powi(-48);
        let instances = Boxes::build(&boxes, slack);
        let receivers = (!scene.roles.are_default()).then(|| {
            boxes.retain(|&(i, _)| placements[i as usize].role.is_receiver());
            Boxes::build(&boxes, slack)
        });
        let bounds = boxes.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(*b));
        Ok(Self { scene, meshes, placements, instances, receivers, bounds, opaque: false })
    }

    /// Sets whether alpha masks are ignored, so that masked materials show and cast as solid.
    #[must_use]
    pub fn opaque(self, opaque: bool) -> Self {
        Self { opaque, ..self }
    }

    /// Whether alpha masks are ignored.
    pub fn is_opaque(&self) -> bool {
        self.opaque
    }

    /// The scene that rays are traced in.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// A box around everything that is seen, apart from a sky, world space, metres; [`Aabb::EMPTY`]
    /// if there are no triangles. The box is loose around rotated instances; [`Scene::bounds`]
    /// gives the exact box.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// At most `limit` boxes that together hold everything seen, apart from a sky, world space,
    /// metres. They leave
    /// out much of the empty space that a single box around the scene would hold. Boxes may
    /// overlap. A `limit` of 0 counts as 1, because something must hold what is drawn. Without
    /// triangles there are no boxes.
    ///
    /// The boxes are those of the hierarchies that rays are traced with. Starting at the root, the
    /// box with the largest surface area is replaced by its children first, as long as the limit
    /// allows.
    pub fn boxes(&self, limit: usize) -> Vec<Aabb> {
        let part = |aabb: Aabb, what| Opened { aabb: aabb.intersection(self.bounds), what };
        let tree = self.receivers.as_ref().unwrap_or(&self.instances);
        let instances = |node| part(tree.aabb(node), What::Instances(node));
        let boxes_of = |instance: u32| {
            let placement = &self.placements[instance as usize];
            (placement, &self.meshes[placement.mesh].boxes)
        };
        let triangles = |instance, node| {
            let (placement, boxes) = boxes_of(instance);
            part(placement.bounds(boxes.aabb(node)), What::Triangles(instance, node))
        };
        let triangle = |primitive: PrimitiveRef| {
            let (placement, _) = boxes_of(primitive.instance);
            let to_world = |p| placement.world_from_mesh.transform_point3(p);
            part(Aabb::around(self.corners(primitive).map(to_world)), What::Triangle)
        };
        let open = |what| -> Vec<Opened> {
            match what {
                What::Instances(node) => match tree.open(node) {
                    Ok(nodes) => nodes.map(instances).into(),
                    Err(leaf) => leaf
                        .iter()
                        .filter_map(|&i| Some(triangles(i, boxes_of(i).1.root()?)))
                        .collect(),
                },
                What::Triangles(instance, node) => match boxes_of(instance).1.open(node) {
                    Ok(nodes) => nodes.map(|node| triangles(instance, node)).into(),
                    Err(leaf) => {
                        let of_leaf = leaf.iter().map(|&t| PrimitiveRef { instance, triangle: t });
                        of_leaf.map(triangle).collect()
                    }
                },
                What::Triangle => Vec::new(),
            }
        };
        let mut opened: BinaryHeap<Opened> = tree.root().map(instances).into_iter().collect();
        let mut closed = Vec::new();
        while let Some(largest) = opened.pop() {
            let parts = open(largest.what);
            let fits = opened.len() + closed.len() + parts.len() <= limit.max(1);
            if matches!(largest.what, What::Triangle) || !fits {
                closed.push(largest.aabb);
            } else {
                // An instance whose triangles all lack area has no boxes, because it is not drawn.
                opened.extend(parts);
            }
        }
        closed
    }

    /// The first hit of what is seen with `range[0] ≤ t < range[1]`; either end may be infinite. Of
    /// several hits at equal t it is the one with the smallest [`PrimitiveRef`]. Rays with
    /// coordinates that are not finite hit nothing.
    pub fn closest(&self, ray: Ray, range: [f64; 2]) -> Option<Hit> {
        self.first(ray, range, IS_SEEN, None)
    }

    /// The first hit of what casts shadows, as [`closest`](Self::closest) finds what is seen.
    pub fn closest_caster(&self, ray: Ray, range: [f64; 2]) -> Option<Hit> {
        self.first(ray, range, CASTS, None)
    }

    /// As [`closest_caster`](Self::closest_caster), for a ray of light from a lamp at this world
    /// position. Planes that hold the lamp are left out, as by
    /// [`hidden_from_lamp`](Self::hidden_from_lamp).
    pub fn closest_from_lamp(&self, lamp: DVec3, ray: Ray, range: [f64; 2]) -> Option<Hit> {
        self.first(ray, range, CASTS, Some(lamp))
    }

    fn first(
        &self,
        ray: Ray,
        range: [f64; 2],
        is_wanted: Wanted,
        lamp: Option<DVec3>,
    ) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.visit(ray, range, is_wanted, |primitive, hit| {
            let nearer = best.is_none_or(|b| (hit.t, primitive) < (b.t, b.primitive));
            let is_hit = nearer
                && hit.t >= range[0]
                && hit.t < range[1]
                && self.is_there(primitive, hit)
                && !lamp.is_some_and(|lamp| self.is_edge_on(primitive, lamp));
            if is_hit {
                best = Some(Hit { t: hit.t, primitive, barycentrics: hit.weights });
            }
            Some(best.map_or(range[1], |b| b.t))
        });
        best
    }

    /// Whether anything that casts shadows is hit with `range[0] ≤ t < range[1]`.
    pub fn occluded(&self, ray: Ray, range: [f64; 2]) -> bool {
        self.any(None, ray, range, Ends::default(), CASTS)
    }

    /// Whether anything that casts shadows lies in `direction` from a point on a surface, nearer
    /// than `end` lengths of `direction`.
    ///
    /// The surface does not hide itself, although no epsilon is used: the search skips the point's
    /// own triangle, and every other triangle whose plane the point lies in as far as double
    /// precision can tell. Such triangles are neighbours at their shared edge and copies of the
    /// triangle. It also skips triangles that may have been coplanar with the point's own before
    /// the corners of both were rounded to single precision, such as decals.
    pub fn occluded_from(&self, surface: &Surface, direction: DVec3, end: f64) -> bool {
        self.occluded_among(None, surface, direction, end)
    }

    /// [`occluded_from`](Self::occluded_from), by some triangles or by any.
    pub(crate) fn occluded_among(
        &self,
        among: Option<&[PrimitiveRef]>,
        surface: &Surface,
        direction: DVec3,
        end: f64,
    ) -> bool {
        let ends = Ends { departure: Some(surface), lamp: None };
        self.any(among, surface.ray(direction), [0.0, end], ends, CASTS)
    }

    /// As [`occluded_from`](Self::occluded_from), but for what is seen in place of what casts
    /// shadows.
    pub(crate) fn hidden_from(&self, surface: &Surface, direction: DVec3, end: f64) -> bool {
        let ends = Ends { departure: Some(surface), lamp: None };
        self.any(None, surface.ray(direction), [0.0, end], ends, IS_SEEN)
    }

    /// Whether anything that casts shadows lies between a point on a surface and a lamp, which is a
    /// point in world space.
    ///
    /// The surface does not hide itself, as with [`occluded_from`](Self::occluded_from). A triangle
    /// whose plane holds the lamp is seen edge-on from it and hides nothing either, such as the
    /// ceiling that a downlight is flush with. Whether the plane holds the lamp is decided within
    /// the errors of stored coordinates, so a housing casts however near to the lamp it is. Light
    /// reaches such a triangle itself along its visible side.
    pub fn hidden_from_lamp(&self, surface: &Surface, lamp: DVec3) -> bool {
        self.hidden_among(None, surface, lamp)
    }

    /// [`hidden_from_lamp`](Self::hidden_from_lamp), by some triangles or by any.
    pub(crate) fn hidden_among(
        &self,
        among: Option<&[PrimitiveRef]>,
        surface: &Surface,
        lamp: DVec3,
    ) -> bool {
        let own = self.plane(surface.primitive);
        let mut ray = surface.ray(lamp - surface.position);
        let mut ends = Ends { departure: Some(surface), lamp: Some(lamp) };
        if own.holds_lamp(lamp) {
            // The light grazes the surface. Rounding must not decide on which side of it the ray
            // runs, for on the other one may be the body that the surface belongs to.
            let beside = 2.0 * (own.lamp_error(lamp) + surface.position_error);
            ray.origin += surface.geometric_normal * beside;
            ends.departure = None;
        }
        self.any(among, ray, [0.0, 1.0], ends, CASTS)
    }

    /// Whether a triangle is seen edge-on from a lamp, because its plane holds the lamp as far as
    /// rounding can tell.
    pub fn is_edge_on(&self, primitive: PrimitiveRef, lamp: DVec3) -> bool {
        self.plane(primitive).holds_lamp(lamp)
    }

    /// World position of a hit, metres, computed from the triangle's corners, not along the ray.
    pub fn position(&self, hit: &Hit) -> DVec3 {
        let placement = &self.placements[hit.primitive.instance as usize];
        let corners = self.corners(hit.primitive);
        placement.world_from_mesh.transform_point3(weigh(corners, hit.barycentrics))
    }

    /// The surface at a hit, as seen by a ray that travels in `view_direction`.
    pub fn surface(&self, hit: &Hit, view_direction: DVec3) -> Surface {
        let Hit { primitive, barycentrics, .. } = *hit;
        let placement = &self.placements[primitive.instance as usize];
        let mesh = &self.scene.meshes[placement.mesh];
        let corners = self.corners(primitive);
        let position = self.position(hit);
        let world_normal = |mesh_normal: DVec3| {
            (placement.mesh_from_world.transpose() * mesh_normal).try_normalize()
        };
        let plane = normal_of(corners);
        let geometric_normal = world_normal(plane / plane.abs().max_element()).map_or_else(
            || -view_direction.normalize_or_zero(),
            |n| if n.dot(view_direction) > 0.0 { -n } else { n },
        );
        let indices = mesh.triangles[primitive.triangle as usize].map(|i| i as usize);
        let shading_normal = (!mesh.normals.is_empty())
            .then(|| weigh(indices.map(|i| mesh.normals[i].as_dvec3()), barycentrics))
            .and_then(world_normal)
            .filter(|n| n.is_finite())
            .map_or(geometric_normal, |n| if n.dot(geometric_normal) < 0.0 { -n } else { n });
        let uv = texture_coordinates(mesh, primitive, barycentrics);
        let material = &self.scene.materials[mesh.material];
        let texture = self.texture(material, mesh);
        let color = texture.map_or(Vec3::ONE, |t| t.sample(uv).truncate());
        Surface {
            primitive,
            position,
            position_error: placement.position_error(corners, position),
            geometric_normal,
            shading_normal,
            uv,
            base_color: material.base_color.truncate() * color,
        }
    }

    fn texture(&self, material: &Material, mesh: &Mesh) -> Option<&'a Texture> {
        texture_of(self.scene, material, mesh)
    }

    fn corners(&self, primitive: PrimitiveRef) -> [DVec3; 3] {
        let mesh = &self.scene.meshes[self.placements[primitive.instance as usize].mesh];
        corners(mesh, primitive.triangle)
    }

    /// The triangles that a lamp lies in or beside: those [edge-on](Self::is_edge_on) to it whose
    /// boxes are within a thousandth of the scene's size of it. In single precision such a triangle
    /// may pass before the lamp, and then seems to hide everything.
    pub fn edge_on_at(&self, lamp: DVec3) -> Vec<PrimitiveRef> {
        let reach = self.bounds.size().length() / 1024.0;
        let mut found = Vec::new();
        for instance in self.instances.around(lamp, reach) {
            let placement = &self.placements[instance as usize];
            let local = placement.mesh_from_world * (lamp - placement.world_from_mesh.translation);
            let reach = reach * stretch(placement.mesh_from_world);
            let triangles = self.meshes[placement.mesh].boxes.around(local, reach);
            let triangles =
                triangles.into_iter().map(|triangle| PrimitiveRef { instance, triangle });
            found.extend(triangles.filter(|&primitive| self.is_edge_on(primitive, lamp)));
        }
        found.sort_unstable();
        found
    }

    fn plane(&self, primitive: PrimitiveRef) -> TrianglePlane<'_> {
        let placement = &self.placements[primitive.instance as usize];
        TrianglePlane::new(placement, self.corners(primitive))
    }

    /// Whether a ray meets any of some triangles, all of which are wanted, or any of all that are.
    fn any(
        &self,
        among: Option<&[PrimitiveRef]>,
        ray: Ray,
        range: [f64; 2],
        ends: Ends<'_>,
        is_wanted: Wanted,
    ) -> bool {
        let hides = |primitive, hit: &TriangleHit| {
            hit.t >= range[0]
                && hit.t < range[1]
                && !ends.departure.is_some_and(|from| self.is_left_behind(from, primitive))
                && !ends.lamp.is_some_and(|lamp| self.is_edge_on(primitive, lamp))
                && self.is_there(primitive, hit)
        };
        if let Some(among) = among {
            return self.hits(among, ray).any(|(primitive, hit)| hides(primitive, &hit));
        }
        let mut found = false;
        self.visit(ray, range, is_wanted, |primitive, hit| {
            found = hides(primitive, hit);
            (!found).then_some(range[1])
        });
        found
    }

    /// Whether a ray that started on a surface started on this very triangle, or in its plane as
    /// far as rounding can tell.
    fn is_left_behind(&self, from: &Surface, primitive: PrimitiveRef) -> bool {
        let Surface { position, position_error, .. } = *from;
        let is_in_plane = || {
            let own = self.plane(from.primitive);
            self.plane(primitive).holds_point_of(&own, position, position_error)
        };
        primitive == from.primitive || is_in_plane()
    }

    /// Whether the alpha mask leaves a surface at the hit.
    fn is_there(&self, primitive: PrimitiveRef, hit: &TriangleHit) -> bool {
        let index = self.placements[primitive.instance as usize].mesh;
        let Some(mask) = self.meshes[index].mask.as_ref().filter(|_| !self.opaque) else {
            return true;
        };
        let mesh = &self.scene.meshes[index];
        let uv = texture_coordinates(mesh, primitive, hit.weights);
        let alpha = mask.texture.map_or(1.0, |t| t.sample_alpha(uv));
        mask.factor * alpha * vertex_alpha(mesh, primitive, hit.weights) >= mask.cutoff
    }

    /// Calls `visit` with every triangle of the wanted instances that the ray meets, and with some
    /// beyond the range. `visit` returns the new end of the range, or `None` to stop the search.
    fn visit(
        &self,
        ray: Ray,
        range: [f64; 2],
        is_wanted: Wanted,
        mut visit: impl FnMut(PrimitiveRef, &TriangleHit) -> Option<f64>,
    ) {
        let is_ray = ray.origin.is_finite()
            && ray.direction.is_finite()
            && ray.direction != DVec3::ZERO
            && range[0] < range[1];
        if !is_ray {
            return;
        }
        let mut end = range[1];
        self.instances.visit(ray, range, |instance| {
            let placement = &self.placements[instance as usize];
            if !is_wanted(placement.role) {
                return Some(end);
            }
            let mesh = &self.scene.meshes[placement.mesh];
            let local = placement.ray_in_mesh(ray);
            let sheared = ShearedRay::new(local);
            let mut stopped = false;
            self.meshes[placement.mesh].boxes.visit(local, [range[0], end], |triangle| {
                if let Some(hit) = sheared.intersect(corners(mesh, triangle)) {
                    match visit(PrimitiveRef { instance, triangle }, &hit) {
                        Some(nearer) => end = nearer,
                        None => stopped = true,
                    }
                }
                (!stopped).then_some(end)
            });
            (!stopped).then_some(end)
        });
    }
}

impl<'a> MeshBoxes<'a> {
    fn build(mesh: &'a Mesh, slack: f64, scene: &'a Scene) -> Self {
        let boxes: Vec<(u32, Aabb)> = (0..mesh.triangles.len() as u32)
            .map(|i| (i, corners(mesh, i)))
            .filter(|&(_, c)| normal_of(c) != DVec3::ZERO)
            .map(|(i, c)| (i, Aabb::around(c)))
            .collect();
        let material = &scene.materials[mesh.material];
        let mask = match material.alpha {
            Alpha::Opaque => None,
            Alpha::Mask { cutoff } => Some(Mask {
                cutoff,
                factor: material.base_color.w,
                texture: texture_of(scene, material, mesh),
            }),
        };
        Self { boxes: Boxes::build(&boxes, slack), mask }
    }
}

fn corners(mesh: &Mesh, triangle: u32) -> [DVec3; 3] {
    mesh.triangles[triangle as usize].map(|i| mesh.positions[i as usize].as_dvec3())
}

fn weigh([a, b, c]: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    a * weights[0] + b * weights[1] + c * weights[2]
}

fn texture_coordinates(mesh: &Mesh, primitive: PrimitiveRef, weights: [f64; 3]) -> Vec2 {
    if mesh.uvs.is_empty() {
        return Vec2::ZERO;
    }
    let [a, b, c] =
        mesh.triangles[primitive.triangle as usize].map(|i| mesh.uvs[i as usize].as_dvec2());
    (a * weights[0] + b * weights[1] + c * weights[2]).as_vec2()
}

/// The alpha of the vertices, interpolated.
fn vertex_alpha(mesh: &Mesh, primitive: PrimitiveRef, weights: [f64; 3]) -> f32 {
    if mesh.alphas.is_empty() {
        return 1.0;
    }
    let corners = mesh.triangles[primitive.triangle as usize];
    let alphas = corners.map(|i| f64::from(mesh.alphas[i as usize]));
    (alphas[0] * weights[0] + alphas[1] * weights[1] + alphas[2] * weights[2]) as f32
}

/// The texture of a material; `None` if it has none or the mesh has no texture coordinates.
fn texture_of<'a>(scene: &'a Scene, material: &Material, mesh: &Mesh) -> Option<&'a Texture> {
    let id = material.base_color_texture.filter(|_| !mesh.uvs.is_empty())?;
    Some(&scene.textures[id.0])
}
