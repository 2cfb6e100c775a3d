//! Planes of triangles, and how far rounding may have moved them.

use crate::placement::Placement;
use glam::DVec3;

/// Bound of what single precision took from a coordinate, relative to the coordinate. Rounding
/// takes up to 2⁻²⁴. It counts twice, because a point may lie beside the triangle whose plane is
/// meant.
const STORED: f64 = 1.0 / (1 << 23) as f64;

/// Bound of what some ten steps in double precision take, relative to the coordinates.
pub(crate) const COMPUTED: f64 = 1.0 / (1u64 << 49) as f64;

/// The largest part of its own length by which a triangle is taken to have been moved when its
/// corners were stored. Rounding that moved corners farther would have left no plane to speak of.
/// So far from the origin it is likelier that the coordinates needed no rounding.
const LARGEST_SHIFT: f64 = 1.0 / 1024.0;

/// The plane of a triangle of an instance.
///
/// Two bounds tell whether a point lies in the plane. The *computed* error is that of the
/// computation here and is always there. The *stored* error is what storing corners in single
/// precision may have added before. Both count across the plane alone: corners that were moved
/// along the plane have not moved the plane.
pub(crate) struct TrianglePlane<'a> {
    placement: &'a Placement,
    /// Mesh space.
    corners: [DVec3; 3],
    /// Mesh space; its length is twice the triangle's area there.
    normal: DVec3,
    /// `normal` in world space, not of unit length.
    world_normal: DVec3,
}

impl<'a> TrianglePlane<'a> {
    /// The plane of a triangle with an area, whose corners are in the mesh space of `placement`.
    pub(crate) fn new(placement: &'a Placement, corners: [DVec3; 3]) -> Self {
        let normal = normal_of(corners);
        let world_normal = placement.mesh_from_world.transpose() * normal;
        Self { placement, corners, normal, world_normal }
    }

    /// Whether a point of another triangle may lie in this plane. `position_error` is the computed
    /// error of the point, metres.
    ///
    /// The stored error counts only if the two triangles may have been coplanar before their
    /// corners were rounded. A wall and the floor that it stands on are not, so rounding makes no
    /// difference to which of them hides the other.
    pub(crate) fn holds_point_of(
        &self,
        other: &TrianglePlane<'_>,
        point: DVec3,
        position_error: f64,
    ) -> bool {
        let distance = self.distance(point);
        let computed = self.computed_error(point) + position_error;
        if distance <= computed {
            return true;
        }
        let largest = self.largest_shift().min(other.largest_shift());
        let stored = (self.stored_error(self) + self.stored_error(other)).min(largest);
        distance <= computed + stored
            && (self.holds_corners_of(other, largest) || other.holds_corners_of(self, largest))
    }

    /// Whether a lamp at this world position may lie in the plane, which then hides none of its
    /// light.
    pub(crate) fn holds_lamp(&self, lamp: DVec3) -> bool {
        self.distance(lamp) <= self.lamp_error(lamp)
    }

    /// Bound of the errors in a lamp's distance from the plane, metres. The lamp's position was
    /// stored in single precision as well.
    pub(crate) fn lamp_error(&self, lamp: DVec3) -> f64 {
        let stored = self.stored_error(self) + self.across(self.world_normal, lamp);
        self.computed_error(lamp) + stored.min(self.largest_shift())
    }

    fn holds_corners_of(&self, other: &TrianglePlane<'_>, largest: f64) -> bool {
        let stored = (self.stored_error(self) + self.stored_error(other)).min(largest);
        other.corners.iter().all(|&corner| {
            let corner = other.placement.world_from_mesh.transform_point3(corner);
            let computed = self.computed_error(corner) + other.computed_error(corner);
            self.distance(corner) <= computed + stored
        })
    }

    /// Distance of a world point from the plane, metres.
    fn distance(&self, point: DVec3) -> f64 {
        // The product n·(a − p) is the same number in mesh space and in world space. Divided by the
        // length of the world-space normal, it is the distance in world space.
        self.normal.dot(self.relative(point)).abs() / self.world_normal.length()
    }

    /// A world point relative to the triangle's first corner, mesh space.
    fn relative(&self, point: DVec3) -> DVec3 {
        let Placement { world_from_mesh, mesh_from_world, .. } = self.placement;
        *mesh_from_world * (point - world_from_mesh.translation) - self.corners[0]
    }

    /// Bound of the error of [`distance`](Self::distance), metres. Besides the rounding of
    /// coordinates it has that of the normal, which grows with the triangle's slenderness.
    fn computed_error(&self, point: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        let slenderness = (b - a).length() * (c - a).length() / self.normal.length();
        let turned = self.relative(point).length() * self.placement.stretch * slenderness;
        self.placement.position_error(self.corners, point) + COMPUTED * 0.25 * turned
    }

    /// How far storing the corners of `other` may have moved its points across this plane, metres.
    fn stored_error(&self, other: &TrianglePlane<'_>) -> f64 {
        let across = other.placement.world_from_mesh.matrix3.transpose() * self.world_normal;
        other.corners.iter().map(|&c| self.across(across, c)).fold(0.0, f64::max)
    }

    /// The stored error of a point across this plane, metres, if `normal` is the plane's normal in
    /// the space of the point, as long as `world_normal` is.
    fn across(&self, normal: DVec3, point: DVec3) -> f64 {
        STORED * normal.abs().dot(point.abs()) / self.world_normal.length()
    }

    /// The farthest that the triangle is taken to have been moved when it was stored, metres.
    fn largest_shift(&self) -> f64 {
        let [a, b, c] = self.corners;
        let world = |edge: DVec3| (self.placement.world_from_mesh.matrix3 * edge).length();
        LARGEST_SHIFT * world(b - a).max(world(c - b)).max(world(a - c))
    }
}

/// The normal of a triangle in the space of its corners; its length is twice the triangle's area.
pub(crate) fn normal_of([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}
