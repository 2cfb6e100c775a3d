//! Beams: bundles of neighbouring rays that search the hierarchies together.
//!
//! Neighbouring rays pass the same boxes and meet the same few triangles. A beam finds these
//! triangles once, and each of its rays is then tested against them alone. The hits are the same to
//! the last bit as those of rays that search by themselves.

use super::{Hit, PrimitiveRef, Tracer, Wanted, corners};
use crate::Ray;
use crate::boxes::Boxes;
use crate::triangle::{ShearedRay, TriangleHit};
use glam::{DAffine3, DVec3};
use umbrage::Aabb;

/// A beam that meets more triangles than this is not worth its while: its rays had better search by
/// themselves.
const MOST_TRIANGLES: usize = 32;

/// Bound of the rounding errors of a triangle's distance along an axis, relative to the coordinates
/// that the distance is computed from. The errors in double precision are some 10⁻¹⁵ of these.
const ROUNDING: f64 = 1e-12;

/// A convex region of space that holds a bundle of rays: what lies in all of five slabs.
pub(crate) struct Beam {
    /// The point from which distances along the axes count.
    origin: DVec3,
    slabs: [Slab; 5],
}

/// The space between two parallel planes, which are given by their distances along an axis.
#[derive(Clone, Copy)]
struct Slab {
    axis: DVec3,
    range: [f64; 2],
}

/// Where the rays of a beam end.
#[derive(Clone, Copy)]
pub(crate) enum End {
    /// The beam goes on in this direction, in which all its rays run.
    Endless(DVec3),
    /// All rays end at this point.
    Point(DVec3),
}

impl Beam {
    /// A beam of rays from one quadrilateral to another. The corners are given in order, each with
    /// the one that the ray from it ends at.
    pub(crate) fn between(from: [DVec3; 4], to: [DVec3; 4]) -> Self {
        let ray = |i: usize| to[i] - from[i];
        let side = |i: usize| (to[(i + 1) % 4] - to[i]).cross(ray(i));
        let along = (0..4).map(ray).sum();
        Self::new(std::array::from_fn(side), along, &from.into_iter().chain(to), f64::NEG_INFINITY)
    }

    /// A beam of rays that begin at these points. The corners of the points' outline are given in
    /// order.
    pub(crate) fn of_points(
        outline: [DVec3; 4],
        points: impl Iterator<Item = DVec3> + Clone,
        end: End,
    ) -> Self {
        let edge = |i: usize| outline[(i + 1) % 4] - outline[i];
        match end {
            End::Endless(direction) => {
                let side = |i| edge(i).cross(direction);
                Self::new(std::array::from_fn(side), direction, &points, f64::INFINITY)
            }
            End::Point(end) => {
                let side = |i| edge(i).cross(end - outline[i]);
                let along = end - outline[0];
                let points = points.chain([end]);
                Self::new(std::array::from_fn(side), along, &points, f64::NEG_INFINITY)
            }
        }
    }

    /// The region that holds all `points`, and along the beam whatever lies before `end`.
    fn new(
        sides: [DVec3; 4],
        along: DVec3,
        points: &(impl Iterator<Item = DVec3> + Clone),
        end: f64,
    ) -> Self {
        let origin = points.clone().next().unwrap_or_default();
        let slab = |axis: DVec3, end: f64| {
            // Where a side has no area, its axis is zero, and everything lies in its slab.
            let axis = axis.normalize_or_zero();
            let distances = points.clone().map(|point| axis.dot(point - origin));
            let range = distances.fold([f64::INFINITY, end], |r, d| [r[0].min(d), r[1].max(d)]);
            Slab { axis, range }
        };
        let [a, b, c, d] = sides.map(|side| slab(side, f64::NEG_INFINITY));
        Self { origin, slabs: [a, b, c, d, slab(along, end)] }
    }

    /// The region in the space that `world_from_mesh` is from.
    fn in_mesh(&self, world_from_mesh: &DAffine3) -> [Slab; 5] {
        let from_origin = world_from_mesh.translation - self.origin;
        self.slabs.map(|Slab { axis, range }| {
            let shift = axis.dot(from_origin);
            let error = ROUNDING * from_origin.abs().max_element();
            Slab {
                axis: world_from_mesh.matrix3.transpose() * axis,
                range: [range[0] - shift - error, range[1] - shift + error],
            }
        })
    }
}

impl Slab {
    /// Whether any point of the box may lie in the slab.
    fn meets_box(&self, aabb: Aabb) -> bool {
        let middle = self.axis.dot(aabb.center());
        let half = self.axis.abs().dot(aabb.size()) / 2.0;
        middle + half >= self.range[0] && middle - half <= self.range[1]
    }

    /// Whether any point of the triangle may lie in the slab.
    fn meets_triangle(&self, corners: [DVec3; 3]) -> bool {
        let error = corners.iter().fold(0.0, |e: f64, c| e.max(self.axis.abs().dot(c.abs())));
        let [a, b, c] = corners.map(|corner| self.axis.dot(corner));
        let error = ROUNDING * error;
        a.max(b).max(c) + error >= self.range[0] && a.min(b).min(c) - error <= self.range[1]
    }
}

impl Tracer<'_> {
    /// Puts the triangles of the wanted instances that any ray of a beam may meet into `found`.
    /// Returns `false` if there are so many that the search was given up.
    pub(crate) fn search(
        &self,
        beam: &Beam,
        is_wanted: Wanted,
        found: &mut Vec<PrimitiveRef>,
    ) -> bool {
        found.clear();
        let in_world = beam.in_mesh(&DAffine3::IDENTITY);
        search(&self.instances, &in_world, |instance| {
            let placement = &self.placements[instance as usize];
            if !is_wanted(placement.role) {
                return true;
            }
            let slabs = beam.in_mesh(&placement.world_from_mesh);
            let mesh = &self.scene.meshes[placement.mesh];
            search(&self.meshes[placement.mesh].boxes, &slabs, |triangle| {
                let corners = corners(mesh, triangle);
                if slabs.iter().all(|slab| slab.meets_triangle(corners)) {
                    found.push(PrimitiveRef { instance, triangle });
                }
                found.len() <= MOST_TRIANGLES
            })
        })
    }

    /// [`closest`](Self::closest) among some triangles.
    pub(crate) fn closest_among(
        &self,
        triangles: &[PrimitiveRef],
        ray: Ray,
        range: [f64; 2],
    ) -> Option<Hit> {
        let is_hit = |primitive, hit: &TriangleHit| {
            hit.t >= range[0] && hit.t < range[1] && self.is_there(primitive, hit)
        };
        let hits = self.hits(triangles, ray).filter(|(primitive, hit)| is_hit(*primitive, hit));
        let hits = hits.map(|(primitive, TriangleHit { t, weights })| Hit {
            t,
            primitive,
            barycentrics: weights,
        });
        hits.min_by(|a, b| a.t.total_cmp(&b.t).then(a.primitive.cmp(&b.primitive)))
    }

    /// Whether a triangle has surface everywhere between its corners.
    pub(crate) fn is_solid(&self, primitive: PrimitiveRef) -> bool {
        let mesh = self.placements[primitive.instance as usize].mesh;
        self.opaque || self.meshes[mesh].mask.is_none()
    }

    /// Where a ray's line meets these triangles.
    pub(super) fn hits(
        &self,
        triangles: &[PrimitiveRef],
        ray: Ray,
    ) -> impl Iterator<Item = (PrimitiveRef, TriangleHit)> {
        let mut sheared: Option<(u32, ShearedRay)> = None;
        triangles.iter().filter_map(move |&primitive| {
            // Triangles of one instance follow one another.
            let (_, sheared) = match &mut sheared {
                Some(known) if known.0 == primitive.instance => known,
                last => {
                    let placement = &self.placements[primitive.instance as usize];
                    let local = ShearedRay::new(placement.ray_in_mesh(ray));
                    last.insert((primitive.instance, local))
                }
            };
            Some((primitive, sheared.intersect(self.corners(primitive))?))
        })
    }
}

/// Calls `visit` with each primitive whose box may lie in the slabs, until it returns `false`.
/// Returns whether it never did.
fn search(boxes: &Boxes, slabs: &[Slab; 5], mut visit: impl FnMut(u32) -> bool) -> bool {
    let mut open: Vec<_> = boxes.root().into_iter().collect();
    while let Some(node) = open.pop() {
        let aabb = boxes.aabb(node);
        if !slabs.iter().all(|slab| slab.meets_box(aabb)) {
            continue;
        }
        match boxes.open(node) {
            Ok(children) => open.extend(children),
            Err(leaf) => {
                if !leaf.iter().all(|&primitive| visit(primitive)) {
                    return false;
                }
            }
        }
    }
    true
}
